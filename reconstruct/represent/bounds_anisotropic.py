"""The same bounds for files that are not isotropic: pairs of directions at every azimuth of both.

Pairs are too many to be held one by one, so that they are found as they are broken, as in Remez's exchange (Hettich
and Kortanek 1993): valleys of f on a grid, followed to their bottoms beside it, become constraints; the nearest
coefficients are found anew; and again, until the deepest valley is no deeper than :data:`FOLLOWED`. The albedo is
bounded for light from every direction, which is what conservation of energy says of a general file too.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.modes.integrals import POINTS, directional_albedo, exit_integral
from photogonio.reconstruct.modes.parallel import cores
from photogonio.reconstruct.modes.zernike import zernike_count, zernike_sequence
from photogonio.reconstruct.represent.bounds import (
    HIGHEST,
    TRIFLE,
    Physical,
    held_pairs,
    least_distance,
    root_of,
)
from photogonio.reconstruct.represent.minima import (
    DirectionGrid,
    Surface,
    dark_values,
    directions,
    expansion,
    followed,
    lowest_directions,
    lowest_pairs,
    moved_by,
    pairs,
    values,
)
from photogonio.reconstruct.table.cells import Cells

TOLERANCE = (
    TRIFLE  # of the mean f, and of an albedo of 1: what is held may be off by as much between the constraints
)
POLAR, ALBEDO_POLAR = 18, 35  # angles of the grids: 5 and 2.5 degrees apart
MORE_POLAR = (0, 3, 5)  # of one grid after another
A_WAVE = 6  # azimuths to the finest mode's wave
ALBEDO_WAVES = 5  # in azimuth, of a lobe of two roughnesses
FEW = (9, 2, 5)  # polar angles, waves and points of a panel, of albedos that are
FAR = 0.8  # or less: far enough below 1 to be believed
AZIMUTHS = (36, 96)  # at least and at most
FOLLOWED = TOLERANCE / 6  # valleys less deep are left; the rest is for valleys that the grid does not show
VALLEYS = 70_000  # followed in a round, times the modes of a hemisphere: some thousands at order 4, 200 at 24
SAME = np.radians(0.5)  # nearer valleys are one
DEEPEST = 200  # of them that become constraints
EXCHANGES = 60
TOLD = 1000  # pairs at which a violation is weighed against its error
GOLDEN = np.pi * (3.0 - np.sqrt(5.0))  # radians: turns by it spread evenly
BINDING = 1e-9  # of the largest value: rounding
KEPT = 0.002  # of the mean f: constraints with no more room stay for the next round
# theta_i, phi_i, theta_r and phi_r, in steps of the grid: each alone, both azimuths, both polar angles
MOVES = np.array(
    [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [0, 1, 0, 1], [1, 0, 1, 0], [1, 0, -1, 0]]
)


def violated_turning(brdf: Brdf, error: Callable[[Cells], np.ndarray]) -> bool:
    """As :func:`.bounds.violated` at all azimuths; ``error`` takes cells to standard errors (n, c)."""
    grid = _grid(brdf.order)
    value = dark_values(brdf, grid)
    if (value < 0.0).any():
        trifle = TRIFLE * _size_by_few(brdf, grid)
        i, r = _told(value, np.any(value < -trifle[:, None, None], axis=0))
        if len(i) and (value[:, i, r].T < -(error(pairs(grid, i, r)) + trifle)).any():
            return True
    if brdf.scale != "absolute":
        return False
    fine = _albedo_grid(brdf.order)
    if (_Albedo.of(brdf, *FEW).at(brdf, fine.theta, fine.phi) < FAR).all():
        return False
    albedo = _Albedo.of(brdf).at(brdf, fine.theta, fine.phi)
    return bool((albedo > 1.0).any()) and bool((albedo > 1.0 + _relative(brdf, error)).any())


def enforced_turning(brdf: Brdf, covariance: np.ndarray) -> Physical | None:
    """As :func:`.bounds.enforced`, at all azimuths: f >= -TOLERANCE of its mean and, on an absolute scale,
    albedos <= 1 + TOLERANCE.

    ``covariance`` (c, k, k) is of the first k modes, which alone move.
    """
    value, albedo = [values(brdf, grid) for grid in _grids(brdf.order)], _Albedo.of(brdf)
    coefficients = brdf.coefficients.copy()
    active, squared, least, largest = 0, 0.0, np.inf, -np.inf

    def nearest(c: int) -> _Found | None:
        own = _Channel.of(brdf, c, len(covariance[c]), [one[c] for one in value], albedo)
        return _nearest(own, root_of(covariance[c]))

    with ThreadPoolExecutor(cores()) as pool:  # channels know nothing of one another
        every = list(pool.map(nearest, range(len(covariance))))
    for c, found in enumerate(every):
        if found is None:
            return None
        coefficients[: len(covariance[c]), c] += found.change
        active, squared = active + found.active, squared + found.squared
        least, largest = min(least, found.plain.least), max(largest, found.plain.albedo)
    return Physical(coefficients, least, largest, active, float(np.sqrt(squared / max(active, 1))))


@dataclass(frozen=True, slots=True)
class _Broken:
    """Constraints that a change of the coefficients does not meet: rows @ change + room < 0."""

    rows: np.ndarray  # (n, k)
    room: np.ndarray  # (n,) 1/sr, or of an albedo
    least: float  # f, 1/sr
    albedo: float  # the largest


@dataclass(frozen=True, slots=True)
class _Found:
    change: np.ndarray  # (k,)
    active: int  # independent constraints that bind
    squared: float  # size of the change in its standard errors
    plain: _Broken  # without it


@dataclass(frozen=True, slots=True)
class _Albedo:
    """Directional albedo anywhere: the modes' in closed form, the lobes' by smooth waves in azimuth."""

    lobes: tuple[_LobeAlbedo, ...]

    @classmethod
    def of(
        cls, brdf: Brdf, polar: int = ALBEDO_POLAR, waves: int = ALBEDO_WAVES, points: int = POINTS
    ) -> _Albedo:
        return cls(tuple(_LobeAlbedo.of(lobe, polar, waves, points) for lobe in brdf.lobes))

    def only(self, c: int) -> _Albedo:
        """Of one channel."""
        return _Albedo(tuple(one.only(c) for one in self.lobes))

    def at(self, brdf: Brdf, theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
        """(n, c) of ``brdf``, whose lobes are those."""
        modes = directional_albedo(brdf.symmetry, brdf.modes, brdf.coefficients, brdf.quantity, theta, phi)
        for lobe in self.lobes:
            modes = modes + lobe.at(theta, phi)
        return modes


@dataclass(frozen=True, slots=True)
class _LobeAlbedo:
    """Directional albedo of a lobe, the same half a turn on and mirrored about its azimuth."""

    waves: CubicSpline  # of theta: (m, c) cos(2 k (phi - azimuth)), the first alone if it does not turn
    azimuth: float

    @classmethod
    def of(cls, lobe: Lobe, polar: int, waves: int, points: int) -> _LobeAlbedo:
        theta, count = np.linspace(0.0, HIGHEST, polar), waves if lobe.turning else 1
        turns = 0.5 * np.pi * (np.arange(count) + 0.5) / count
        if lobe.turning and lobe.fresnel == "schlick":  # of which many differ in azimuth alone
            axes = round(lobe.axes[0], 12), round(lobe.axes[1], 12)
            parts = _sent(axes, (lobe.distribution, lobe.masking), polar, waves, points)
            sent = parts @ lobe.terms().factors
        else:
            every = [lobe.directional_albedo(theta, lobe.azimuth + turn, points=points) for turn in turns]
            sent = np.stack(every, axis=1)
        cosines = np.cos(2.0 * np.outer(np.arange(count), turns))
        shares = np.where(np.arange(count) == 0, 1.0, 2.0)[:, None] / count * cosines
        return cls(CubicSpline(theta, np.einsum("mt,atc->amc", shares, sent)), lobe.azimuth)

    def only(self, c: int) -> _LobeAlbedo:
        return _LobeAlbedo(CubicSpline(self.waves.x, self.waves(self.waves.x)[:, :, [c]]), self.azimuth)

    def at(self, theta: np.ndarray, phi: np.ndarray) -> np.ndarray:
        """(n, c)."""
        waves = self.waves(theta)
        turns = 2.0 * (np.asarray(phi) - self.azimuth)[..., None] * np.arange(waves.shape[-2])
        return np.einsum("...m,...mc->...c", np.cos(turns), waves)


@lru_cache(maxsize=256)
def _sent(
    axes: tuple[float, float], kind: tuple[str, str], polar: int, waves: int, points: int
) -> np.ndarray:
    """(polar, waves, 2) what a lobe of weight 1 sends out, and the part of it that Schlick's term adds."""
    one = Lobe(axes, np.array([1.0, 0.0]), np.ones(2), distribution=kind[0], masking=kind[1])
    turns = 0.5 * np.pi * (np.arange(waves) + 0.5) / waves
    theta = np.linspace(0.0, HIGHEST, polar)
    return np.stack([one.directional_albedo(theta, turn, points=points) for turn in turns], axis=1)


