"""Finer facets toward the mirror direction, where a narrow gloss changes from pixel to pixel.

Pixels whose half vector lies within :data:`NEAR` of the normal are sorted into facets of level :data:`FINEST_NEAR`, all
others into those of the table's level; both are numbered at the finer level, a coarse facet by the first of those that
it holds. So tables add as ever, and a finer one becomes the coarser by division.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.reconstruct.table.facet_table import FacetTable, pair_keys, stacked, table_of_sums
from photogonio.reconstruct.table.facets import facet_index

NEAR = float(np.radians(12.0))
NEAR_SLOPE2 = float(np.tan(NEAR) ** 2)
FINEST_NEAR = 6  # facets of 0.8 degrees


def finer_of(level: int) -> int:
    """Levels by which facets near the mirror direction are finer than those of ``level``."""
    return max(FINEST_NEAR - level, 0)


def near_mirror(incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
    """(n,) whether the half vectors of pairs of directions (n, 3), which are of equal length, lie near the normal."""
    half = incident + exit
    return half[:, 0] ** 2 + half[:, 1] ** 2 < NEAR_SLOPE2 * half[:, 2] ** 2


def refined_facets(
    incident: np.ndarray, exit: np.ndarray, level: int, finer: int
) -> tuple[np.ndarray, np.ndarray]:
    """(n,) facets of pairs of unit vectors (n, 3), numbered at level ``level + finer``."""
    near = near_mirror(incident, exit)

    def found(directions: np.ndarray) -> np.ndarray:
        coarse = facet_index(directions, level) << 2 * finer
        return np.where(near, facet_index(directions, level + finer), coarse)

    return found(incident), found(exit)


def coarsened(table: FacetTable) -> FacetTable:
    """The table with facets of its level everywhere."""
    if not table.finer:
        return table
    facet_i, facet_r = table.facet_i >> 2 * table.finer, table.facet_r >> 2 * table.finer
    coarse = table_of_sums(
        level=table.level,
        channels=table.channels,
        groups=table.groups,
        isotropic=table.isotropic,
        keys=pair_keys(table.group, facet_i, facet_r, table.level),
        sums=stacked(table),
        left_out=table.left_out,
    )
    return replace(coarse, finer=0)
