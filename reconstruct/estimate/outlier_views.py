"""Views that show what all others contradict: a light or a pose that is wrong, a shadow, a photo of something else.

A view is judged against the other views at nearly the same pairs of directions, never by a model's misfit alone: a
peak that the model cannot follow is missed by all views alike, and one that a single view shows is news, not a fault.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from photogonio.reconstruct.estimate.weights import level
from photogonio.reconstruct.table.cells import Cells

DISCORD = 4.0  # times the scatter of the middle view
LEAST_DISCORD = 0.02  # relative scatter below which no view is suspected
FEWEST_TO_JUDGE = 5  # views
FEWEST_CELLS = 12  # of a view that others see too
NEAR = np.radians(5.0)  # between pairs that are compared
NEIGHBOURS = 24
ALIKE = 1.5  # factor by which the model may differ from a cell to those near: in a steep peak a small turn is much
FAINT = 0.01  # of the rms of what the model says
MOST_RATIO = 1e6  # of what is seen to what the model says


def discordant(cells: Cells, predicted: np.ndarray) -> np.ndarray:
    """(g,) bool: views that contradict the others, whatever their scale.

    ``predicted`` (n, c) is a model's value at the cells; only what the cells have beyond it is compared, so that f
    may change between neighbours.
    """
    cells, model = _plain(cells, predicted)
    result = np.zeros(len(cells.groups), bool)
    views = np.unique(cells.group)
    while len(views) >= FEWEST_TO_JUDGE:
        keep = ~result[cells.group]
        worst = _worst(cells.take(keep), model[keep], views)
        if worst is None:
            break
        result[worst] = True
        views = views[views != worst]
    return result


def contradiction(cells: Cells, predicted: np.ndarray) -> float:
    """How far views are from one another at the same pairs of directions, relative, whatever their scales: of the
    middle view; NaN where no two see the same."""
    cells, model = _plain(cells, predicted)
    scatter = _scatters(cells, model, np.unique(cells.group))
    return float(np.nanmedian(scatter)) if np.isfinite(scatter).any() else np.nan


def apart(cells: Cells, view: int) -> float:
    """Angle, radians, by which the middle pair of directions of a view lies from what others saw, there or at the
    reciprocal twin, beyond :data:`NEAR`."""
    own = cells.group == view
    if own.all() or not own.any():
        return 0.0
    there = pair_places(cells.theta_i, cells.theta_r, cells.dphi)
    back = pair_places(cells.theta_r, cells.theta_i, cells.dphi)
    distance, _ = cKDTree(np.concatenate([there[~own], back[~own]])).query(there[own])
    return max(float(np.median(distance)) - NEAR, 0.0)


def _plain(cells: Cells, predicted: np.ndarray) -> tuple[Cells, np.ndarray]:
    """The cells, and what the model says of them, but for the faint ones: there stray light is as much as f."""
    bright = predicted.mean(1) > FAINT * np.sqrt(np.mean(predicted**2))
    return cells.take(bright), np.maximum(predicted[bright], 1e-3 * level(cells))


def _scatters(cells: Cells, model: np.ndarray, views: np.ndarray) -> np.ndarray:
    """(v,) how far each view is from the others, relative; NaN where they see nothing of what it does."""
    ratio = _of_one_scale(cells, cells.value / model, views)
    contrast = _against_others(cells, ratio, np.log(model.mean(1)))
    return np.array([_typical(contrast[cells.group == view]) for view in views])


def _worst(cells: Cells, model: np.ndarray, views: np.ndarray) -> int | None:
    """The view that contradicts the others most; None where none does. One at a time, since a bad view makes those
    that it is compared with look bad."""
    scatter = _scatters(cells, model, views)
    if not np.isfinite(scatter).any():
        return None
    worst = int(np.nanargmax(scatter))
    odd = scatter[worst] > max(DISCORD * np.nanmedian(scatter), LEAST_DISCORD)
    return int(views[worst]) if odd else None


def _of_one_scale(cells: Cells, ratio: np.ndarray, views: np.ndarray) -> np.ndarray:
    """Ratios (n, c) divided by their view's median, where that is any; bounded, since a view of nothing has none."""
    one_scale = np.clip(ratio, -MOST_RATIO, MOST_RATIO)
    for view in views:
        rows = cells.group == view
        middle = np.median(one_scale[rows], axis=0)
        one_scale[rows] /= np.where(middle > 1.0 / MOST_RATIO, middle, 1.0)
    return one_scale


def _against_others(cells: Cells, ratio: np.ndarray, model: np.ndarray) -> np.ndarray:
    """(n,) how far a cell is from the median of other views' cells near it, mean of the channels; NaN: none is near,
    or the logarithm ``model`` (n,) changes much among them."""
    if len(cells) == 0:
        return np.empty(0)
    there, back = (
        pair_places(cells.theta_i, cells.theta_r, cells.dphi),
        pair_places(cells.theta_r, cells.theta_i, cells.dphi),
    )
    tree = cKDTree(np.concatenate([there, back]))
    distance, near = tree.query(there, k=min(NEIGHBOURS, 2 * len(cells)), distance_upper_bound=NEAR)
    near = np.where(np.isfinite(distance), near % len(cells), 0)
    others = np.isfinite(distance) & (cells.group[near] != cells.group[:, None])
    steep = np.where(others, np.abs(model[near] - model[:, None]), 0.0).max(1) > np.log(ALIKE)
    seen = others.any(1) & ~steep
    contrast = np.full(len(cells), np.nan)
    if seen.any():
        values = np.where(others[seen, :, None], ratio[near[seen]], np.nan)
        contrast[seen] = np.abs(ratio[seen] - np.nanmedian(values, axis=1)).mean(1)
    return contrast


def _typical(contrast: np.ndarray) -> float:
    judged = contrast[np.isfinite(contrast)]
    return float(np.median(judged)) if len(judged) >= FEWEST_CELLS else np.nan


def pair_places(theta_i: np.ndarray, theta_r: np.ndarray, dphi: np.ndarray) -> np.ndarray:
    """(n, 4) points whose distance is about the angle by which the directions differ, the light's azimuth being 0."""
    sine = np.sin(theta_r)
    return np.column_stack([theta_i, sine * np.cos(dphi), sine * np.sin(dphi), np.cos(theta_r)])
