"""Lobe shapes by variable projection: the linear coefficients are solved for, only the shapes are searched.

Source: Golub and Pereyra (1973); robust weights by iterative reweighting, several starts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.estimate.folded_design import Common
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.model_selection import Prior
from photogonio.reconstruct.estimate.narrow_gloss import evenly
from photogonio.reconstruct.estimate.variable_projection import TOLERANCE, Profile, descend
from photogonio.reconstruct.estimate.weights import (
    freedom_of,
    independence,
    level,
    scale_of,
    student_cost,
    student_weights,
)
from photogonio.reconstruct.lobes.families import TYPICAL_F0, Family
from photogonio.reconstruct.table.cells import Cells

STARTS = (0.06, 0.12, 0.25, 0.5)  # roughness
NARROW_STARTS = (0.03, *STARTS)  # where a narrow peak is seen
TURNS = ((1.0, 1.0), (1.6, 1.0), (1.0, 1.6), (0.625, 1.0), (1.0, 0.625))  # stretch and skew
ROUNDS = 4  # of reweighting
ROUNDS_OF_ROWS = 2  # whose weights are known: only the size of their noise is found
SEARCH_CELLS = 3000  # more do not move the shapes
COARSE, FINE = 0.15, 0.03  # first steps of the search, in logarithms of the shapes


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
    for turn in range(ROUNDS if cells.binned or common is not None else ROUNDS_OF_ROWS):
        precision = counts * weight / (deviation * scale) ** 2
        profile = Profile(cells, design, precision, penalty, common)
        if turn == 0 and free:
            best = _best_start(profile, start, free, cells.peaked)
        if refine:
            best = descend(profile, best, COARSE if turn == 0 and free else FINE, tolerance)
        fitted = Model(basis, *profile.model_parts(best))
        predicted = _predict(cells, design, fitted)
        residual = cells.value - predicted
        common = common_error(cells, predicted, view_errors)
        if common is not None:
            shared = common.shared(residual, precision)
        own = (residual - shared) / deviation
        scale = scale_of(own, cells)
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
    """At most about :data:`SEARCH_CELLS` cells, evenly taken but of a narrow peak."""
    kept = evenly(cells, SEARCH_CELLS)
    return cells.take(kept), deviation[kept]


def starting_shape(family: Family, roughness: float, turn: tuple[float, float] = TURNS[0]) -> np.ndarray:
    start = {"roughness": roughness, "f0": TYPICAL_F0, "stretch": turn[0], "skew": turn[1]}
    return np.array([start[name] for name in family.shape_names])


def _best_start(profile: Profile, start: LobeSet, free: int, peaked: bool) -> LobeSet:
    kept = start.shapes[: len(start.shapes) - free]
    anew = start.families[len(kept) :]
    trials = []
    for turn in TURNS if any(family.turning for family in anew) else TURNS[:1]:
        for roughness in NARROW_STARTS if peaked else STARTS:
            new = tuple(starting_shape(family, roughness, turn) for family in anew)
            trials.append(LobeSet(start.families, kept + new))
    return min(trials, key=profile.cost)


def _predict(cells: Cells, design: np.ndarray, model: Model) -> np.ndarray:
    fixed, columns = model.lobes.columns(cells)
    return fixed[:, None] + columns @ model.lobe_coefficients + design @ model.coefficients
