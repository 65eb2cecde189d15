"""
Goniometer table to Radiance
============================

A table of measured directions goes in, and a tensor tree that Radiance reads comes out. The table is drawn here, of a
surface whose f is known, with noise of 2 %; yours takes its place in the second step.

Run it in an empty folder, or give it one: ``python goniometer_to_radiance.py FOLDER``. Radiance comes with an extra
(``pip install 'photogonio[consumers]'`` brings pyradiance); without it the export is written and its loss told all
the same.
"""

import importlib.util
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import photogonio as pg

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")

# %%
# A table
# -------
# A satin surface: Lambert's law with albedo 0.4, and microfacets of GGX slopes, roughness 0.3, whose reflectance is
# 0.04 straight on (Schlick) and whose facets hide one another (Smith's masking, correlated).


def satin(theta_i, theta_r, dphi, albedo=0.4, roughness=0.3, f0=0.04):
    """f, 1/sr, at angles in radians; dphi = pi is the mirror direction."""
    cos_i, cos_r = np.cos(theta_i), np.cos(theta_r)
    cos_between = np.sin(theta_i) * np.sin(theta_r) * np.cos(dphi) + cos_i * cos_r
    cos_d = np.sqrt((1 + cos_between) / 2)  # from the half vector to either direction
    cos_h = (cos_i + cos_r) / (2 * cos_d)  # from the normal to the half vector
    a2 = roughness**2
    density = a2 / (np.pi * (cos_h**2 * (a2 - 1) + 1) ** 2)
    hidden_i, hidden_r = ((np.sqrt(1 + a2 * (1 / cos**2 - 1)) - 1) / 2 for cos in (cos_i, cos_r))
    reflectance = f0 + (1 - f0) * (1 - cos_d) ** 5
    return albedo / np.pi + reflectance * density / (4 * cos_i * cos_r * (1 + hidden_i + hidden_r))


steps = np.arange(0.0, 76.0, 15.0), np.arange(0.0, 81.0, 8.0), np.arange(0.0, 181.0, 15.0)
theta_i, theta_r, dphi = (grid.ravel() for grid in np.meshgrid(*steps, indexing="ij"))
exact = satin(*np.radians([theta_i, theta_r, dphi]))
noise = 0.02 * exact
read = exact + noise * np.random.default_rng(1).standard_normal(len(exact))
columns = np.column_stack([theta_i, 0 * theta_i, theta_r, dphi, read, noise])
table = folder / "satin.csv"
np.savetxt(table, columns, "%.6g", delimiter=",", header="theta_i,phi_i,theta_r,phi_r,Y,sigma_Y", comments="")
print(len(read), "rows")

# %%
# Fit
# ---
# The same as ``photogonio fit satin.csv -o satin-brdf``.

result = pg.fit(table, folder / "satin-brdf", pg.Options(workers=1))
b = result.brdf
print(b)
for warning in result.warnings:
    print("warning:", warning)

# %%
# What is found between the rows, at directions that the table does not have, beside what is true there.

there = np.radians([[40.0, 37.0, 172.0], [50.0, 20.0, 100.0], [10.0, 60.0, 40.0]])
f, error = b.angles(*there.T)[:, 0], b.standard_error(*there.T)[:, 0]
for angles, value, one, true in zip(there, f, error, satin(*there.T), strict=True):
    print("at", np.degrees(angles).round(), f"found {value:.4f} +- {1.96 * one:.4f} true {true:.4f}")

# %%
# Radiance
# --------
# A tensor tree, read back to tell what it loses; then f at the same directions, as Radiance's own library finds it in
# the file. It takes angles in degrees.

path = folder / "satin.xml"
print(b.export("radiance", path))
if importlib.util.find_spec("pyradiance"):
    from pyradiance import bsdf

    known = bsdf.load_file(str(path))
    asked = [
        bsdf.query(known, theta_i, 0.0, theta_r, dphi)[1] for theta_i, theta_r, dphi in np.degrees(there)
    ]
    print("Radiance finds", np.array(asked, float).round(4))
else:
    print("pyradiance is not installed")

# %%
# The plane of incidence at 45 degrees: the rows of the table, the truth, and the fit with its 95 % interval.

theta = np.radians(
    np.linspace(-80.0, 80.0, 161)
)  # beyond the normal, toward the mirror direction, is positive
where = np.radians(45.0), np.abs(theta), np.where(theta > 0, np.pi, 0.0)
f, half = b.angles(*where)[:, 0], 1.96 * b.standard_error(*where)[:, 0]
figure, axes = plt.subplots(figsize=(6, 3.5), layout="constrained")
axes.fill_between(np.degrees(theta), f - half, f + half, alpha=0.4, label="fit, 95 %")
axes.plot(np.degrees(theta), satin(*where), "k", lw=0.8, label="truth")
for side, turn in ((-1, 0.0), (1, 180.0)):
    rows = (theta_i == 45.0) & (dphi == turn)
    axes.plot(side * theta_r[rows], read[rows], "k.", label="rows" if side > 0 else None)
axes.set(xlabel="exit angle, degrees", ylabel="f, 1/sr", title="light from 45 degrees")
axes.legend()
figure.savefig(folder / "satin.png", dpi=100)
