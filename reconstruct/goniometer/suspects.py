"""Values that may be marks of a missing one, by what they are, and single rows by a factor off all around them: whether
they are is for their neighbours to say.

A surface has peaks that one row alone is near, about the mirror direction and the light's own, but no holes, and no
peaks elsewhere. So a row is suspected where nearly all its neighbours lie on one side of it by :data:`FACTOR`.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from photogonio.reconstruct.table.neighbours import Expected, apart, numbered

FEWEST = 8  # rows with values above zero, by which others can be judged
APART = 3.0  # factor between a mark of a missing value and what neighbours say
STUCK = 8  # times that any value must come, at different pairs of directions, to be suspect
FAR = 20.0  # factor between the largest value and the next that is suspect
OFTEN = 0.01  # of the rows, that hold the same largest value
ODD = 4.0  # times as often as the values next to it a low one must come, to be suspect, and
AT_LEAST = 3  # times
BESIDE = 8  # rows nearest to one, all but
SPARED = 1  # of which lie on one side of it, by
FACTOR = 3.0
SURE = 8.0  # standard errors of what they say together
MOST_ROWS = 100_000  # of a table: one row of more has no weight
FAINT = 0.01  # of the mean, that is around such a row at least: a model falls to nothing anywhere
SHARE = 0.1  # of the rows, at most: more are another surface
_MARKS = {9, 99, 999, 9999, 99999, 999999, 32767, 32768, 65535, 2147483647}


def suspects(at: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Values that may be marks: below zero and repeated, or far below all others, or the largest if they are repeated
    or far above the next. The same value at the same place is not repeated."""
    values, count = np.unique(apart(value, numbered(at)), return_counts=True)
    middle = float(np.median(value[value > 0.0])) if (value > 0.0).any() else 1.0
    below = values < 0.0
    suspect = values[below & ((count > 1) | (values < -FAR * middle) | is_mark(values))].tolist()
    for k in range(len(values) - 1, max(len(values) - 6, 0), -1):
        often = OFTEN * len(value) < count[k] < 0.5 * len(value) and count[k] >= FEWEST
        least = 1.0 if often else APART if count[k] > 1 else FAR
        if values[k] <= 0.0 or not values[k] > least * max(values[k - 1], middle):
            break
        suspect.append(values[k])
    return np.unique(suspect + _odd_suspects(values, count, middle))


def _odd_suspects(values: np.ndarray, count: np.ndarray, middle: float) -> list[float]:
    """Those above zero, of ascending ``values``, that lie far below the middle and the next, or come far more often
    than the values next to them: what a program writes where it has nothing to write."""
    above = values > 0.0
    values, count = values[above], count[above]
    if len(values) < FEWEST:
        return []
    apart = APART if count[0] > 1 else FAR
    found = [float(values[0])] if values[0] * apart < min(values[1], middle) else []
    often = (count >= AT_LEAST) & (values < middle / APART) | (count >= STUCK)
    for k in np.flatnonzero(often)[np.argsort(-count[often], kind="stable")][: 2 * FEWEST]:
        beside = np.r_[count[max(k - 3, 0) : k], count[k + 1 : k + 4]]
        if count[k] >= ODD * beside.mean():
            found.append(float(values[k]))
    return sorted(set(found))


def is_mark(values: np.ndarray) -> np.ndarray:
    """Whether numbers are such as programs write for a missing one."""
    size = np.abs(values)
    return np.isin(size, list(_MARKS)) | (size == 1.0) | (size >= 1e29)


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
    off = np.abs(np.log(value) - np.log(told.value))
    sure = off > np.maximum(SURE * np.maximum(told.spread, relative), np.log(FACTOR))
    straight = told.straight - 3.0 * told.rough > FACTOR * value  # a surface may fall to 0
    return sure & (np.abs(value - told.value) > SURE * noise) & (straight | (value > told.value))