@dataclass(frozen=True, slots=True)
class _Channel:
    """What bounds a channel's first k coefficients."""

    brdf: Brdf  # of this channel alone, as it was
    basis: Basis  # whose first k modes move
    modes: int  # k
    values: list[np.ndarray]  # (d, d) of f on each grid, 1/sr
    size: float  # mean f, 1/sr
    albedo: _Albedo
    outgoing: np.ndarray  # (j, k) coefficients on Z_j(i) of the modes' albedos

    @classmethod
    def of(cls, brdf: Brdf, c: int, modes: int, value: list[np.ndarray], albedo: _Albedo) -> _Channel:
        rows = brdf.modes[:modes]
        basis = Basis(brdf.symmetry, int(rows[:, [0, 2]].max(initial=0)))
        outgoing = exit_integral(brdf.symmetry, rows, np.eye(modes), 1)
        size = float(_sizes(value[0][None], _grid(brdf.order))[0])
        return cls(brdf.only([c]), basis, modes, value, size, albedo.only(c), outgoing)

    def broken(self, change: np.ndarray) -> _Broken:
        """What the coefficients with ``change`` (k,) break by more than the tolerance, at its worst places."""
        moved = self._with(change)
        rows, room, least = self._dark(moved, change)
        bright, short, albedo = self._bright(moved)
        if self.brdf.scale == "absolute":
            rows, room = np.vstack([rows, bright]), np.concatenate([room, short])
        return _Broken(rows, room, least, albedo)

    def _with(self, change: np.ndarray) -> Brdf:
        coefficients = self.brdf.coefficients.copy()
        coefficients[: self.modes, 0] += change
        return replace(self.brdf, coefficients=coefficients)

    def _dark(self, moved: Brdf, change: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        least = np.inf
        for grid, value in zip(_grids(self.brdf.order), self.values, strict=True):
            where, lowest = self._valleys(grid, value, moved, change)
            least = min(least, lowest)
            if len(where):  # the next grid is for what this one does not show
                break
        rows = self.basis.design(Cells.of_directions(*where.T))[:, : self.modes]
        return rows, self.brdf.evaluate(*where.T)[:, 0], least

    def _valleys(
        self, grid: DirectionGrid, value: np.ndarray, moved: Brdf, change: np.ndarray
    ) -> tuple[np.ndarray, float]:
        """The deepest valleys (n, 4) of f with ``change``, and the least f; ``value`` (d, d) is without it."""
        if change.any():
            plain, own = value, self.brdf.modes[: self.modes]
            value = expansion(self.brdf.symmetry, own, change[:, None], grid)[0]
            value += plain
        start = lowest_pairs(value, grid, -FOLLOWED * self.size, self.brdf.symmetry == "reciprocal")
        start = start[: VALLEYS // zernike_count(self.brdf.order)]
        moves = MOVES * np.tile(grid.steps, 2)
        where, lowest = followed(Surface.of(moved, HIGHEST), start, moves, HIGHEST)
        least = float(min(lowest.min(initial=np.inf), value.min()))
        return _deepest(where, lowest, -FOLLOWED * self.size), least

    def _bright(self, moved: Brdf) -> tuple[np.ndarray, np.ndarray, float]:
        fine = _albedo_grid(self.brdf.order)

        def left(at: np.ndarray) -> np.ndarray:
            return 1.0 - self.albedo.at(moved, *at.T)[:, 0]

        value = left(np.column_stack([fine.theta, fine.phi]))
        start = lowest_directions(value, fine, -FOLLOWED)

        def beside(place: np.ndarray, moves: np.ndarray) -> np.ndarray:
            tried = moved_by(place, moves, HIGHEST)
            return left(tried.reshape(-1, 2)).reshape(tried.shape[:2])

        where, lowest = followed(beside, start, np.diag(fine.steps), HIGHEST)
        where = _deepest(where, lowest, -FOLLOWED)
        rows = -zernike_sequence(self.basis.order, *where.T).T @ self.outgoing
        room = 1.0 - self.albedo.at(self.brdf, *where.T)[:, 0]
        return rows, room, 1.0 - float(min(lowest.min(initial=np.inf), value.min()))


def _nearest(channel: _Channel, root: np.ndarray) -> _Found | None:
    """The least change root @ y that breaks nothing; None if there is none."""
    new = plain = channel.broken(np.zeros(channel.modes))
    scaled, room, short = np.empty((0, root.shape[1])), np.empty(0), np.zeros(root.shape[1])
    slack = BINDING * max(channel.size, float(np.abs(channel.values[0]).max()))
    for _ in range(EXCHANGES):
        if not len(new.room):
            binding = scaled[scaled @ short + room < slack]
            active = int(np.linalg.matrix_rank(binding)) if len(binding) else 0
            return _Found(root @ short, active, float(short @ short), plain)
        # what does not bind now may be let go: the distance grows all the same, so that nothing comes round again
        kept = scaled @ short + room < KEPT * channel.size
        scaled, room = np.vstack([scaled[kept], new.rows @ root]), np.concatenate([room[kept], new.room])
        found = least_distance(scaled, -room)
        if found is None:
            return None
        short = found
        new = channel.broken(root @ short)
    return None


def _deepest(where: np.ndarray, lowest: np.ndarray, limit: float) -> np.ndarray:
    """Of places (n, d) those whose values (n,) are below the limit, the lowest, and of neighbours one."""
    below = np.argsort(lowest, kind="stable")
    below = below[lowest[below] < limit]
    _, first = np.unique(np.round(where[below] / SAME), axis=0, return_index=True)
    return where[below[np.sort(first)[:DEEPEST]]]


def _grid(order: int) -> DirectionGrid:
    return directions(HIGHEST, POLAR, _azimuths(order))


def _grids(order: int) -> list[DirectionGrid]:
    """The grid and others whose directions lie between its own: a narrow valley may show on one alone."""
    return [directions(HIGHEST, POLAR + more, _azimuths(order) + 4 * k) for k, more in enumerate(MORE_POLAR)]


def _albedo_grid(order: int) -> DirectionGrid:
    return directions(HIGHEST, ALBEDO_POLAR, _azimuths(order))


def _azimuths(order: int) -> int:
    return int(np.clip(4 * (A_WAVE * order // 4), *AZIMUTHS))


def _sizes(value: np.ndarray, grid: DirectionGrid) -> np.ndarray:
    """(c,) mean size of f (c, d, d), cosine weighted."""
    weight = np.sin(2.0 * grid.theta) / np.sin(2.0 * grid.theta).sum()
    return weight @ (np.abs(value) @ weight).T


def _size_by_few(brdf: Brdf, grid: DirectionGrid) -> np.ndarray:
    """(c,) the same of ``brdf``, with light from four azimuths alone."""
    i = np.flatnonzero(np.arange(len(grid.theta)) % (grid.azimuths // 4) == 0)
    angles = grid.theta[i, None], grid.phi[i, None], grid.theta, grid.phi
    weight = np.sin(2.0 * grid.theta)
    mean = np.einsum("i,irc,r->c", weight[i], np.abs(brdf.evaluate(*angles)), weight, optimize=True)
    return mean / (weight[i].sum() * weight.sum())


def _told(value: np.ndarray, broken: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places i and r at which a violation is weighed: of the ``broken`` (d, d) evenly many, and the lowest."""
    place = np.flatnonzero(broken)
    evenly = place[np.unique(np.linspace(0, max(len(place) - 1, 0), min(TOLD, len(place))).astype(int))]
    lowest = value.reshape(len(value), -1).argmin(1)
    i, r = np.unravel_index(np.union1d(evenly, lowest[broken.ravel()[lowest]]), broken.shape)
    return i, r


def _relative(brdf: Brdf, error: Callable[[Cells], np.ndarray]) -> np.ndarray:
    """(c,) mean relative error of f, cosine weighted, at pairs of all azimuths."""
    held = held_pairs()
    turn = GOLDEN * np.arange(len(held))
    cells = Cells.of_directions(held.theta_i, turn, held.theta_r, turn + held.dphi)
    value = brdf.evaluate(cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r)
    weight = (np.sin(2.0 * held.theta_i) * np.sin(2.0 * held.theta_r))[:, None]
    return (weight * error(cells)).sum(0) / np.maximum((weight * np.abs(value)).sum(0), np.finfo(float).tiny)
