"""Where a BRDF that need not be isotropic is least: a grid of pairs of directions, and valleys followed beside it."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from photogonio.capture.jit import jit
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.lobes.coat import coat_albedo_of
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.modes.basis import cosines
from photogonio.reconstruct.modes.transform import pair_matrix
from photogonio.reconstruct.modes.zernike import (
    azimuth_sequence,
    elevation_sequence,
    radial_index,
    zernike_orders,
    zernike_sequence,
)
from photogonio.reconstruct.table.cells import Cells

LOWEST = 100_000  # places among which valleys are sought
HALVINGS = 6  # of the grid's step, in following a valley: to a thirtieth of it
SLANT = 64.0  # of a valley's curvature, that may hide between the grid's lines


@dataclass(frozen=True, slots=True)
class DirectionGrid:
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

    @property
    def half_turn(self) -> np.ndarray:
        """(d,) directions half a turn of azimuth on."""
        row, turn = np.divmod(np.arange(len(self.theta)), self.azimuths)
        return row * self.azimuths + (turn + self.azimuths // 2) % self.azimuths

    def neighbours(self, place: np.ndarray) -> np.ndarray:
        """(4, n) directions on either side, in both ways, of those at ``place`` (n,); itself beyond the last."""
        row, turn = np.divmod(place, self.azimuths)
        sides = np.array([-1, 1])[:, None]
        up_down = np.minimum(row + sides, self.polar - 1) * self.azimuths + turn
        around = row * self.azimuths + (turn + sides) % self.azimuths
        of_pole = self.azimuths + np.array([0, 2, 1, 3])[:, None] * (self.azimuths // 4)
        return np.where(row > 0, np.concatenate([up_down, around]), of_pole)


@lru_cache(maxsize=8)
def directions(highest: float, polar: int, azimuths: int) -> DirectionGrid:
    """Equally spaced, polar angles from 0 to ``highest``; ``azimuths`` is a multiple of 4."""
    theta = np.repeat(np.linspace(0.0, highest, polar), azimuths)
    return DirectionGrid(theta, np.tile(2.0 * np.pi * np.arange(azimuths) / azimuths, polar), polar, azimuths)


def pairs(grid: DirectionGrid, i: np.ndarray, r: np.ndarray) -> Cells:
    """The pairs of directions ``i`` and ``r`` (n,) of a grid."""
    return Cells.of_directions(grid.theta[i], grid.phi[i], grid.theta[r], grid.phi[r])


def values(brdf: Brdf, grid: DirectionGrid) -> np.ndarray:
    """f (c, d, d), 1/sr, at all pairs of a grid, as :meth:`Brdf.evaluate` gives it for the quantity ``brdf``."""
    result = expansion(brdf.symmetry, brdf.modes, brdf.coefficients, grid)
    theta, azimuth = grid.theta[:: grid.azimuths], grid.phi[: grid.azimuths]
    row, turn = np.divmod(np.arange(len(grid.theta)), grid.azimuths)
    between = (turn[None] - turn[:, None]) % grid.azimuths
    for lobe in brdf.lobes:
        if lobe.turning:
            phi = grid.phi[:, None]
            result += np.moveaxis(lobe.evaluate(grid.theta[:, None], grid.theta, grid.phi - phi, phi), -1, 0)
            continue
        table = np.moveaxis(lobe.evaluate(theta[:, None, None], theta[None, :, None], azimuth), -1, 0)
        result += table[:, row[:, None], row[None], between]
    return result


def dark_values(brdf: Brdf, grid: DirectionGrid) -> np.ndarray:
    """:func:`values` where the modes, and the grounds of coats that turn, are below 0 together; elsewhere f is no less
    than this, as lobes only add light.

    Pairs that are the same but exchanged or, of isotropic modes, half a turn on, are looked at once.
    """
    value, lobes = expansion(brdf.symmetry, brdf.modes, brdf.coefficients, grid), brdf.lobes
    if not all((lobe.terms().factors >= 0.0).all() for lobe in lobes):
        return values(brdf, grid)
    bright = value + _grounds(lobes, grid)
    i, r = np.nonzero((bright < 0.0).any(0))
    same = [(i, r)] if brdf.symmetry == "general" else [(i, r), (r, i)]
    if brdf.symmetry == "isotropic":
        same += [(grid.half_turn[a], grid.half_turn[b]) for a, b in same]
    code = i * len(grid.theta) + r
    first = np.all([code <= a * len(grid.theta) + b for a, b in same], axis=0)
    at_i, at_r = i[first], r[first]
    theta_i, phi_i, theta_r, phi_r = grid.theta[at_i], grid.phi[at_i], grid.theta[at_r], grid.phi[at_r]
    here = value[:, at_i, at_r]
    for lobe in lobes:
        here += lobe.evaluate(theta_i, theta_r, phi_r - phi_i, phi_i).T
    for a, b in same:
        bright[:, a[first], b[first]] = here
    return bright


def _grounds(lobes: Sequence[Lobe], grid: DirectionGrid) -> np.ndarray | float:
    """(c, d, d) what the grounds of coats that turn add to f, 1/sr, at all pairs of a grid: products of what enters
    along either direction, which single pairs would be asked for again and again."""
    total: np.ndarray | float = 0.0
    for lobe in lobes:
        if lobe.ground is not None and lobe.turning:
            entered = 1.0 - coat_albedo_of(lobe.interface).at(np.cos(grid.theta), grid.phi)
            total = total + lobe.terms().factors[1][:, None, None] * (entered[:, None] * entered)
    return total


def expansion(symmetry: str, modes: np.ndarray, coefficients: np.ndarray, grid: DirectionGrid) -> np.ndarray:
    """Sums (c, d, d) of modes (m, 4), reciprocal or general, at all pairs of a grid."""
    order = int(modes[:, [0, 2]].max(initial=0))
    sequence = np.ascontiguousarray(zernike_sequence(order, grid.theta, grid.phi).T)
    return sequence @ pair_matrix(symmetry, modes, coefficients) @ sequence.T


def lowest_pairs(value: np.ndarray, grid: DirectionGrid, limit: float, symmetric: bool) -> np.ndarray:
    """(n, 4) theta_i, phi_i, theta_r, phi_r of the grid's valleys of f (d, d) that may lead below ``limit``.

    They are sought among the lowest :data:`LOWEST` pairs; pairs exchanged are one if ``symmetric``.
    """
    sides = grid.neighbours(np.arange(len(value)))
    place, bottom = _valleys_of_pairs(value, sides, grid.distinct, symmetric, limit)
    at = value.ravel()[place]
    levels = np.sort(at)
    low = bisect_left(levels, LOWEST, key=lambda most: _count(value, grid.distinct, symmetric, most))
    kept = at <= levels[low - 1] if low else np.zeros(len(at), bool)
    place, bottom, at = place[kept], bottom[kept], at[kept]
    i, r = np.divmod(place[np.lexsort((bottom, at >= limit))], len(value))
    return np.column_stack([grid.theta[i], grid.phi[i], grid.theta[r], grid.phi[r]])


@jit
def _valleys_of_pairs(value, sides, distinct, symmetric, limit):
    """Places i d + r (n,) of pairs that :func:`_valleys` would choose, and how low they may lead, of ``value`` (d, d)
    with the neighbours ``sides`` (4, d) of either direction; in ascending order."""
    place, bottom = [0 for _ in range(0)], [0.0 for _ in range(0)]
    beside = np.empty(8)
    for i in range(len(value)):
        for r in range(i + 1 if symmetric else len(value)):
            here = value[i, r]
            if not (distinct[i] and distinct[r]):
                continue
            for k in range(8):  # those in the same row of memory first
                beside[k] = value[i, sides[k, r]] if k < 4 else value[sides[k - 4, i], r]
                if beside[k] < here:
                    break
            if beside[k] < here:
                continue
            drop = 0.0
            for k in (4, 6, 0, 2):
                bend = beside[k] - 2.0 * here + beside[k + 1]
                lower = (beside[k + 1] - beside[k]) ** 2 / (4.0 * bend) if bend > 0.0 else 0.0
                drop += lower + bend / SLANT
            if here - drop < limit:
                place.append(i * len(value) + r)
                bottom.append(here - drop)
    return np.array(place), np.array(bottom)


@jit
def _count(value, distinct, symmetric, most):
    """How many of the same pairs are lower than ``most``."""
    count = 0
    for i in range(len(value)):
        for r in range(i + 1 if symmetric else len(value)):
            count += distinct[i] and distinct[r] and value[i, r] < most
    return count


def lowest_directions(value: np.ndarray, grid: DirectionGrid, limit: float) -> np.ndarray:
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
    value: Callable[[np.ndarray, np.ndarray], np.ndarray],
    start: np.ndarray,
    moves: np.ndarray,
    highest: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Bottoms (n, d) of the valleys at ``start`` (n, d) and the values (n,) there, by a pattern search.

    ``value`` takes places (n, d), polar angles at even places, and moves (q, d), to what is at each place moved in each
    way (q, n), polar angles being kept between 0 and ``highest``. ``moves`` (q, d) are halved again and again.
    """
    place, every = start, np.arange(len(start))
    moves = np.concatenate([np.zeros((1, moves.shape[1])), moves, -moves])
    lowest = value(place, moves[:1])[0]
    for halving in range(HALVINGS):
        steps = moves * 0.5 ** (halving + 1)
        found = value(place, steps)
        best = found.argmin(0)
        place, lowest = moved_by(place, steps, highest)[best, every], found[best, every]
    return place, lowest


