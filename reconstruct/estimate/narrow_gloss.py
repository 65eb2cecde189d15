"""Narrow gloss: whether cells show one, and how cells are thinned without losing it.

A peak of roughness 0.03 fills a thousandth of the pairs of directions: of cells taken evenly a search would see one or
none. Where cells show such a peak, those near the mirror direction are kept first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.modes.angles import half_difference, unit_vectors
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.table.refinement import NEAR

TOP = np.radians(2.0)  # of the half vector from the normal: what holds the top of a narrow peak
FLANK = np.radians([6.0, 9.0])  # what lies beside it
GROUND = np.radians([18.0, 25.0])  # what it stands on
NARROW = 2.5  # times as high as beside it, above its ground: roughness up to about 0.15
STANDS_OUT = 1.4  # times as high as beside it with its ground: less is not surely a peak
FEWEST = 3  # cells of each
LARGEST_PART = 0.5  # of the cells that are kept
STEEPEST = np.radians(72.0)  # nearer to grazing the top is not told from the flank


def half_angles(cells: Cells) -> np.ndarray:
    """(n,) angle of the half vector from the normal, radians."""
    return half_difference(unit_vectors(cells.theta_i, 0.0), unit_vectors(cells.theta_r, cells.dphi))[0]


@dataclass(frozen=True, slots=True)
class PeakShown:
    """What some cells show of a narrow peak."""

    near: np.ndarray  # (n,) bool: toward the mirror direction
    top: np.ndarray  # (k,) 1/sr, values of the brightest channel at its top
    beside: np.ndarray  # (m,) 1/sr, likewise beside it
    ground: np.ndarray  # (l,) 1/sr, likewise what it stands on


def shown_by(cells: Cells, finer: bool = True) -> PeakShown:
    """What ``cells`` of photos show of a narrow peak; what it stands on is told by ``finer`` cells toward the mirror
    direction, since in others it lies under its blur."""
    half, value = half_angles(cells), cells.value.max(1)
    steep = np.maximum(cells.theta_i, cells.theta_r) < STEEPEST
    beside = (half > FLANK[0]) & (half < FLANK[1])
    ground = (half > GROUND[0]) & (half < GROUND[1]) & finer
    return PeakShown(half < NEAR, *(value[steep & some] for some in (half < TOP, beside, ground)))


def is_peak(parts: Sequence[PeakShown]) -> bool:
    """Whether ``parts`` show a peak about the mirror direction that is hardly wider than some facets."""
    several = [
        np.concatenate([getattr(part, name) for part in parts]) for name in ("top", "beside", "ground")
    ]
    if min(map(len, several[:2])) < FEWEST:
        return False
    top, beside = (max(float(np.median(one)), 0.0) for one in several[:2])
    ground = float(np.median(several[2])) if len(several[2]) >= FEWEST else 0.0
    ground = min(max(ground, 0.0), beside)
    return top > STANDS_OUT * beside and top - ground > NARROW * (beside - ground)


def evenly(cells: Cells, most: int) -> np.ndarray:
    """Indices, ascending, of at most about ``most`` cells: evenly taken, but of a narrow peak as many as there are."""
    if len(cells) <= most:
        return np.arange(len(cells))
    if not cells.peaked:
        return np.arange(0, len(cells), -(-len(cells) // most))
    return _of_peak(half_angles(cells) < NEAR, most)


def _of_peak(near: np.ndarray, most: int) -> np.ndarray:
    """Indices, ascending, of ``most`` cells of which ``near`` (n,) lie toward the mirror direction."""
    part = _some(np.flatnonzero(near), int(LARGEST_PART * most))
    rest = _some(np.flatnonzero(~near), most - len(part))
    return np.sort(np.concatenate([part, rest]))


def _some(rows: np.ndarray, most: int) -> np.ndarray:
    return rows[np.linspace(0, len(rows), min(most, len(rows)), endpoint=False).astype(int)]


def fewer(parts: Sequence[PeakShown], most: int) -> tuple[np.ndarray, bool]:
    """Which cells, at most ``most``, are kept of those that ``parts`` tell of one after another, indices, ascending;
    and whether they show a narrow peak."""
    near, peaked = np.concatenate([part.near for part in parts]), is_peak(parts)
    if len(near) <= most:
        return np.arange(len(near)), peaked
    return _of_peak(near, most) if peaked else _some(np.arange(len(near)), most), peaked
