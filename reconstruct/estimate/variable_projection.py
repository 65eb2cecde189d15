"""Least squares as a function of the lobes' shapes alone, and the way down it: variable projection.

The linear coefficients are solved for at any shapes (Golub and Pereyra 1973); slopes are those of the residual with
what the linear coefficients take of them removed (Kaufman 1975), which makes the steps of Gauss and Newton few even
where two shapes can hardly be told apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from photogonio.reconstruct.estimate.folded_design import Common, FoldedDesign
from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.normal_equations import RIDGE, Factors, Statistics, solve
from photogonio.reconstruct.lobes.families import F0_BOUNDS, ROUGHNESS_BOUNDS, TURN_BOUNDS
from photogonio.reconstruct.modes.angles import half_difference, unit_vectors
from photogonio.reconstruct.table.cells import Cells

TOLERANCE = 1e-3  # of the logarithms
DIFFERENCE = 1e-5  # of a logarithm, for slopes
SETTLED = 1e-3  # of the cost, a weighted sum of squares: a thirtieth of a standard error
STEPS = 30  # of a descent, at most
FARTHEST = 1.0  # of a logarithm in one step
_DAMPING = (1e-3, 1e8)  # at first, relative to the diagonal, and where a descent gives up
_BOUNDS = {"f0": F0_BOUNDS, "stretch": TURN_BOUNDS, "skew": TURN_BOUNDS}
# roughness at least, of the slope of the nearest facet that data see: a peak of GGX is at most 25 times what was seen
SEEN = 0.5
MOST_LEAST = 0.5  # that bound, at most


@dataclass(frozen=True, slots=True)
class Slope:
    """The cost at some shapes, and how it falls; all by the logarithms of the shapes."""

    cost: float
    first: np.ndarray  # (p,) derivatives
    second: np.ndarray  # (p, p) those of Gauss and Newton


class Profile:
    """The linear part of a fit as a function of the lobes' shapes alone."""

    def __init__(
        self,
        cells: Cells,
        design: np.ndarray,
        weight: np.ndarray,
        penalty: np.ndarray,
        common: Common | None = None,
    ):
        """``design`` (n, m) of the modes at ``cells``, ``weight`` (n, c), ``penalty`` (c, m) of their squares."""
        self._cells, self._design, self._weight, self._common = cells, design, weight, common
        self._penalty = penalty
        self._least = _least_roughness(cells)
        self._folded = FoldedDesign(design, weight, np.zeros(len(cells), int), common)
        self._factors = Factors(self._folded.modes_gram, penalty)

    def cost(self, lobes: LobeSet) -> float:
        """Least penalised weighted sum of squares with these shapes."""
        return self._cost(*self._solve(lobes)[:2])

    def slope(self, lobes: LobeSet) -> Slope:
        """:meth:`cost` and its derivatives.

        At the least, what the linear coefficients do with the shapes changes nothing, to first order.
        """
        statistics, solution, fixed, columns = self._solve(lobes)
        modes, own = solution[0, :, : statistics.modes].T, solution[0, :, statistics.modes :].T
        said = fixed[:, None] + columns @ own
        residual = self._cells.value - said - self._design @ modes
        if self._common is not None:
            residual -= self._common.shared(residual, self._weight)
        pull, logs = self._weight * residual, lobes.flat()
        slopes, p, q = np.empty((len(logs), *said.shape)), 0, 0
        for k, family in enumerate(lobes.families):
            shapes, part = len(family.shape_names), own[q : q + len(family.coefficient_names)]
            here = said if len(lobes.families) == 1 else _said(lobes, k, self._cells, part)
            for each in range(p, p + shapes):
                ahead = logs.copy()
                ahead[each] += DIFFERENCE
                slopes[each] = (_said(lobes.with_flat(ahead), k, self._cells, part) - here) / DIFFERENCE
            p, q = p + shapes, q + len(part)
        first = -2.0 * np.tensordot(slopes, pull, 2)
        second = 2.0 * self._projected(statistics, solution, slopes, columns, lobes.upper_bounds())
        return Slope(self._cost(statistics, solution), first, second)

    def bounds(self, lobes: LobeSet) -> np.ndarray:
        """(p, 2) of the logarithms of the shapes: a peak that no data come near must not be narrower than they tell."""
        return np.log(
            [
                _BOUNDS.get(name, (self._least[family.retro], ROUGHNESS_BOUNDS[1]))
                for family in lobes.families
                for name in family.shape_names
            ]
        )

    def model_parts(self, lobes: LobeSet) -> tuple[np.ndarray, LobeSet, np.ndarray]:
        """Mode coefficients (m, c), the lobes and their coefficients (q, c): the rest of a model."""
        statistics, solution = self._solve(lobes)[:2]
        return solution[0, :, : statistics.modes].T, lobes, solution[0, :, statistics.modes :].T

    def _solve(self, lobes: LobeSet) -> tuple[Statistics, np.ndarray, np.ndarray, np.ndarray]:
        """Sums and their solution, and the lobes' fixed part and columns."""
        fixed, columns = lobes.columns(self._cells)
        statistics = self._folded.statistics(self._cells.value - fixed[:, None], columns)
        return statistics, solve(statistics, self._factors, lobes.upper_bounds()), fixed, columns

    def _cost(self, statistics: Statistics, solution: np.ndarray) -> float:
        modes = solution[0, :, : statistics.modes]
        return float(statistics.residual(solution).sum() + np.sum(self._penalty * modes**2))

    def _projected(
        self,
        statistics: Statistics,
        solution: np.ndarray,
        slopes: np.ndarray,
        columns: np.ndarray,
        upper: np.ndarray,
    ) -> np.ndarray:
        """(p, p) products of ``slopes`` (p, n, c) without what modes and lobes ``columns`` take of them; a lobe whose
        coefficient is at a bound takes nothing."""
        across, gram = self._folded.own_products(slopes, columns)
        own = solution[0, :, statistics.modes :]
        held = np.zeros(across.shape[:2], bool)
        held[:, statistics.modes :] = (own <= 0.0) | (own >= upper)
        taken = statistics.gram[0].copy()
        every = np.arange(taken.shape[-1])
        taken[:, every[: statistics.modes], every[: statistics.modes]] += self._penalty
        taken[held[:, :, None] | held[:, None, :]] = 0.0
        diagonal = taken[:, every, every]
        taken[:, every, every] = np.where(held, 1.0, diagonal + RIDGE * diagonal.mean(1, keepdims=True))
        across = np.where(held[..., None], 0.0, across)
        return (gram - np.swapaxes(across, 1, 2) @ np.linalg.solve(taken, across)).sum(0)


