"""
How sure am I?
==============

A result says how sure it is: an error of f at any pair of directions, of the albedo, and of whatever else you compute,
by draws from its covariance. And two results say whether they differ by more than their errors.

Three samples are measured here by a goniometer with noise of 3 %: two of the same matte paint, and one of another that
is 3 % darker. The readings are drawn, so that the truth is known.

Run it in an empty folder, or give it one: ``python how_sure.py FOLDER``.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import photogonio as pg

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

# %%
# Three tables
# ------------
# Minnaert's lunar law with k = 0.9: f = albedo (k + 1) / (2 pi) (cos_i cos_r)^(k - 1).

K = 0.9
POLAR, TURN = np.arange(0.0, 76.0, 15.0), np.arange(0.0, 181.0, 30.0)


def minnaert(theta_i, theta_r, albedo):
    """f, 1/sr, at angles in radians."""
    return albedo * (K + 1) / (2 * np.pi) * (np.cos(theta_i) * np.cos(theta_r)) ** (K - 1)


def measured(name, albedo, seed):
    """What a fit makes of a table of that surface, saved and loaded again."""
    theta_i, theta_r, dphi = (grid.ravel() for grid in np.meshgrid(POLAR, POLAR, TURN, indexing="ij"))
    exact = minnaert(*np.radians([theta_i, theta_r]), albedo)
    read = exact * (1 + 0.03 * np.random.default_rng(seed).standard_normal(len(exact)))
    columns = np.column_stack([theta_i, 0 * theta_i, theta_r, dphi, read])
    header = "theta_i,phi_i,theta_r,phi_r,Y"
    np.savetxt(folder / f"{name}.csv", columns, "%.6g", delimiter=",", header=header, comments="")
    result = pg.fit(folder / f"{name}.csv", options=pg.Options(lobes=0, workers=1))
    result.brdf.save(folder / f"{name}.json")
    return pg.load(folder / f"{name}.json")


one, same, darker = measured("one", 0.5, 1), measured("same", 0.5, 2), measured("darker", 0.485, 3)
print(one)

# %%
# Of f, and of the albedo
# -----------------------
# ``standard_error`` holds what the readings leave open, and what the model may miss between them.

where = np.radians([[0.0, 45.0, 0.0], [45.0, 45.0, 180.0], [60.0, 70.0, 90.0]])
f, error = one.angles(*where.T)[:, 0], one.standard_error(*where.T)[:, 0]
for angles, value, e, true in zip(where, f, error, minnaert(*where.T[:2], 0.5), strict=True):
    print("at", np.degrees(angles).round(), f"found {value:.4f} +- {1.96 * e:.4f} true {true:.4f}")
albedo = one.albedo()
true = 0.5 * (K + 1) / 2 * (2 / (K + 1)) ** 2  # of the law, under even light
print(f"albedo found {albedo.value[0]:.4f} +- {1.96 * albedo.error[0]:.4f} true {true:.4f}")

# %%
# Of anything else: draws
# -----------------------
# Compute it of BRDFs drawn from the covariance, and look how it scatters. Here the ratio of f at 60 and at 0 degrees
# of exit, whose error no formula has to be written down for.


def ratio(b):
    return (b.angles(0.0, np.radians(60.0), 0.0) / b.angles(0.0, 0.0, 0.0))[0]


draws = one.sample(100, seed=1)
true = minnaert(0.0, np.radians(60.0), 0.5) / minnaert(0.0, 0.0, 0.5)
print(f"ratio found {ratio(one):.4f} +- {1.96 * np.std([ratio(b) for b in draws]):.4f} true {true:.4f}")

# %%
# Do two samples differ?
# ----------------------
# p is the chance that errors of the stated size make them differ so much, were they the same.

for name, other in {"the same": same, "the darker": darker}.items():
    print(f"p = {one.compare(other).significance.p:.4f} against {name}")

# %%
# The normal's light by exit angle: the interval, twenty draws, and the truth. Readings end at 75 degrees. Beyond them
# the fit goes on as its modes do, the law steepens, and an interval knows nothing of what nobody read.

theta = np.radians(np.linspace(0.0, 80.0, 81))
f, half = one.angles(0.0, theta, 0.0)[:, 0], 1.96 * one.standard_error(0.0, theta, 0.0)[:, 0]
figure, axes = plt.subplots(figsize=(6, 3.5), layout="constrained")
axes.fill_between(np.degrees(theta), f - half, f + half, alpha=0.3, label="95 %")
for b in draws[:20]:
    axes.plot(np.degrees(theta), b.angles(0.0, theta, 0.0)[:, 0], "C0", lw=0.4)
axes.plot(np.degrees(theta), minnaert(0.0, theta, 0.5), "k", label="truth")
axes.axvline(POLAR[-1], color="0.6", ls="--", lw=0.8, label="last reading")
axes.set(xlabel="exit angle, degrees", ylabel="f, 1/sr", title="light from the normal")
axes.legend()
figure.savefig(folder / "how_sure.png", dpi=100)
