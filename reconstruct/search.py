"""Lobe shapes by variable projection: the linear coefficients are solved for, only the shapes are searched.

Source: Golub and Pereyra (1973); robust weights by iterative reweighting, several starts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from reconstruct.basis import Basis
from reconstruct.cells import Cells
from reconstruct.microfacet import F0_BOUNDS, ROUGHNESS_BOUNDS, TURN_BOUNDS, TYPICAL_F0, Family
from reconstruct.model import LobeSet, Model
from reconstruct.robust import freedom_of, independence, level, residual_scale, student_cost, student_weights
from reconstruct.select import Prior
from reconstruct.solve import Common, Factors, FoldedDesign, Statistics, solve

STARTS = (0.06, 0.12, 0.25, 0.5)  # roughness
TURNS = ((1.0, 1.0), (1.6, 1.0), (1.0, 1.6), (0.625, 1.0), (1.0, 0.625))  # stretch and skew
ROUNDS = 4  # of reweighting
SEARCH_CELLS = 3000  # more do not move the shapes
COARSE, FINE = 0.15, 0.03  # first steps of the search, in logarithms of the shapes
TOLERANCE = 1e-3  # of the logarithms
DIFFERENCE = 1e-5  # of a logarithm, for slopes
LEAST_CURVATURE = 1e-6  # of the largest: a shape that hardly matters


@dataclass(frozen=True, slots=True)
class Fitted:
    """A model with what its cells say of it."""

    model: Model
    residual: np.ndarray  # (n, c) value - model, 1/sr
    shared: np.ndarray  # (n, c) the part of it that is the views' errors of scale
    weight: np.ndarray  # (n, c) robust weights, about 1 and less
    scale: float  # robust standard deviation of the residuals over the error model
    cost: float  # mean negative log likelihood a value, Student's t


def search_lobes(
    cells: Cells,
    deviation: np.ndarray,
    basis: Basis,
    prior: Prior,
    start: LobeSet,
    *,
    free: int | None = None,
    refine: bool = True,
    tolerance: float = TOLERANCE,
    view_errors: np.ndarray | None = None,
) -> Fitted:
    """The fit of ``basis`` and lobes of the families of ``start``; the last ``free`` lobes start anew.

    ``deviation`` (n, c) is the error model, ``view_errors`` (g,) relative standard errors of the views' scales. With
    no lobes, or if their shapes are not to be refined, this is a robust linear fit.
    """
    design = basis.design(cells)
    penalty = prior.precision(basis.degree(), level(cells))
    free = len(start.families) if free is None else free
    weight, scale, freedom = np.ones_like(deviation), 1.0, freedom_of(cells)
    best, shared = start, np.zeros_like(cells.value)
    common = common_error(cells, cells.value, view_errors)
    counts = independence(cells)
    for turn in range(ROUNDS):
        precision = counts * weight / (deviation * scale) ** 2
        profile = Profile(cells, design, precision, penalty, common)
        if turn == 0 and free:
            best = _best_start(profile, start, free)
        if refine:
            best = descend(profile, best, COARSE if turn == 0 and free else FINE, tolerance)
        fitted = Model(basis, *profile.model_parts(best))
        predicted = _predict(cells, design, fitted)
        residual = cells.value - predicted
        common = common_error(cells, predicted, view_errors)
        if common is not None:
            shared = common.shared(residual, precision)
        own = (residual - shared) / deviation
        scale = residual_scale(own)
        weight = student_weights(own / scale, freedom)
    cost = student_cost(own, scale, freedom) + _shared_cost(cells, shared, common, freedom)
    return Fitted(fitted, residual, shared, weight, scale, cost)


def _shared_cost(cells: Cells, shared: np.ndarray, common: Common | None, freedom: float) -> float:
    """Negative log likelihood of the views' errors of scale, a value of the cells."""
    if common is None:
        return 0.0
    first = np.unique(common.unit, return_index=True)[1]
    pattern = common.pattern[first]
    share = np.divide(shared[first], pattern, out=np.zeros_like(pattern), where=pattern != 0.0)
    return len(first) / (independence(cells).sum()) * student_cost(share, 1.0, freedom)


def common_error(cells: Cells, predicted: np.ndarray, view_errors: np.ndarray | None) -> Common | None:
    """The errors of scale of the views of ``cells``, in proportion to ``predicted`` (n, c); None for a single view."""
    views, unit = np.unique(cells.group, return_inverse=True)
    if view_errors is None or len(views) < 2:
        return None
    return Common(unit.ravel(), view_errors[cells.group, None] * predicted)


