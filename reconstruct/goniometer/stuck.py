"""Values at which an instrument stood still: one among others, exactly the same where the rows around it differ.

A value is suspected where it comes more often than chance lets values come of which the table has as many nearby: the
digits say how many there could be, and the rest of the table how often a surface's symmetries repeat one. Where noise
is wider than the digits no surface does that. Else it is judged by jumps: where the value is a surface's own, a plateau
or the last digits of a dark one, the rows beside it have values like it.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import gammaln

from photogonio.reconstruct.goniometer.suspects import FEWEST, STUCK
from photogonio.reconstruct.table.neighbours import ALIKE, apart, numbered

LEAST = 3  # times, at different pairs of directions
BESIDE = 20  # distinct values to either side, by which chance is told
CHANCE = 1e-4  # of any value of the table to come as often
USUAL = 0.95  # of the values come at most as often as is usual,
ODD = 3.0  # times as often as which a suspect comes
MOST = 8  # suspects that are looked at
BELOW = 2  # rows at least that lie a jump below one: the least may be a plateau
SOME = 0.03  # of all rows, below by steps that rounding does not make: then it is none
SHARE = 0.15  # of the rows, that a plateau without noise has at least
FAINT = 1e-3  # of the middle value: what fades is for zeros to tell
WIDER = 4.0  # steps of the digits, that noise is wide which repeats no value, and
LEAST_NOISE = 0.002  # of the value
NEAREST = 8  # rows beside one
RANGE = 0.5  # of what the rows beside one span, and
NOISE = 4.0  # standard deviations, beyond them: a jump
STEPS, SMALL = 2.0, 0.05  # of the digits and of the value: no smaller one is
FAR_STEPS = 6.0  # of the digits, that rows among others lie off in the middle where noise is less than a step
HARMLESS = 0.01  # of the value: what the rows beside say as well, as a table of wide cells read at finer steps has it
# of a run of lines, that stand still; and of all rows, which a plateau has of a model's table
RUN, FEW = 0.9, 0.25
HARMED = 0.95  # quantile of how far rows beside one are from it, by which a few that matter count
JUMPS = 0.25  # share of the rows, and
ASKED, TOLD = (
    2000,
    50_000,
)  # rows that are asked of their neighbours, and rows that may be those, evenly taken of more
FEWEST_JUMPS = 2  # of them to either side, that must jump: a plateau does so to one


def stuck_suspects(at: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Values above zero, but for the largest, that come more often than chance has it; the most frequent first."""
    counted = [apart(value, number) for number in (_either_way(at), *_surfaces_own(at))]
    told = [np.unique(each[each > 0.0], return_counts=True) for each in counted]
    values, count = told[0][0], np.min([one for _, one in told], axis=0)
    if len(values) < FEWEST:
        return values[:0]
    enough = count[:-1] >= max(LEAST, ODD * np.quantile(count, USUAL))
    often = np.flatnonzero(enough & (values[:-1] > FAINT * np.median(value[value > 0.0])))
    odds = np.array([_log_chance(values, count, int(k)) for k in often])
    rare = often[odds < np.log(CHANCE / len(values))] if len(often) else often
    return values[rare[np.argsort(-count[rare], kind="stable")][:MOST]]


def _either_way(at: np.ndarray) -> np.ndarray:
    """Places (n, 4) as whole numbers, the same for reciprocal twins."""
    back = at.copy()
    sine = np.sin(at[:, 0]) / np.maximum(np.hypot(at[:, 1], at[:, 2]), 1e-12)
    back[:, 0], back[:, 3] = np.arccos(np.clip(at[:, 3], -1.0, 1.0)), np.cos(at[:, 0])
    back[:, 1:3] *= sine[:, None]
    return numbered(np.where((at[:, :1] < back[:, :1]), at, back))


