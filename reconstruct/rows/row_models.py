"""What measured rows are fitted by: an average of smooth models, unless lobes whose shapes are searched predict better.

The average (:mod:`reconstruct.rows.row_average`) is always there; a single model of free shapes is taken only where
it predicts rows left out better by much more than chance, since its shapes have seen them.
"""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.estimate.lobe_search import Fitted
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model_selection import Candidate
from photogonio.reconstruct.estimate.weights import error_model, scale_of, student_cost
from photogonio.reconstruct.rows.row_average import Average, Weighed
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.budget import Uncertainty

ORDER = 12  # fewer predict rows left out as well now and then, by chance, and go astray elsewhere
FINER = (16, 20, 24)  # on, while that lowers the loss by
BETTER = 0.05
ROWS_A_MODE = 1.9  # so many tell such orders
MUCH = 0.65  # of the average's loss is what a single model may have at most
CERTAIN = 2.0  # standard errors of that comparison


def best_average(cells: Cells, of: Average | None = None, *, finer: bool = True) -> Average:
    """The average of the order that predicts rows left out best, from :data:`ORDER` on: the prior bounds it anyhow.

    With the lobes ``of`` an average of some of the rows, if there is one; higher orders are tried if ``finer``.
    """
    deviation = error_model(cells)
    lobes = None if of is None else tuple(one.lobes for one in of.members if one.lobes.families)
    best = Weighed.of(cells, deviation, ORDER, lobes)
    for order in FINER if finer else ():
        if len(cells) < ROWS_A_MODE * len(Basis("isotropic", order).modes):
            break
        other = Weighed.of(cells, deviation, order, lobes)
        loss, before = (loss_of(cells, one.left_out, one.rows.fold).sum() for one in (other, best))
        if loss < before:
            best = other
        if loss > (1.0 - BETTER) * before:
            break
    return best.average()


def loss_of(cells: Cells, left_out: np.ndarray, fold: np.ndarray) -> np.ndarray:
    """(f,) squared residuals of rows left out, in their errors."""
    missed = (cells.value - left_out) / error_model(cells)
    return np.bincount(fold, np.sum(missed**2, axis=1))


def beats(single: np.ndarray, average: np.ndarray) -> bool:
    """Whether a model of losses ``single`` (f,) predicts the same folds much better than an average of such losses."""
    tiny = np.finfo(float).tiny
    gain = np.log(np.maximum(average, tiny)) - np.log(np.maximum(single, tiny))
    error = gain.std(ddof=1) / np.sqrt(len(gain)) if len(gain) > 1 else np.inf
    much = -np.log(MUCH)
    return (
        bool(gain.mean() - CERTAIN * error > 0.0 and gain.mean() > much)
        and single.sum() < MUCH * average.sum()
    )


def losses_of(candidate: Candidate, cells: Cells, fold: np.ndarray, scale: float) -> np.ndarray:
    """(f,) as :func:`loss_of`, of a candidate that was tried with errors ``scale`` times theirs."""
    counts = cells.value.shape[1] * np.bincount(fold, minlength=len(candidate.loss))
    return candidate.loss * counts * scale**2


def fitted_of(average: Average, cells: Cells) -> Fitted:
    """The average as a fit of ``cells``."""
    residual = cells.value - average.model.evaluate(cells)
    own = residual / error_model(cells)
    scale = scale_of(own, cells)
    cost = student_cost(own, scale, 1e9)
    return Fitted(average.model, residual, np.zeros_like(residual), np.ones_like(residual), scale, cost)


def uncertainty_of_average(average: Average, scale_error: float = 0.0) -> Uncertainty:
    """Its covariance, with lobe shapes, which are held, for parameters that do not vary."""
    model = average.model
    p, shapes = average.covariance.shape[1], len(model.lobes.flat())
    covariance = np.pad(average.covariance, ((0, 0), (0, shapes), (0, shapes)))
    freedom = max(len(average.fold) - float(len(model.basis.modes)), 30.0)
    return Uncertainty(model.basis, covariance, p - len(model.basis.modes), freedom, scale_error)
