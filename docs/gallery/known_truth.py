"""
Evaluate on known truth
=======================

Whether stated errors are honest is seen only where the answer is known. A set is rendered from a known BRDF, with
noise, lens and lamps as photos have them, measured with everything automatic, and held against the truth.

Run it in an empty folder, or give it one: ``python known_truth.py FOLDER``. ``photogonio evaluate`` does this for many
scenes, with a page of what came of each.
"""

import sys
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import photogonio as pg
from photogonio.synthetic.scene.scene import load_scene

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

# %%
# A world whose answer is known
# -----------------------------
# Rough clay (Oren and Nayar), eight photos of 300 x 200 pixels. ``truth.json`` beside them is not read by what follows
# but to judge it.

scene = load_scene("oren-nayar-ball")
scene = replace(
    scene,
    camera=replace(scene.camera, size=(300, 200), focal=scene.camera.focal / 2, calibration=4),
    lamp=replace(scene.lamp, count=8),
)
photos = pg.synthesize(scene, folder / "clay")
result = pg.process(photos, folder / "clay-brdf", pg.Options(workers=1))
b, truth = result.brdf, pg.load(photos)
print(b)
for warning in result.warnings:
    print("warning:", warning)

# %%
# How far off
# -----------
# The measures of docs/metrics.md, with both angles below 70 degrees.

comparison = b.compare(truth, mask=np.radians(70.0))
for name in ("relative_l2", "albedo_error", "correlation"):
    print(name, comparison.measures[name].round(4))
print(f"Delta E ITP {comparison.appearance.to_dict()['delta_e_itp_mean']:.3f}")

# %%
# As far as it said?
# ------------------
# z is the error over the stated standard error, at pairs of directions spread evenly by projected solid angle. A
# stated error that is honest lets some 95 % lie within 1.96 if the error were chance alone, and nearly all where it
# allows for what could not be seen. Which ones lie outside tells more than how many: here 19 of 2000 pairs, all with
# nearly equal angles beyond 55 degrees on the lamp's side, 13 to 60 degrees of azimuth apart, where rough clay is
# brightest. Eight photos and smooth modes leave it too dark there, by up to 4.6 standard errors. The p of a comparison
# looks at the worst place too, and finds them.

rng = np.random.default_rng(1)
theta_i, theta_r = np.arcsin(np.sin(np.radians(70.0)) * np.sqrt(rng.uniform(size=(2, 2000))))
where = theta_i, theta_r, rng.uniform(0.0, np.pi, 2000)
f, true, error = b.angles(*where), truth.angles(*where), b.standard_error(*where)
z = (f - true) / error
print(f"within the 95 % interval: {100 * np.mean(np.abs(z) < 1.96):.1f} %")
print(
    f"median error {100 * np.median(np.abs(f / true - 1)):.2f} %, stated {100 * np.median(error / f):.2f} %"
)
print(comparison.significance)

albedo, true_albedo = b.albedo(), truth.albedo().value
for channel, *numbers in zip(b.channels, albedo.value, 1.96 * albedo.error, true_albedo, strict=True):
    print("albedo {} found {:.4f} +- {:.4f} true {:.4f}".format(channel, *numbers))

# %%
# Found against true, by angle of incidence; and z beside the normal distribution.

figure, (left, right) = plt.subplots(1, 2, figsize=(8, 3.5), layout="constrained")
left.plot([true.min(), true.max()], [true.min(), true.max()], "k", lw=0.6)
dots = left.scatter(true[:, 0], f[:, 0], s=2, c=np.degrees(theta_i))
left.set(xlabel="true f, 1/sr", ylabel="found f, 1/sr", title=f"channel {b.channels[0]}")
figure.colorbar(dots, label="incidence, degrees")
right.hist(z.ravel(), bins=60, range=(-4, 4), density=True)
x = np.linspace(-4, 4, 200)
right.plot(x, np.exp(-(x**2) / 2) / np.sqrt(2 * np.pi), "k")
right.set(xlabel="error / stated standard error", title="z")
figure.savefig(folder / "known_truth.png", dpi=100)