def _surfaces_own(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles between light and camera, and of the half vector with the normal, of places (n, 4), as whole numbers
    (n, 1): surfaces are the same wherever one of them is, to the last digit if a model has been written out."""
    cosine, level = np.cos(at[:, 0]), at[:, 3]
    phase = cosine * level + np.sin(at[:, 0]) * at[:, 1]
    half = (cosine + level) / np.sqrt(np.maximum(2.0 + 2.0 * phase, 1e-12))
    angles = (np.arccos(np.clip(one, -1.0, 1.0))[:, None] for one in (phase, half))
    first, second = (np.rint(one / ALIKE) for one in angles)
    return first, second


def _log_chance(values: np.ndarray, count: np.ndarray, k: int) -> float:
    """The logarithm of the odds of Poisson that value ``k``, given that it comes at all, comes as often as it does or
    more often, by how many rows have values near and how many such values the digits allow."""
    low, high = max(k - BESIDE, 0), min(k + BESIDE + 1, len(values))
    gaps = np.diff(values[low:high])
    others = np.delete(count[low:high], k - low)
    usual = np.minimum(others, 2 * np.median(others))  # those of a second such value are none
    steps = max((values[high - 1] - values[low]) / gaps.min(), 1.0)
    expected = float(usual.sum()) / steps
    more = count[k]
    if more <= expected:
        return 0.0
    at_all = np.log(-np.expm1(-expected))
    return float(more * np.log(expected) - expected - gammaln(more + 1) - at_all)


def stands_still(
    at: np.ndarray, value: np.ndarray, others: np.ndarray, rows: np.ndarray, relative: float, *, among: bool
) -> bool:
    """Whether ``rows``, all of one suspected value, are none of the surface's, by ``others``; ``relative`` is the noise
    over the value, and most rows of a plateau do not stand ``among`` others."""
    mark = float(value[rows[0]])
    noise, step = relative * mark, _step(value, mark)
    jump = max(NOISE * noise, STEPS * step, SMALL * mark)
    asked, around = _evenly(rows, ASKED), _evenly(others, TOLD)
    near = cKDTree(at[around]).query(at[asked], k=[*range(1, min(NEAREST, len(around)) + 1)])[1]
    beside = value[around[near]]
    apart = np.abs(np.median(beside, axis=1) - mark)
    off, most = float(np.median(apart)), float(np.quantile(apart, HARMED))
    noisy = noise > max(WIDER * step, LEAST_NOISE * mark)
    run = len(rows) > RUN * (rows.max() - rows.min() + 1) and len(rows) < FEW * len(value)
    # most of a surface may be as bright as it is
    if noisy and most > jump and len(rows) >= STUCK and (among or run):
        return True
    if among and off > max(0.5 * jump, SMALL * mark) and (noisy or off > FAR_STEPS * step):
        return True
    below, clearly = ((value[others] < mark - by).sum() for by in (WIDER * step, jump))
    if clearly < BELOW and below < SOME * len(value):
        above = np.sort(value[others])[BELOW - 1]
        few = noisy or len(rows) < SHARE * len(value)
        return bool(few and len(rows) >= STUCK and above > mark + jump)
    if noisy or len(rows) < STUCK:
        return bool(noisy and off > max(noise, HARMLESS * mark))
    low, high = beside.min(1), beside.max(1)
    slack = RANGE * (high - low) + jump
    up, down = int((mark > high + slack).sum()), int((mark < low - slack).sum())
    return (among or min(up, down) >= FEWEST_JUMPS) and up + down >= JUMPS * len(asked)


def _evenly(rows: np.ndarray, most: int) -> np.ndarray:
    """At most so many of ``rows``."""
    return rows[:: 1 + (len(rows) - 1) // most]


def _step(value: np.ndarray, mark: float) -> float:
    """The step of the digits of values near ``mark``."""
    values = np.unique(value[value > 0.0])
    k = int(np.searchsorted(values, mark))
    return float(np.diff(values[max(k - BESIDE, 0) : k + BESIDE + 1]).min())
