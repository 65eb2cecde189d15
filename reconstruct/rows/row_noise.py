"""The noise of measured rows that state none, and rows that are no measurements of the surface at all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model_selection import folds_of
from photogonio.reconstruct.estimate.weights import error_model, level, residual_scale
from photogonio.reconstruct.rows.contradicted import contradiction_of
from photogonio.reconstruct.rows.smooth_ridge import ORDER, smooth_ridge
from photogonio.reconstruct.table.cells import Cells

MOST_ROWS = 2000  # evenly taken of more, to tell the noise by


def with_noise(cells: Cells) -> Cells:
    """Measured rows with variances: as stated, or the same everywhere; rows that their neighbours contradict have
    doubts as large as the contradiction. Cells of photos as they are."""
    if cells.binned:
        return cells
    deviation = error_model(cells)
    if not cells.robust:
        return replace(cells, variance=deviation**2)
    few = cells.take(np.arange(0, len(cells), -(-len(cells) // MOST_ROWS)))
    stated = error_model(few)
    smooth = smooth_ridge(few, stated / level(few), folds_of(few), Basis("isotropic", ORDER))
    scale = [residual_scale(one) for one in ((few.value - smooth.left_out) / stated).T]
    doubt = contradiction_of(cells, deviation * scale)
    return replace(cells, variance=deviation**2, doubt=doubt / scale if doubt.any() else None)