def thinned(cells: Cells, deviation: np.ndarray) -> tuple[Cells, np.ndarray]:
    """At most about :data:`SEARCH_CELLS` cells, evenly taken."""
    step = -(-len(cells) // SEARCH_CELLS)
    return cells.take(np.arange(0, len(cells), step)), deviation[::step]


def starting_shape(family: Family, roughness: float, turn: tuple[float, float] = TURNS[0]) -> np.ndarray:
    start = {"roughness": roughness, "f0": TYPICAL_F0, "stretch": turn[0], "skew": turn[1]}
    return np.array([start[name] for name in family.shape_names])


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
        self._folded = FoldedDesign(design, weight, np.zeros(len(cells), int), common)
        self._factors = Factors(self._folded.modes_gram, penalty)

    def cost(self, lobes: LobeSet) -> float:
        """Least penalised weighted sum of squares with these shapes."""
        return self._cost(*self._solve(lobes)[:2])

    def slopes(self, lobes: LobeSet) -> tuple[float, np.ndarray, np.ndarray]:
        """:meth:`cost`, its derivatives (p,) by the logarithms of the shapes, and those of Gauss and Newton's second
        derivatives (p,) with the linear coefficients held.

        At the least, what the linear coefficients do with the shapes changes nothing, to first order.
        """
        statistics, solution, fixed, columns = self._solve(lobes)
        modes, own = solution[0, :, : statistics.modes].T, solution[0, :, statistics.modes :].T
        said = fixed[:, None] + columns @ own
        residual = self._cells.value - said - self._design @ modes
        if self._common is not None:
            residual -= self._common.shared(residual, self._weight)
        pull, logs = self._weight * residual, lobes.flat()
        first, second = np.empty_like(logs), np.empty_like(logs)
        for p in range(len(logs)):
            ahead = logs.copy()
            ahead[p] += DIFFERENCE
            slope = (_said(lobes.with_flat(ahead), self._cells, own) - said) / DIFFERENCE
            first[p] = -2.0 * np.vdot(pull, slope)
            second[p] = 2.0 * np.vdot(self._weight * slope, slope)
        return self._cost(statistics, solution), first, second

    def model_parts(self, lobes: LobeSet) -> tuple[np.ndarray, LobeSet, np.ndarray]:
        """Mode coefficients (m, c), the lobes and their coefficients (q, c): the rest of a :class:`Model`."""
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


def descend(profile: Profile, lobes: LobeSet, step: float, tolerance: float = TOLERANCE) -> LobeSet:
    """The shapes of least cost near those of ``lobes``, first tried ``step`` apart in their logarithms, to within
    ``tolerance`` of those."""
    if not lobes.families:
        return lobes
    low, high = np.array(_bounds(lobes)).T
    start = np.clip(lobes.flat(), low + step, high - step)
    at_start = profile.slopes(lobes.with_flat(start))
    second = at_start[2]
    size = np.sqrt(np.maximum(second, max(LEAST_CURVATURE * second.max(), np.finfo(float).tiny)))

    def scaled(y: np.ndarray) -> tuple[float, np.ndarray]:
        cost, first, _ = profile.slopes(lobes.with_flat(start + y / size)) if y.any() else at_start
        return cost, first / size

    found = minimize(
        scaled,
        np.zeros_like(start),
        jac=True,
        method="L-BFGS-B",
        bounds=list(zip((low - start) * size, (high - start) * size, strict=True)),
        options={"ftol": 1e-9, "gtol": 1e-3 * tolerance * size.min()},
    )
    return lobes.with_flat(start + found.x / size)


def _said(lobes: LobeSet, cells: Cells, coefficients: np.ndarray) -> np.ndarray:
    fixed, columns = lobes.columns(cells)
    return fixed[:, None] + columns @ coefficients


def _best_start(profile: Profile, start: LobeSet, free: int) -> LobeSet:
    kept = start.shapes[: len(start.shapes) - free]
    anew = start.families[len(kept) :]
    trials = []
    for turn in TURNS if any(family.turning for family in anew) else TURNS[:1]:
        for roughness in STARTS:
            new = tuple(starting_shape(family, roughness, turn) for family in anew)
            trials.append(LobeSet(start.families, kept + new))
    return min(trials, key=profile.cost)


def _bounds(lobes: LobeSet) -> list[tuple[float, float]]:
    limits = {"roughness": ROUGHNESS_BOUNDS, "f0": F0_BOUNDS, "stretch": TURN_BOUNDS, "skew": TURN_BOUNDS}
    return [tuple(np.log(limits[name])) for family in lobes.families for name in family.shape_names]


def _predict(cells: Cells, design: np.ndarray, model: Model) -> np.ndarray:
    fixed, columns = model.lobes.columns(cells)
    return fixed[:, None] + columns @ model.lobe_coefficients + design @ model.coefficients
