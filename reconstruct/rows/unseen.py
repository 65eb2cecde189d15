"""Beyond measured rows: there a surface goes on as it was last seen, and is nowhere negative.

Modes that follow rows up to some polar angle swing beyond it, the more the less a prior holds them, and take away from
lobes what these have too much where they were seen. So two things are asked of them that rows never contradict: that
they stay near what they are at the steepest rows (a weak penalty on their change from there to the horizon), and that
f is not below 0 where no row is near.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.represent.bounds import MOST_MOVED, TRIFLE, nearest_change, root_of
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.table.neighbours import places
from photogonio.reconstruct.uncertainty.beyond import halton

SAYS = 1e-4  # of what all rows say: the weight of modes' staying as they are beyond them
HIGHEST = np.radians(89.0)  # polar angle; beyond, cosines are 0 for rounding
STEPS = 4  # polar angles beyond the steepest row, at which that is asked
POLAR_STEP, AZIMUTH_STEP = np.radians(8.0), np.radians(15.0)  # of the other direction, and between the two
NEAR = np.radians(4.0)  # of a row or its reciprocal twin: seen
POLAR = np.radians([2.5, 15, 30, 45, 57, 65, 70, 74, 77, 79, 81, 83, 84.5, 86, 87, 88, 89])
AROUND = np.radians(
    [*range(0, 150, 15), 150, 155, 160, 165, 170, 172.5, 175, 177.5, 180]
)  # finer where a gloss is
AXES = np.pi * np.arange(4) / 4  # azimuths of the incident direction, of surfaces that turn
LOW = 0.5  # of the mean f: what is higher is not held at first
ELSEWHERE = 4096  # pairs at which f is looked at once more


def steepest(cells: Cells) -> float:
    """The largest polar angle of any row, radians."""
    return float(max(cells.theta_i.max(), cells.theta_r.max()))


@lru_cache(maxsize=16)
def steadiness(order: int, top: float) -> np.ndarray:
    """(m, m) mean square of how isotropic modes up to ``order`` differ beyond the polar angle ``top``, radians, from
    where either angle is ``top`` at most, as a quadratic form of their coefficients."""
    basis = Basis("isotropic", order)
    if top >= HIGHEST:
        return np.zeros((len(basis.modes), len(basis.modes)))
    beyond = np.linspace(top, HIGHEST, STEPS + 1)[1:]
    all_angles = np.concatenate([np.arange(0.5 * POLAR_STEP, top, POLAR_STEP), beyond])
    angles = np.meshgrid(beyond, all_angles, np.arange(0.0, np.pi + 1e-9, AZIMUTH_STEP), indexing="ij")
    one, other, dphi = (angle.ravel() for angle in angles)
    there = basis.design(Cells.of_angles(one, other, dphi))
    change = there - basis.design(Cells.of_angles(np.minimum(one, top), np.minimum(other, top), dphi))
    return change.T @ change / len(change)


def unseen_pairs(cells: Cells, turning: bool) -> Cells:
    """Pairs of directions up to :data:`HIGHEST` that no row of ``cells`` is near, one of each two reciprocal twins; at
    several azimuths of a surface that turns."""
    theta_i, theta_r, dphi = (a.ravel() for a in np.meshgrid(POLAR, POLAR, AROUND, indexing="ij"))
    half = theta_i >= theta_r
    theta_i, theta_r, dphi = theta_i[half], theta_r[half], dphi[half]
    rows = [
        places(cells.theta_i, cells.theta_r, cells.dphi),
        places(cells.theta_r, cells.theta_i, cells.dphi),
    ]
    apart = cKDTree(np.concatenate(rows)).query(places(theta_i, theta_r, dphi))[0]
    i, r, d = (angle[apart > NEAR] for angle in (theta_i, theta_r, dphi))
    axes = AXES if turning else AXES[:1]
    phi = np.repeat(axes, len(i))
    return Cells.of_directions(np.tile(i, len(axes)), phi, np.tile(r, len(axes)), phi + np.tile(d, len(axes)))


def raised_unseen(brdf: Brdf, cells: Cells, covariance: np.ndarray) -> tuple[Brdf, dict[str, float] | None]:
    """``brdf`` without negative values where no row of ``cells`` is near, and what it took; None if nothing.

    Its modes are moved as little as can be in the metric of their ``covariance`` (c, m, m), so that what rows
    determine stays. As it is where modes cannot do it, would have to move further than rows let them, or would be
    further below 0 elsewhere, as few modes that turn are between the azimuths that are held.
    """
    pairs = unseen_pairs(cells, brdf.turning)
    value = brdf.evaluate(pairs.theta_i, pairs.phi_i, pairs.theta_r, pairs.phi_r)
    mean = np.abs(cells.value).mean(0)
    below = np.flatnonzero((value < -TRIFLE * mean).any(0))
    if not len(below):
        return brdf, None
    basis, size = Basis(brdf.symmetry, brdf.order), len(covariance[0])
    low = (value < LOW * mean).any(1)  # others are asked for only where the change would break them
    rows = basis.design(pairs.take(low))[:, :size]
    changes = _changes(rows, value[low], covariance, below)
    if changes is not None and not low.all():
        broken = (value + basis.evaluate(pairs, _padded(changes[0], len(brdf.modes))) < -TRIFLE * mean).any(1)
        if (broken & ~low).any():
            rows = basis.design(pairs)[:, :size]
            changes = _changes(rows, value, covariance, below)
    if changes is None:
        return brdf, None
    change, bounds, distance = changes
    if distance > MOST_MOVED:
        return brdf, None
    moved = replace(brdf, coefficients=brdf.coefficients + _padded(change, len(brdf.modes)))
    if (_least(moved) < np.minimum(_least(brdf), -TRIFLE * mean)).any():
        return brdf, None
    return moved, {"least f": float(value.min()), "bounds": float(bounds), "standard errors moved": distance}


def _least(brdf: Brdf) -> np.ndarray:
    """(c,) the least f of pairs that are evenly spread over angles, azimuths of the sample among them."""
    unit = np.stack([halton(ELSEWHERE, base) for base in (2, 3, 5, 7)], axis=1)
    theta_i, theta_r = HIGHEST * unit[:, :2].T
    phi_i, phi_r = 2.0 * np.pi * unit[:, 2:].T
    return brdf.evaluate(theta_i, phi_i, theta_r, phi_r).min(0)


def _changes(
    rows: np.ndarray, value: np.ndarray, covariance: np.ndarray, below: np.ndarray
) -> tuple[np.ndarray, int, float] | None:
    """The least changes (k, c) of the first k modes, that have ``covariance`` (c, k, k), by which no ``value`` (n, c)
    is below 0, of the channels ``below``; how many bounds bind, and how far they are in standard errors a bound."""
    change, bounds, squared = np.zeros((rows.shape[1], value.shape[1])), 0, 0.0
    for c in below:
        found = nearest_change(rows, value[:, c], root_of(covariance[c]))
        if found is None:
            return None
        change[:, c], active, size = found
        bounds, squared = bounds + active, squared + size
    return change, bounds, float(np.sqrt(squared / max(bounds, 1)))


def _padded(change: np.ndarray, modes: int) -> np.ndarray:
    return np.pad(change, ((0, modes - len(change)), (0, 0)))