def moved_by(place: np.ndarray, moves: np.ndarray, highest: float) -> np.ndarray:
    """(q, n, d) places (n, d) moved in each of the ways ``moves`` (q, d)."""
    tried = place + moves[:, None]
    tried[..., ::2] = np.clip(tried[..., ::2], 0.0, highest)
    return tried


@dataclass(frozen=True, slots=True)
class Surface:
    """f of a BRDF of one channel beside pairs of directions, for many moves that share most of their directions."""

    brdf: Brdf
    order: int
    matrix: np.ndarray  # (j, j) of its modes
    highest: float  # radians, polar angle

    @classmethod
    def of(cls, brdf: Brdf, highest: float) -> Surface:
        order = int(brdf.modes[:, [0, 2]].max(initial=0))
        return cls(brdf, order, pair_matrix(brdf.symmetry, brdf.modes, brdf.coefficients)[0], highest)

    def __call__(self, place: np.ndarray, moves: np.ndarray) -> np.ndarray:
        """(q, n) f, 1/sr, at pairs ``place`` (n, 4) moved in each way (q, 4): what :meth:`Brdf.evaluate` gives."""
        steps_i, of_i = np.unique(moves[:, :2], axis=0, return_inverse=True)
        steps_r, of_r = np.unique(moves[:, 2:], axis=0, return_inverse=True)
        incident = self._modes(place[:, :2], steps_i)
        exit = self._modes(place[:, 2:], steps_r)
        passed = (self.matrix @ exit.reshape(len(self.matrix), -1)).reshape(exit.shape)
        value = np.stack(
            [
                np.einsum("jn,jn->n", incident[:, i], passed[:, r])
                for i, r in zip(of_i.ravel(), of_r.ravel(), strict=True)
            ]
        )
        theta_i, phi_i, theta_r, phi_r = np.moveaxis(moved_by(place, moves, self.highest), -1, 0)
        value /= cosines(self.brdf.quantity, theta_i, theta_r)
        for lobe in self.brdf.lobes:
            value += lobe.evaluate(theta_i, theta_r, phi_r - phi_i, phi_i)[..., 0]
        return value

    def _modes(self, place: np.ndarray, steps: np.ndarray) -> np.ndarray:
        """(j, q, n) Z_j at directions (n, 2) moved in each way (q, 2): elevation and azimuth of each step but once."""
        n, l = zernike_orders(np.arange(len(self.matrix)))
        up, of_up = np.unique(steps[:, 0], return_inverse=True)
        turn, of_turn = np.unique(steps[:, 1], return_inverse=True)
        elevation = elevation_sequence(self.order, np.clip(place[:, 0] + up[:, None], 0.0, self.highest))
        azimuth = azimuth_sequence(self.order, place[:, 1] + turn[:, None])
        result = np.empty((len(n), len(steps), len(place)))
        _products(elevation, radial_index(n, l), of_up, azimuth, self.order + l, of_turn, result)
        return result


@jit
def _products(elevation, n, up, azimuth, l, turn, result):
    """``result`` (j, q, p): rows ``n`` (j,) of ``elevation`` (t, a, p), moved as ``up`` (q,) says, times those ``l`` of
    ``azimuth`` (s, b, p), moved as ``turn``."""
    for j in range(len(n)):
        for q in range(len(up)):
            for p in range(result.shape[2]):
                result[j, q, p] = elevation[n[j], up[q], p] * azimuth[l[j], turn[q], p]
