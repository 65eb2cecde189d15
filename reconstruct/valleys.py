"""Where a BRDF that need not be isotropic is least: a grid of pairs of directions, and valleys followed beside it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from reconstruct.brdf import Brdf
from reconstruct.cells import Cells
from reconstruct.transform import pair_matrix
from reconstruct.zernike import zernike_sequence

LOWEST = 100_000  # places among which valleys are sought
HALVINGS = 6  # of the grid's step, in following a valley: to a thirtieth of it
SLANT = 64.0  # of a valley's curvature, that may hide between the grid's lines


@dataclass(frozen=True, slots=True)
class Directions:
    """A grid over the hemisphere; d = polar angles times azimuths, the azimuth running faster."""

    theta: np.ndarray  # (d,) radians
    phi: np.ndarray  # (d,)
    polar: int
    azimuths: int

    @property
    def steps(self) -> np.ndarray:
        """(2,) between neighbours, radians."""
        return np.array([self.theta[-1] / (self.polar - 1), 2.0 * np.pi / self.azimuths])

    @property
    def distinct(self) -> np.ndarray:
        """(d,) bool: one only of the directions that are the pole."""
        return (self.theta > 0.0) | (self.phi == 0.0)

    def neighbours(self, place: np.ndarray) -> np.ndarray:
        """(4, n) directions on either side, in both ways, of those at ``place`` (n,); itself beyond the last."""
        row, turn = np.divmod(place, self.azimuths)
        sides = np.array([-1, 1])[:, None]
        up_down = np.minimum(row + sides, self.polar - 1) * self.azimuths + turn
        around = row * self.azimuths + (turn + sides) % self.azimuths
        of_pole = self.azimuths + np.array([0, 2, 1, 3])[:, None] * (self.azimuths // 4)
        return np.where(row > 0, np.concatenate([up_down, around]), of_pole)


@lru_cache(maxsize=8)
def directions(highest: float, polar: int, azimuths: int) -> Directions:
    """Equally spaced, polar angles from 0 to ``highest``; ``azimuths`` is a multiple of 4."""
    theta = np.repeat(np.linspace(0.0, highest, polar), azimuths)
    return Directions(theta, np.tile(2.0 * np.pi * np.arange(azimuths) / azimuths, polar), polar, azimuths)


def pairs(grid: Directions, i: np.ndarray, r: np.ndarray) -> Cells:
    """The pairs of directions ``i`` and ``r`` (n,) of a grid."""
    return Cells.of_directions(grid.theta[i], grid.phi[i], grid.theta[r], grid.phi[r])


def values(brdf: Brdf, grid: Directions) -> np.ndarray:
    """f (c, d, d), 1/sr, at all pairs of a grid, as :meth:`Brdf.evaluate` gives it for the quantity ``brdf``."""
    result = expansion(brdf.symmetry, brdf.modes, brdf.coefficients, grid)
    theta, azimuth = grid.theta[:: grid.azimuths], grid.phi[: grid.azimuths]
    row, turn = np.divmod(np.arange(len(grid.theta)), grid.azimuths)
    between = (turn[None] - turn[:, None]) % grid.azimuths
    for lobe in brdf.lobes:  # none turns with the sample
        table = np.moveaxis(lobe.evaluate(theta[:, None, None], theta[None, :, None], azimuth), -1, 0)
        result += table[:, row[:, None], row[None], between]
    return result


def expansion(symmetry: str, modes: np.ndarray, coefficients: np.ndarray, grid: Directions) -> np.ndarray:
    """Sums (c, d, d) of modes (m, 4), reciprocal or general, at all pairs of a grid."""
    order = int(modes[:, [0, 2]].max(initial=0))
    sequence = np.ascontiguousarray(zernike_sequence(order, grid.theta, grid.phi).T)
    return sequence @ pair_matrix(symmetry, modes, coefficients) @ sequence.T


def lowest_pairs(value: np.ndarray, grid: Directions, limit: float, symmetric: bool) -> np.ndarray:
    """(n, 4) theta_i, phi_i, theta_r, phi_r of the grid's valleys of f (d, d) that may lead below ``limit``."""
    here = grid.distinct[:, None] & grid.distinct
    place = _lowest(value, np.tril(here) if symmetric else here)
    i, r = np.divmod(place, len(value))
    beside = np.concatenate([value[grid.neighbours(i), r], value[i, grid.neighbours(r)]])
    chosen = _valleys(value[i, r], beside, limit)
    i, r = i[chosen], r[chosen]
    return np.column_stack([grid.theta[i], grid.phi[i], grid.theta[r], grid.phi[r]])


def lowest_directions(value: np.ndarray, grid: Directions, limit: float) -> np.ndarray:
    """(n, 2) theta and phi of the grid's valleys of ``value`` (d,) that may lead below ``limit``."""
    place = _lowest(value, grid.distinct)
    place = place[_valleys(value[place], value[grid.neighbours(place)], limit)]
    return np.column_stack([grid.theta[place], grid.phi[place]])


def _lowest(value: np.ndarray, here: np.ndarray) -> np.ndarray:
    """Places of the lowest values, of those ``here``, in ascending order of place."""
    place = np.flatnonzero(here)
    if len(place) <= LOWEST:
        return place
    return np.sort(place[np.argpartition(value.ravel()[place], LOWEST)[:LOWEST]])


def _valleys(value: np.ndarray, beside: np.ndarray, limit: float) -> np.ndarray:
    """Which of ``value`` (n,) are no higher than ``beside`` (q, n), two by two on either side, and may lie beside a
    place below ``limit``; those that lie below it themselves first.

    Parabolas through a valley and its neighbours say how much lower it is beside the grid; twice that, and a part of
    the curvature, is allowed since valleys run aslant.
    """
    valley = np.flatnonzero((value <= beside).all(0))
    value, before, after = value[valley], beside[::2, valley], beside[1::2, valley]
    bend = before - 2.0 * value + after
    lower = np.divide((after - before) ** 2, 4.0 * bend, out=np.zeros_like(bend), where=bend > 0.0)
    bottom = value - (lower + bend / SLANT).sum(0)
    order = np.lexsort((bottom, value >= limit))
    return valley[order[bottom[order] < limit]]


def followed(
    value: Callable[[np.ndarray], np.ndarray], start: np.ndarray, moves: np.ndarray, highest: float
) -> tuple[np.ndarray, np.ndarray]:
    """Bottoms (n, d) of the valleys at ``start`` (n, d) and the values (n,) there, by a pattern search.

    ``value`` takes points (k, d), polar angles at even places, to (k,). ``moves`` (q, d) are halved again and again.
    """
    place, every = start, np.arange(len(start))
    moves = np.concatenate([np.zeros((1, moves.shape[1])), moves, -moves])
    lowest = value(place)
    for halving in range(HALVINGS):
        tried = place + moves[:, None] * 0.5 ** (halving + 1)
        tried[..., ::2] = np.clip(tried[..., ::2], 0.0, highest)
        found = value(tried.reshape(-1, tried.shape[-1])).reshape(len(moves), -1)
        best = found.argmin(0)
        place, lowest = tried[best, every], found[best, every]
    return place, lowest
