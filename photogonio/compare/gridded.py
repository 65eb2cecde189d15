"""f between the rows of a table that holds a whole grid of angles, as ``export --format csv`` writes it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from photogonio.reconstruct.modes.angles import pair_angles

DIGITS = 6  # of an angle in degrees: nodes that differ by less are one
STEP, TURN = 15.0, 30.0  # degrees between nodes, at most
MISSED = 12.0  # degrees: a grid that ends so far before the horizon, or begins so far from the normal, tells too little


def between_rows(
    incident: np.ndarray, exit: np.ndarray, value: np.ndarray
) -> Callable[[np.ndarray, np.ndarray], np.ndarray] | None:
    """f (n, c) at unit vectors (n, 3), linear between rows that are the whole grid of some theta_i, theta_r and |dphi|,
    constant outside; None of rows that are no such grid, from normal to grazing and all the way round."""
    places = np.round(np.degrees(_angles(incident, exit)), DIGITS)
    axes = [np.unique(one) for one in places]
    if any(len(axis) < 2 for axis in axes) or not _whole(axes):
        return None
    cells = np.stack([np.searchsorted(axis, one) for axis, one in zip(axes, places, strict=True)])
    sums, counts = np.zeros((*map(len, axes), value.shape[1])), np.zeros(tuple(map(len, axes)))
    np.add.at(sums, tuple(cells), value)
    np.add.at(counts, tuple(cells), 1.0)
    normal = (axes[0] == 0.0)[:, None, None] | (axes[1] == 0.0)[None, :, None]  # where dphi means nothing
    grid = np.divide(sums, counts[..., None], out=np.full_like(sums, np.nan), where=counts[..., None] > 0.0)
    first = np.nanmax(np.where(counts[..., None] > 0.0, grid, -np.inf), axis=2, keepdims=True)
    grid = np.where((normal & (counts == 0.0))[..., None], first, grid)
    if not np.isfinite(grid).all():
        return None
    interpolated = RegularGridInterpolator(axes, grid)

    def evaluate(toward: np.ndarray, away: np.ndarray) -> np.ndarray:
        asked = np.degrees(_angles(toward, away))
        kept = [np.clip(one, axis[0], axis[-1]) for one, axis in zip(asked, axes, strict=True)]
        return interpolated(np.stack(kept, axis=-1))

    return evaluate


def _angles(incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
    """(3, n) theta_i, theta_r, |dphi|."""
    theta_i, theta_r, dphi = pair_angles(incident, exit)
    return np.stack([theta_i, theta_r, np.abs(dphi)])


def _whole(axes: list[np.ndarray]) -> bool:
    """Whether nodes go from the normal to grazing, and from the light's own side to the other, in small steps."""
    if any(np.diff(axis).max() > step for axis, step in zip(axes, (STEP, STEP, TURN), strict=True)):
        return False
    theta = all(axis[0] <= MISSED and axis[-1] >= 90.0 - MISSED for axis in axes[:2])
    return bool(theta and axes[2][0] <= MISSED and axes[2][-1] >= 180.0 - MISSED)
