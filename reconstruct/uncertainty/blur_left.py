"""How unsure a gloss's roughness is by how wide the cells are that saw it.

A cell's mean is freed of what its width adds to second order (:mod:`reconstruct.estimate.binning_error`). Over a peak
hardly wider than a cell, higher orders are left: turns of variance v about both axes widen a peak of roughness a to a
square of a^2 + 2 v, whose share s = 2 v / a^2 is known but for a share s of it. A narrow peak is freed of it to the
fifth order, which leaves some hundredths of s.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.estimate.narrow_gloss import half_angles
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.budget import Uncertainty

MOST = 0.5  # of a roughness
OF_PEAKS = 0.015  # of s: twice as much holds the error of roughnesses up to s = 0.7


def blur_left(model: Model, cells: Cells) -> np.ndarray:
    """(s,) standard errors of the logarithms of the lobes' shapes: of roughnesses, 0 of all others."""
    errors = [np.zeros(len(shape)) for shape in model.lobes.shapes]
    if cells.turn is None or not errors:
        return np.concatenate([np.zeros(0), *errors])
    away, turn = np.tan(half_angles(cells)) ** 2, cells.turn.mean(1)
    for error, family, shape in zip(errors, model.lobes.families, model.lobes.shapes, strict=True):
        if family.retro:
            continue
        square = float(shape[0]) ** 2
        height = np.exp((away.min() - away) / square)  # of the peak, against where it was seen closest
        share = 2.0 * float(height @ turn / height.sum()) / square
        error[0] = min(OF_PEAKS * share if cells.peaked else 0.5 * share**2, MOST)
    return np.concatenate(errors)


def with_blur_left(spread: Uncertainty, model: Model, cells: Cells) -> Uncertainty:
    """``spread`` of a fit of ``model`` to ``cells`` with that in it."""
    errors, covariance = blur_left(model, cells), spread.covariance.copy()
    at = spread.modes + spread.coefficients + np.arange(len(errors))
    covariance[:, at, at] += errors**2
    return replace(spread, covariance=covariance)
