"""Single rows that lie by a factor off all rows around them: a decimal point that has slipped, a beam that was blocked.

A surface has peaks that one row alone is near, about the mirror direction and the light's own, but no holes, and no
peaks elsewhere. So a row is out where nearly all its neighbours lie on one side of it by :data:`FACTOR`, and what they
say together is sure of it.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from photogonio.reconstruct.table.neighbours import Expected

BESIDE = 8  # rows nearest to one, all but
SPARED = 1  # of which lie on one side of it, by
FACTOR = 3.0
SURE = 8.0  # standard errors of what they say together
MOST_ROWS = 100_000  # of a table: one row of more has no weight
FAINT = 0.01  # of the mean, that is around such a row at least: a model falls to nothing anywhere
SHARE = 0.1  # of the rows, at most: more are another surface


def far_off(at: np.ndarray, value: np.ndarray, good: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows (m,) and (k,) of those ``good`` (n,) bool, ascending, that lie far below, and far above, those of them that
    are nearest: places ``at`` (n, 4) with ``value`` (n,), zeros among them."""
    rows = np.flatnonzero(good)
    if not BESIDE < len(rows) <= MOST_ROWS:
        return rows[:0], rows[:0]
    near = cKDTree(at[rows]).query(at[rows], k=[*range(2, BESIDE + 2)])[1]
    beside, here = np.sort(value[rows[near]], axis=1), value[rows]
    low = (here > 0.0) & (here * FACTOR < beside[:, SPARED])
    return rows[low], rows[here > FACTOR * beside[:, -1 - SPARED]]


def sure_of(value: np.ndarray, told: Expected, relative: float, noise: np.ndarray) -> np.ndarray:
    """(q,) bool: readings of ``value`` (q,) that what others say of their places excludes; ``relative`` and ``noise``
    (q,), 1/sr, are that of a reading."""
    apart = np.abs(np.log(value) - np.log(told.value))
    sure = apart > np.maximum(SURE * np.maximum(told.spread, relative), np.log(FACTOR))
    straight = told.straight - 3.0 * told.rough > FACTOR * value  # a surface may fall to 0
    return sure & (np.abs(value - told.value) > SURE * noise) & (straight | (value > told.value))
