"""How far a fit is from the data, and how much of that the data's own noise cannot be."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from photogonio.reconstruct.estimate.outlier_views import pair_places

if TYPE_CHECKING:
    from photogonio.reconstruct.table.cells import Cells


def relative_misfit(observed: np.ndarray, fitted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far the fit is from the cells: root mean squares, of the difference over the observed; and the median of
    |fitted - observed| / observed over the cells with f above 0; (c,) each. Cells that are all but black have no say
    in the first."""
    size = np.maximum(np.sqrt(np.mean(observed**2, axis=0)), np.finfo(float).tiny)
    ratio = np.divide(fitted - observed, observed, out=np.full_like(observed, np.nan), where=observed > 0)
    return np.sqrt(np.mean((fitted - observed) ** 2, axis=0)) / size, _medians(np.abs(ratio))


def shared_misfit(cells: Cells, fitted: np.ndarray) -> np.ndarray:
    """(c,) of the relative misfit what neighbouring cells have in common, a median like it; the rest is their noise.

    Errors of chance differ between neighbours by sqrt 2 times their size, and a misfit of the model hardly.
    """
    positive = cells.value > 0.0
    ratio = np.divide(fitted - cells.value, cells.value, out=np.full_like(fitted, np.nan), where=positive)
    places = pair_places(cells.theta_i, cells.theta_r, cells.dphi)
    whole = _medians(np.abs(ratio))
    if len(places) < 2:
        return whole
    beside = cKDTree(places).query(places, k=2)[1][:, 1]
    noise = _medians(np.abs(ratio - ratio[beside])) / np.sqrt(2.0)
    return np.sqrt(np.maximum(whole**2 - np.nan_to_num(noise) ** 2, 0.0))


def _medians(values: np.ndarray) -> np.ndarray:
    """(c,) of each column's finite values (n, c); NaN where there are none."""
    finite = [column[np.isfinite(column)] for column in values.T]
    return np.array([np.median(column) if len(column) else np.nan for column in finite])
