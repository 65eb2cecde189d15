"""Values that may be marks of a missing one, by what they are: whether they are is for their neighbours to say."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.table.neighbours import apart, numbered

FEWEST = 8  # rows with values above zero, by which others can be judged
APART = 3.0  # factor between a mark of a missing value and what neighbours say
STUCK = 8  # times that any value must come, at different pairs of directions, to be suspect
FAR = 20.0  # factor between the largest value and the next that is suspect
OFTEN = 0.01  # of the rows, that hold the same largest value
ODD = 4.0  # times as often as the values next to it a low one must come, to be suspect, and
AT_LEAST = 3  # times
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
