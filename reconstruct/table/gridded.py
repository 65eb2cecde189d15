"""f between the rows of a table that holds a whole grid of angles, as ``export`` writes its tables."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from photogonio.reconstruct.modes.angles import pair_angles, spherical_angles

Between = Callable[[np.ndarray, np.ndarray], np.ndarray]  # incident, exit (n, 3) -> (n, c), 1/sr
DIGITS = 6  # of an angle in degrees: nodes that differ by less are one
STEP, TURN = 15.0, 30.0  # degrees between nodes, at most
MISSED = 12.0  # degrees: a grid that ends so far before the horizon, or begins so far from the normal, tells too little
_MOST = 1.5  # nodes of a grid, in rows: of more some have none
UPRIGHT = 1e-6  # sine of an angle at which an azimuth means nothing


def between(incident: np.ndarray, exit: np.ndarray, value: np.ndarray) -> Between | None:
    """f (n, c) at unit vectors (n, 3), linear between rows that are a whole grid, of a surface that may turn if light
    came from more azimuths than one; None of other rows."""
    if of_one_rotation(incident):
        return between_rows(incident, exit, value)
    return between_turning_rows(incident, exit, value)


def of_one_rotation(incident: np.ndarray) -> bool:
    """Whether light came from one azimuth only, so that nothing tells of a surface that changes as it turns."""
    oblique = incident[np.hypot(incident[:, 0], incident[:, 1]) > UPRIGHT, :2]
    turn = oblique / np.linalg.norm(oblique, axis=1, keepdims=True)
    return len(turn) == 0 or bool(np.ptp(turn, axis=0).max() < UPRIGHT)


def between_rows(incident: np.ndarray, exit: np.ndarray, value: np.ndarray) -> Between | None:
    """f (n, c) at unit vectors (n, 3), linear between rows that are the whole grid of some theta_i, theta_r and |dphi|,
    constant outside; None of rows that are no such grid, from normal to grazing and all the way round."""
    places = np.round(np.degrees(_pair(incident, exit)), DIGITS)
    axes = [np.unique(one) for one in places]
    if any(len(axis) < 2 for axis in axes) or not _whole(axes):
        return None
    grid = _means(axes, places, value)
    normal = (axes[0] == 0.0)[:, None, None] | (axes[1] == 0.0)[None, :, None]  # where dphi means nothing
    return _linear(axes, _filled(grid, normal, axis=2), _pair)


def between_turning_rows(incident: np.ndarray, exit: np.ndarray, value: np.ndarray) -> Between | None:
    """The same of a grid of theta_i, phi_i, theta_r and phi_r, or phi_r - phi_i in its place, both azimuths all the way
    round."""
    for relative in (False, True):
        found = _between_azimuths(incident, exit, value, relative=relative)
        if found is not None:
            return found
    return None


def _between_azimuths(
    incident: np.ndarray, exit: np.ndarray, value: np.ndarray, *, relative: bool
) -> Between | None:
    places = np.degrees(_four(incident, exit))
    upright = np.sin(np.radians(places[::2])) < UPRIGHT  # where an azimuth means nothing
    if relative:
        places[3] -= places[1]
    places[[1, 3]] = np.mod(np.round(places[[1, 3]], DIGITS), 360.0)
    places = np.round(places, DIGITS)
    oblique = ~upright.any(axis=0) if relative else np.ones(len(value), bool)
    axes = [np.unique(places[k] if k in (0, 2) else places[k, oblique]) for k in range(4)]
    if any(len(axis) < 2 for axis in axes) or not (_polar(axes[::2]) and all(map(_round, axes[1::2]))):
        return None
    if np.prod([len(axis) for axis in axes]) > _MOST * len(value):
        return None
    if relative:
        grid = _means(axes, places[:, oblique], value[oblique])
        grid = _with_normals(grid, axes, places, value, upright)
    else:
        grid = _means(axes, places, value)
        for axis in (0, 2):  # at the normal its own azimuth means nothing
            shape = [1, 1, 1, 1]
            shape[axis] = len(axes[axis])
            grid = _filled(grid, (axes[axis] == 0.0).reshape(shape), axis=axis + 1)
    for axis in (1, 3):  # the first azimuth once more, a turn on
        axes[axis] = np.append(axes[axis], axes[axis][0] + 360.0)
        grid = np.concatenate([grid, grid.take([0], axis)], axis)

    def asked(toward: np.ndarray, away: np.ndarray) -> np.ndarray:
        angles = _four(toward, away)
        if relative:
            angles[3] -= angles[1]
        for k in (1, 3):
            first = np.radians(axes[k][0])
            angles[k] = first + np.mod(angles[k] - first, 2.0 * np.pi)
        return angles

    return _linear(axes, grid, asked)


def _with_normals(
    grid: np.ndarray, axes: list[np.ndarray], places: np.ndarray, value: np.ndarray, upright: np.ndarray
) -> np.ndarray:
    """A grid of differences of azimuths with what the rows say of either normal, which has none.

    Light along it is known by exit azimuth, linear between those of its rows; light sent out along it by incident one.
    """
    grid = grid.copy()
    both = upright.all(axis=0)
    if axes[2][0] == 0.0:
        rows, grid[:, :, 0] = upright[1] & ~both, np.nan
        if all(np.isin(places[k, rows], axes[k]).all() for k in (0, 1)):
            grid[:, :, 0] = _means(axes[:2], places[:2, rows], value[rows])[:, :, None]
    if axes[0][0] == 0.0:
        rows = upright[0] & ~both
        turns = np.unique(places[3, rows])  # the incident azimuth is 0 there
        if not rows.any() or not _round(turns):
            return np.full_like(grid, np.nan)
        known = _means([axes[2], turns], places[2:, rows], value[rows])
        at = np.mod(axes[1][:, None] + axes[3], 360.0)
        for c in range(value.shape[1]):
            for r in range(len(axes[2])):
                grid[0, :, r, :, c] = np.interp(at, turns, known[r, :, c], period=360.0)
        if axes[2][0] == 0.0:
            grid[0, :, 0] = value[both].mean(axis=0) if both.any() else np.nan
    return grid


def _means(axes: list[np.ndarray], places: np.ndarray, value: np.ndarray) -> np.ndarray:
    """(..., c) mean value at each node of a grid; NaN where there is none."""
    cells = tuple(np.searchsorted(axis, one) for axis, one in zip(axes, places, strict=True))
    sums, counts = np.zeros((*map(len, axes), value.shape[1])), np.zeros((*map(len, axes), 1))
    np.add.at(sums, cells, value)
    np.add.at(counts, cells, 1.0)
    return np.divide(sums, counts, out=np.full_like(sums, np.nan), where=counts > 0.0)


def _filled(grid: np.ndarray, where: np.ndarray, *, axis: int) -> np.ndarray:
    """The grid with what is missing taken from any node along the axis, ``where`` that is the same direction."""
    known = np.isfinite(grid)
    any_of = np.where(known, grid, -np.inf).max(axis=axis, keepdims=True)
    return np.where(where[..., None] & ~known & np.isfinite(any_of), any_of, grid)


def _linear(axes: list[np.ndarray], grid: np.ndarray, angles: Between) -> Between | None:
    """f at unit vectors by their ``angles``, radians; None where a node has no value."""
    if not np.isfinite(grid).all():
        return None
    interpolated = RegularGridInterpolator(axes, grid)

    def evaluate(toward: np.ndarray, away: np.ndarray) -> np.ndarray:
        asked = np.degrees(angles(toward, away))
        kept = [np.clip(one, axis[0], axis[-1]) for one, axis in zip(asked, axes, strict=True)]
        return interpolated(np.stack(kept, axis=-1))

    return evaluate


def _pair(incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
    """(3, n) theta_i, theta_r, |dphi|."""
    theta_i, theta_r, dphi = pair_angles(incident, exit)
    return np.stack([theta_i, theta_r, np.abs(dphi)])


def _four(incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
    """(4, n) theta_i, phi_i, theta_r, phi_r; the azimuth of the normal is 0."""
    angles = np.stack([*spherical_angles(incident), *spherical_angles(exit)])
    for k in (0, 2):
        angles[k + 1, np.sin(angles[k]) < UPRIGHT] = 0.0
    return angles


def _whole(axes: list[np.ndarray]) -> bool:
    """Whether nodes go from the normal to grazing, and from the light's own side to the other, in small steps."""
    sides = axes[2][0] <= MISSED and axes[2][-1] >= 180.0 - MISSED
    return bool(_polar(axes[:2]) and np.diff(axes[2]).max() <= TURN and sides)


def _polar(axes: list[np.ndarray]) -> bool:
    small = all(np.diff(axis).max() <= STEP for axis in axes)
    return small and all(axis[0] <= MISSED and axis[-1] >= 90.0 - MISSED for axis in axes)


def _round(axis: np.ndarray) -> bool:
    return bool(np.diff(np.append(axis, axis[0] + 360.0)).max() <= TURN)
