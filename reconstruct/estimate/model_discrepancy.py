"""What a model misses systematically: residuals that neighbouring cells of different views share.

Noise and the views' own errors differ from view to view; what all views miss alike near a pair of directions is the
model's fault, which no covariance knows of. It is part of the standard error, where it was seen and, carried from the
nearest data, where it was not.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree

from photogonio.reconstruct.estimate.outlier_views import pair_places
from photogonio.reconstruct.estimate.weights import level
from photogonio.reconstruct.table.cells import Cells

NEIGHBOURS = 32
MOST_CELLS = 40_000  # evenly taken of more
FLOOR = 1e-3  # of the channel's level: below it residuals are not relative to the model
# of what binning adds: what its second order leaves. Fits of tables and of single pixels differ by 0.03 to 0.17 of it
DOUBT = 0.15
PEAK_DOUBT = 0.015  # likewise, of a narrow peak's blur, which is removed to the fifth order


@dataclass(frozen=True, slots=True)
class Misfit:
    """Relative misfit at the places of the data."""

    places: np.ndarray  # (k, 4) of photogonio.reconstruct.estimate.outlier_views.pair_places
    # (k, c) what the cells near share, and what is not known of them alike, over the model's size
    relative: np.ndarray
    floor: np.ndarray  # (c,) least size of the model

    def at(self, cells: Cells, predicted: np.ndarray) -> np.ndarray:
        """(n, c) misfit, 1/sr, at the directions of ``cells``, where the model is ``predicted`` (n, c)."""
        tree = _tree(self.places.tobytes())
        both = np.concatenate(_both_ways(cells))
        # of a grid the ways there are those back in another order: as bytes, which sort ten times as fast as numbers
        same = both.view(f"V{both.itemsize * both.shape[1]}").ravel()
        _, first, which = np.unique(same, return_index=True, return_inverse=True)
        far, near = (found[which].reshape(2, -1) for found in tree.query(both[first]))
        nearest = np.where(far[0] <= far[1], near[0], near[1])
        return self.relative[nearest] * np.maximum(np.abs(predicted), self.floor)


@lru_cache(maxsize=2)
def _tree(places: bytes) -> cKDTree:
    """Of places (k, 4): a result asks the same ones again and again."""
    return cKDTree(np.frombuffer(places).reshape(-1, 4))


def misfit_of(
    cells: Cells, predicted: np.ndarray, added: np.ndarray | None = None, last: np.ndarray | None = None
) -> Misfit:
    """What ``predicted`` (n, c) misses of ``cells``, beyond chance; :data:`DOUBT` of what was ``added`` (n, c) to them
    by binning and the lamps' size, and was removed; and as much as the ``last`` terms (n, c) of a series that goes on
    (:mod:`reconstruct.uncertainty.truncation`), in the mean square of a neighbourhood: it is zero elsewhere than they.
    """
    step = -(-len(cells) // MOST_CELLS)
    cells, predicted = cells.take(np.arange(0, len(cells), step)), predicted[::step]
    floor = FLOOR * level(cells)
    size = np.maximum(np.abs(predicted), floor)
    relative = (cells.value - predicted) / size
    doubt = 0.0 if added is None else _doubt(cells, predicted, added[::step], size)
    there, back = _both_ways(cells)
    tree = cKDTree(np.concatenate([there, back]))
    count = min(NEIGHBOURS, len(cells))
    near = tree.query(there, k=count)[1].reshape(len(cells), count) % len(cells)
    mean = np.stack([column[near].mean(1) for column in relative.T], axis=1)
    chance = np.stack([column[near].var(1) for column in relative.T], axis=1) / _independent(cells, near)
    square = np.maximum(mean**2 - chance, 0.0) + doubt**2
    if last is not None:
        square += np.stack([column[near].mean(1) for column in ((last[::step] / size) ** 2).T], axis=1)
    return Misfit(there, np.sqrt(square), floor)


def _doubt(cells: Cells, predicted: np.ndarray, added: np.ndarray, size: np.ndarray) -> np.ndarray:
    """What of the blur is not known, over the model's ``size`` (n, c); of a narrow peak, over what is seen if that is
    more: a blurred peak's flank may be many times the sharp one's, which says nothing of its top."""
    if not cells.peaked:
        return DOUBT * added / size
    return PEAK_DOUBT * added / np.maximum(size, np.abs(predicted + added))


def _independent(cells: Cells, near: np.ndarray) -> np.ndarray:
    """(n, 1) how many independent values the cells ``near`` (n, k) hold: views, or single measurements."""
    if not cells.binned:
        return np.full((len(near), 1), near.shape[1])
    views = np.sort(cells.group[near], axis=1)
    return 1 + (np.diff(views, axis=1) > 0).sum(1)[:, None]


def _both_ways(cells: Cells) -> tuple[np.ndarray, np.ndarray]:
    """(n, 4) places of the pairs and of their reciprocal twins."""
    there = pair_places(cells.theta_i, cells.theta_r, cells.dphi)
    return there, pair_places(cells.theta_r, cells.theta_i, cells.dphi)
