"""The smoothest isotropic surface that predicts measured rows: a ridge on modes, which knows of no lobe.

It is a Gaussian process whose kernel is that of the modes with variances that fall with their degree (Wahba 1990), so
all it needs is one strength, by rows left out. What is richer has to predict better than it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.estimate.folded_design import FoldedDesign
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model_selection import Prior
from photogonio.reconstruct.estimate.normal_equations import Factors, solve
from photogonio.reconstruct.estimate.weights import level
from photogonio.reconstruct.table.cells import Cells

ORDER = 12
DECAY = 1.5  # between the smoothing spline's and the bilaplacian's, which are a few per cent worse on measured tables
STRENGTHS = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0)
SURE = 1e-3  # standard deviation, of the level, of the noise against which the strengths count


@dataclass(frozen=True, slots=True)
class SmoothRidge:
    """A ridge and what it says of rows."""

    prior: Prior
    left_out: np.ndarray  # (n, c) each row by the rows of all other folds, 1/sr
    said: np.ndarray  # (n, c) by all rows
    coefficients: np.ndarray  # (m, c) of all rows, 1/sr


def smooth_ridge(
    cells: Cells, deviation: np.ndarray, fold: np.ndarray, basis: Basis, design: np.ndarray | None = None
) -> SmoothRidge:
    """The ridge on ``basis`` of the strength that predicts ``fold`` (n,) best, each from all others.

    ``deviation`` (n, c), or (n, 1) of all channels, in units of the level: the shape of the noise. ``design`` (n, m)
    is that of ``basis`` if it is at hand.
    """
    design = basis.design(cells) if design is None else design
    size = level(cells)
    value, weight = cells.value / size, (SURE * deviation) ** -2.0
    folded = FoldedDesign(design, weight, fold)
    sums = folded.statistics(value, np.empty((len(cells), 0)))
    rest, whole, ones = sums.without_each(), sums.total(), np.ones(weight.shape[1])

    def tries() -> Iterator[tuple[float, Prior, np.ndarray]]:
        for strength in STRENGTHS:
            prior = Prior(strength, DECAY)
            penalty = prior.precision(basis.degree(), ones)
            coefficients = solve(rest, Factors(rest.modes_gram, penalty), np.empty(0))
            yield float(sums.residual(coefficients).sum()), prior, coefficients

    _, prior, coefficients = min(tries(), key=lambda one: one[0])
    all_rows = solve(whole, Factors(whole.modes_gram, prior.precision(basis.degree(), ones)), np.empty(0))[0]
    left_out = np.empty_like(value)
    for k, own in enumerate(coefficients):
        left_out[fold == k] = design[fold == k] @ own.T
    return SmoothRidge(prior, left_out * size, design @ all_rows.T * size, all_rows.T * size)
