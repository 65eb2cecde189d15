"""How far a fit is from the data, and how much of that the data's own noise cannot be."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from photogonio.reconstruct.estimate.outlier_views import pair_places

if TYPE_CHECKING:
    from photogonio.reconstruct.table.cells import Cells

BLACK = 3.0  # times the noise that cells below 0 tell: less light is none
MANY_BELOW = 8  # cells
FEW_CELLS = 12  # of a photo: their median says little


def relative_misfit(observed: np.ndarray, fitted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far the fit is from the cells: root mean squares, of the difference over the observed; and the median of
    |fitted - observed| / observed over the cells with f above 0, and, where many are below, above what those tell of
    noise; (c,) each. Cells that are all but black have no say in the first."""
    size = np.maximum(np.sqrt(np.mean(observed**2, axis=0)), np.finfo(float).tiny)
    shown = (observed > 0) & (np.maximum(observed, fitted) > BLACK * _below(observed))
    ratio = np.divide(fitted - observed, observed, out=np.full_like(observed, np.nan), where=shown)
    return np.sqrt(np.mean((fitted - observed) ** 2, axis=0)) / size, _medians(np.abs(ratio))


def _below(observed: np.ndarray) -> np.ndarray:
    """(c,) rms of what is below 0, where as much is as chance brings there: the noise of cells that are black."""
    below = np.minimum(observed, 0.0)
    count = np.count_nonzero(below, axis=0)
    rms = np.sqrt(np.sum(below**2, axis=0) / np.maximum(count, 1))
    return np.where(count >= MANY_BELOW, rms, 0.0)


def missed_by_photo(cells: Cells, fitted: np.ndarray) -> np.ndarray:
    """(g,) of each photo of ``cells`` the median difference from what is ``fitted`` (n, c), over the larger of both and
    in the mean of the channels; NaN of photos with fewer than :data:`FEW_CELLS`."""
    larger = np.maximum(np.maximum(np.abs(cells.value), np.abs(fitted)), np.finfo(float).tiny)
    apart = np.mean(np.abs(fitted - cells.value) / larger, axis=1)
    count = np.bincount(cells.group, minlength=len(cells.groups))
    each = [
        np.median(apart[cells.group == k]) if count[k] >= FEW_CELLS else np.nan for k in range(len(count))
    ]
    return np.array(each)


def shared_misfit(cells: Cells, fitted: np.ndarray) -> np.ndarray:
    """(c,) of the relative misfit what neighbouring cells have in common, a median like it; the rest is their noise.

    Errors of chance differ between neighbours by sqrt 2 times their size, and a misfit of the model hardly.
    """
    places = pair_places(cells.theta_i, cells.theta_r, cells.dphi)
    return np.array([_shared(places, cells.value[:, k], fitted[:, k]) for k in range(fitted.shape[1])])


def _shared(places: np.ndarray, value: np.ndarray, fitted: np.ndarray) -> float:
    """Of one channel (n,), by the places of its directions (n, 3)."""
    rows = np.flatnonzero(value > 0.0)
    ratio = fitted[rows] / value[rows] - 1.0
    whole = float(np.median(np.abs(ratio))) if len(rows) else np.nan
    if len(rows) < 3:
        return whole
    beside = cKDTree(places[rows]).query(places[rows], k=2)[1]
    itself = beside[:, 1] == np.arange(len(rows))  # where several rows are of one place
    other = np.where(itself, beside[:, 0], beside[:, 1])
    noise = float(np.median(np.abs(ratio - ratio[other]))) / np.sqrt(2.0)
    return float(np.sqrt(max(whole**2 - noise**2, 0.0)))


def _medians(values: np.ndarray) -> np.ndarray:
    """(c,) of each column's finite values (n, c); NaN where there are none."""
    finite = [column[np.isfinite(column)] for column in values.T]
    return np.array([np.median(column) if len(column) else np.nan for column in finite])


def correlation(observed: np.ndarray, fitted: np.ndarray) -> float:
    """Pearson's correlation of the finite pairs; NaN where one of the two does not vary."""
    keep = np.isfinite(observed) & np.isfinite(fitted)
    x, y = observed[keep], fitted[keep]
    if len(x) < 2:
        return float("nan")
    x, y = x - x.mean(), y - y.mean()
    scale = np.sqrt((x @ x) * (y @ y))
    return float(x @ y / scale) if scale > 0 else float("nan")
