"""Weights of cells: noise, what the model cannot follow, and the lost say of outliers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from photogonio.capture import robust
from photogonio.reconstruct.estimate.narrow_gloss import half_angles
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.table.refinement import NEAR

PHOTO_FREEDOM = (
    4.0  # of Student's t, the loss of residuals (Lange, Little and Taylor 1989): dust, glints, penumbra
)
NORMAL = 1e9  # of measured rows: those that are not normal are told by their neighbours, before any model
SYSTEMATIC = 0.005  # relative: geometry, stray light, texture; scaled with the residuals found
STRAY_DOUBT = 0.3  # of the stray light removed
FLOOR = 1e-3  # of the channel's level
SUSPECT = 4.0  # standard errors from the other views
LEAST_SUSPECT = 0.015  # relative; less cannot be told from a misfit of the model
STEEP = 1.0  # relative, a radian: as much f may change from where others looked without the model's knowing
MOST_DOUBT = 0.01  # of all views' scales for their scatter alone, which a wrong model makes too
FREE = 1.0  # relative standard error of a scale that is not believed
LEAST_TO_JUDGE = 5  # views: the scatter of fewer says little
INDEPENDENT = 30.0  # cells: as many as a view's residuals count for, since they hang together


def error_model(cells: Cells, stray: np.ndarray | None = None) -> np.ndarray:
    """Standard deviation (n, c) of the cells' values about a perfect model, up to one common factor.

    ``stray`` (n, c) is what was subtracted as stray light. Unbinned measurements carry their own errors, if any.
    """
    variance = cells.variance.copy()
    if cells.binned:
        variance += (SYSTEMATIC * cells.value) ** 2 + (FLOOR * level(cells)) ** 2
    elif not variance.any():  # not known: the same everywhere
        variance += level(cells) ** 2
    if stray is not None:
        variance += (STRAY_DOUBT * stray) ** 2
    if cells.doubt is not None:
        variance += cells.doubt**2
    return np.sqrt(variance)


def level(cells: Cells) -> np.ndarray:
    """A channel's typical value (c,), 1/sr: what smoothness and floors are measured against."""
    return np.maximum(typical(cells.value), np.finfo(float).tiny)


def typical(value: np.ndarray) -> np.ndarray:
    """Size (c,) of the middle one of ``value`` (n, c); of all, where most are 0, as beside a narrow peak."""
    size = np.abs(value)
    middle = np.median(size, axis=0)
    return np.where(middle > 0.0, middle, size.mean(axis=0))


def residual_scale(scaled: np.ndarray) -> float:
    """Robust standard deviation of residuals already divided by their error model."""
    return max(float(robust.deviation(scaled)), 1e-12)


def scale_of(scaled: np.ndarray, cells: Cells) -> float:
    """Standard deviation of the residuals of ``cells``, already divided by their error model: a robust one if the loss
    is, else theirs."""
    if freedom_of(cells) < NORMAL:
        return residual_scale(scaled)
    return max(float(np.sqrt(np.mean(scaled**2))), 1e-12)


def independence(cells: Cells) -> np.ndarray:
    """(n, 1) what one cell counts for: residuals of a view hang together (geometry, stray light, texture), so that a
    view is worth at most :data:`INDEPENDENT` cells however finely it is cut; what it shows of a narrow peak, as many
    again."""
    if not cells.binned:
        return np.ones((len(cells), 1))
    part = 2 * cells.group + (half_angles(cells) < NEAR) if cells.peaked else cells.group
    return np.minimum(INDEPENDENT / np.bincount(part)[part], 1.0)[:, None]


def freedom_of(cells: Cells) -> float:
    """Degrees of freedom of the loss."""
    return PHOTO_FREEDOM if cells.binned and cells.robust else NORMAL


def student_weights(scaled: np.ndarray, freedom: float) -> np.ndarray:
    """Weights in (0, (v + 1) / v] of residuals divided by their standard deviation."""
    return (freedom + 1.0) / (freedom + scaled**2)


def student_cost(scaled: np.ndarray, scale: float, freedom: float) -> float:
    """Mean negative log likelihood of residuals over the error model, but for a constant."""
    return float(np.mean(0.5 * (freedom + 1.0) * np.log1p((scaled / scale) ** 2 / freedom)) + np.log(scale))


@dataclass(frozen=True, slots=True)
class ViewScales:
    """Each view's factor on its values, as found against all other views."""

    factor: np.ndarray  # (g,) divide the view's values by it; 1 where the view is believed
    error: np.ndarray  # (g,) relative standard error of what remains
    freed: np.ndarray  # (g,) bool: the view disagrees so much that its own scale is not believed

    @classmethod
    def none(cls, errors: np.ndarray) -> ViewScales:
        """All factors 1, with relative standard ``errors`` (g,)."""
        return cls(np.ones_like(errors), errors, np.zeros(len(errors), bool))


def view_scales(
    cells: Cells,
    predicted: np.ndarray,
    deviation: np.ndarray,
    weight: np.ndarray,
    prior: np.ndarray,
    apart: Callable[[Cells, int], float] = lambda cells, view: 0.0,
) -> ViewScales:
    """How far each view's scale may be believed, from how its values compare with the prediction (n, c).

    ``deviation`` and ``weight`` (n, c) are the error model and the robust weights; ``prior`` (g,) relative standard
    errors. Residuals within a view hang together, so a view counts as :data:`INDEPENDENT` cells at most. Where views
    scatter more than their errors say, the errors are raised toward the scatter. A view that lies further from the
    others than chance allows has its scale set free, but it must lie the further the farther ``apart`` (cells, view),
    radians, it looked from all others: what it alone has seen is news.
    """
    shift, error = _view_shifts(cells, predicted, deviation, weight)
    shift = shift - np.median(shift)
    spread = robust.deviation(shift) if len(shift) >= LEAST_TO_JUDGE else 0.0
    expected = np.sqrt(prior**2 + error**2 + spread**2)
    freed = np.abs(shift) > np.maximum(SUSPECT * expected, LEAST_SUSPECT)
    for view in np.flatnonzero(freed):
        freed[view] = abs(shift[view]) > STEEP * apart(cells, int(view))
    excess = np.sqrt(max(spread**2 - float(np.median(error)) ** 2, 0.0))
    raised = np.maximum(prior, min(excess, MOST_DOUBT))
    return ViewScales(np.where(freed, 1.0 + shift, 1.0), np.where(freed, FREE, raised), freed)


def _view_shifts(cells, predicted, deviation, weight) -> tuple[np.ndarray, np.ndarray]:
    """(g,) weighted mean relative residual of each view, and its standard error."""
    usable = (predicted > 0.0) & np.isfinite(predicted)
    ratio = np.where(usable, cells.value / np.where(usable, predicted, 1.0) - 1.0, 0.0)
    precision = np.where(usable, weight * (predicted / deviation) ** 2, 0.0).sum(1)
    sum_ratio = np.where(usable, weight * (predicted / deviation) ** 2 * ratio, 0.0).sum(1)
    groups = len(cells.groups)
    total = np.bincount(cells.group, precision, groups)
    shift = np.bincount(cells.group, sum_ratio, groups) / np.maximum(total, np.finfo(float).tiny)
    seen = np.maximum(np.bincount(cells.group, minlength=groups) * predicted.shape[1], 1)
    total *= np.minimum(1.0, INDEPENDENT / seen)
    return shift, 1.0 / np.sqrt(np.maximum(total, 1e-6))
