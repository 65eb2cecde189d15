"""A plain table of angles and values: what ``photogonio fit`` and any spreadsheet reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf

_STEP, _TURN = 5.0, 15.0  # degrees, of the polar angles and of the azimuths
_LAST = 85.0  # degrees: at 90 many BRDFs have no finite value


def write_csv(brdf: Brdf, path: Path) -> None:
    """theta_i, phi_i, theta_r, phi_r in degrees and f, 1/sr, one column a channel; where it is known one standard error
    of f, in a column ``sigma`` a channel.

    Isotropic: phi_i is 0 and phi_r goes half a turn, since the other half is its mirror image.
    """
    isotropic = not brdf.turning
    polar = np.arange(0.0, _LAST + 1, _STEP)
    turn = np.arange(0.0, 360.0, _TURN)
    phi_i = np.zeros(1) if isotropic else turn
    phi_r = np.arange(0.0, 181.0, _TURN) if isotropic else turn
    grids = [grid.ravel() for grid in np.meshgrid(polar, phi_i, polar, phi_r, indexing="ij")]
    columns, names = [brdf.evaluate(*np.radians(grids))], list(brdf.channels)
    if getattr(brdf, "uncertainty", None) is not None:
        columns.append(brdf.standard_error(*np.radians(grids)))
        names += [f"sigma_{name}" for name in brdf.channels] if len(names) > 1 else ["sigma"]
    header = ",".join(["theta_i", "phi_i", "theta_r", "phi_r", *names])
    form = ["%g"] * 4 + ["%.9g"] * len(brdf.channels) + ["%.4g"] * (len(names) - len(brdf.channels))
    np.savetxt(path, np.column_stack([*grids, *columns]), fmt=form, delimiter=",", header=header, comments="")