def descend(profile: Profile, lobes: LobeSet, step: float, tolerance: float = TOLERANCE) -> LobeSet:
    """The shapes of least cost near those of ``lobes``, kept ``step`` off their bounds at first, to within
    ``tolerance`` of their logarithms, or to where the cost hardly falls: Levenberg and Marquardt's steps."""
    if not lobes.families:
        return lobes
    low, high = profile.bounds(lobes).T
    place = np.clip(lobes.flat(), low + step, high - step)
    here, damping = profile.slope(lobes.with_flat(place)), _DAMPING[0]
    for _ in range(STEPS):
        move = _step(here, low - place, high - place, damping)
        expected = -(here.first @ move) - 0.5 * move @ here.second @ move
        if np.abs(move).max() < tolerance or 0.0 <= expected < SETTLED:
            place = place + move if expected > 0.0 else place
            break
        tried = profile.slope(lobes.with_flat(place + move)) if expected > 0.0 else here
        if tried.cost < here.cost:
            good = (here.cost - tried.cost) / expected
            place, here, damping = place + move, tried, damping * (0.1 if good > 0.25 else 2.0)
        else:
            damping = max(10.0 * damping, _DAMPING[0])
        if damping > _DAMPING[1]:
            break
    return lobes.with_flat(np.clip(place, low, high))


def _step(here: Slope, down: np.ndarray, up: np.ndarray, damping: float) -> np.ndarray:
    """Toward the least of the damped quadratic model between ``down`` <= 0 and ``up`` >= 0: a shape that would pass a
    bound is held there, and the others take their steps anew."""
    diagonal = np.diag(here.second)
    least = max(1e-6 * diagonal.max(), np.finfo(float).tiny)
    damped = here.second + damping * np.diag(np.maximum(diagonal, least))
    step, down, up = np.zeros_like(down), np.maximum(down, -FARTHEST), np.minimum(up, FARTHEST)
    free = ~(((down >= 0.0) & (here.first > 0.0)) | ((up <= 0.0) & (here.first < 0.0)))
    while free.any():
        slope = here.first + damped @ np.where(free, 0.0, step)
        step[free] = -np.linalg.solve(damped[np.ix_(free, free)], slope[free])
        within = np.clip(step, down, up)
        free &= within == step
        if (within == step).all():
            break
        step = within
    return step


def _said(lobes: LobeSet, k: int, cells: Cells, coefficients: np.ndarray) -> np.ndarray:
    """(n, c) by one lobe."""
    fixed, columns = lobes.columns_of(k, cells)
    return fixed[:, None] + columns @ coefficients


def _least_roughness(cells: Cells) -> tuple[float, float]:
    """Least roughness of a lobe about the mirror direction, and about the light's own, that ``cells`` can tell: by the
    slopes that each takes its density at, of the half vector and of half the angle between the directions."""
    angles = np.broadcast_arrays(cells.theta_i, cells.theta_r, cells.dphi)
    nearest = _nearest_slopes(np.array(angles, float).tobytes())
    mirror, retro = np.clip(SEEN * nearest, ROUGHNESS_BOUNDS[0], MOST_LEAST)
    return float(mirror), float(retro)


@lru_cache(maxsize=4)
def _nearest_slopes(angles: bytes) -> np.ndarray:
    """(2,) the least of both slopes at theta_i, theta_r and dphi (3, n): searches ask for the same cells again and
    again."""
    theta_i, theta_r, dphi = np.frombuffer(angles).reshape(3, -1)
    incident, exit = unit_vectors(theta_i, 0.0), unit_vectors(theta_r, dphi)
    return np.tan([one.min() for one in half_difference(incident, exit)[:2]])
