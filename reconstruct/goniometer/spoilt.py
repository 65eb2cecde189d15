"""Rows that hold a number and are no measurement: where the detector hid the lamp, and marks of missing values.

A value is suspected by what it is (zero, repeated exactly, far from all others), and judged by what its neighbours say,
never by itself: a dark surface has true zeros, noise falls below zero, a peak is far from all others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from photogonio.reconstruct.goniometer.stuck import WIDER, stands_still, stuck_suspects
from photogonio.reconstruct.goniometer.suspects import (
    APART,
    FAINT,
    FEWEST,
    SHARE,
    STUCK,
    far_off,
    is_mark,
    sure_of,
    suspects,
)
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples
from photogonio.reconstruct.table.neighbours import Expected, expected, numbered, places

JUDGED = 500  # rows of a kind that are looked at
MOST = 0.6  # of those, that must contradict what their neighbours say
SURE = 8.0  # standard deviations of the noise
QUIET = 0.15  # of the rows are where nothing but noise spoils a local fit
STEPS = (
    3.0  # steps of the table's digits, or standard deviations of its noise about zero, that may read as zero
)
CUT_OFF = 10.0  # of such steps, below which a surface may have its last digits
DECAYED = 0.5  # of the least value around zeros: there values have fallen below what is told from zero
ZERO = 1e-9  # of the middle value
DARK, GAP = 0.02, 5.0  # of the middle value, and how far below the next the noise of a covered detector is
NEAR_LAMP = np.radians(30.0)  # the widest that a detector hides
OFF = 1.3  # factor that such a value must lie from what neighbours say, and
UNLIKE = 4.0  # standard errors of that
IMPOSSIBLE = 1e6  # factor between a value and what neighbours say that no peak has
PEAK = np.radians(15.0)  # half angle within which large values may be a peak
CLOSE, ALONE = (
    9,
    0.6,
)  # nearest rows, itself among them, and the share of good ones about a zero that stands alone
MIXED = 0.7  # likewise of rows that are many, over what chance would leave beside them
FADING = 0.2  # share of zeros beside low values, which then are a surface's last digits
BELOW = 0.3  # of what neighbours say: so far below zero no noise leads that leaves these alike
STILL, TURNED = "the instrument stood still", "their sign is wrong"
ALONE_OFF = "as after a slip of the decimal point"
LINKED = 20  # nearest rows that a zero hangs together with


@dataclass(frozen=True, slots=True)
class SpoiltRows:
    """Rows of one kind that are no measurements."""

    rows: np.ndarray  # (m,) ascending
    channel: int
    mark: float  # the value that they hold
    instead: float  # 1/sr: what neighbours say, in the middle
    lamp: float | None  # radians from the lamp's direction, within which all are; None: elsewhere
    why: str = "a mark of a missing value"  # unless it is zero


def find_spoilt(samples: GoniometerSamples) -> list[SpoiltRows]:
    """Kinds of rows that are no measurements; a row may be in several."""
    at, found = places(samples.theta_i, samples.theta_r, samples.phi_r - samples.phi_i), []
    tree = cache(lambda: cKDTree(at))  # of few tables it is asked
    for channel, value in enumerate(samples.value.T):
        found += _of_channel(samples, at, tree, value, channel)
    return found


def _of_channel(
    samples, at: np.ndarray, tree: Callable[[], cKDTree], value: np.ndarray, channel: int
) -> list[SpoiltRows]:
    size = np.abs(value[value != 0.0])
    if not len(size):
        return []
    marks, still = suspects(at, value), stuck_suspects(at, value)
    nothing = _nothing(size)
    zero = np.abs(value) <= nothing
    good = ~np.isin(value, marks) & ~zero & (value > 0.0)
    if good.sum() < FEWEST:
        return []
    low, high = far_off(at, np.where(zero, 0.0, value), good | zero)
    if not (zero.any() or len(marks) or len(still) or len(low) or len(high) or (value < 0).any()):
        return []
    known = _Known.of(at, tree(), value, good, marks)
    found = []
    for mark in marks:
        rows = np.flatnonzero(value == mark)
        one = _marked(samples, known, rows, float(mark), channel)
        found += [] if one is None else [one]
    found += _still(known, still[~np.isin(still, [one.mark for one in found])], channel)
    found += _alone(samples, known, np.setdiff1d(low, _rows(found)), channel)
    found += _alone(samples, known, _off_peaks(samples, np.setdiff1d(high, _rows(found))), channel)
    out = _rows(found)
    found += _below_zero(known, np.setdiff1d(np.flatnonzero(value < -nothing), out), channel)
    hidden = np.setdiff1d(np.flatnonzero(zero), out)
    return found + _zeros(samples, known, hidden, channel)


def _rows(found: list[SpoiltRows]) -> np.ndarray:
    """All rows of some kinds."""
    return np.concatenate([one.rows for one in found]) if found else np.empty(0, int)


def _off_peaks(samples: GoniometerSamples, rows: np.ndarray) -> np.ndarray:
    """Those of the rows that are near neither the mirror direction nor the light's own."""
    return rows[(half_angle(samples, rows) > PEAK) & (lamp_angle(samples, rows) > PEAK)]


def _alone(samples: GoniometerSamples, known: _Known, rows: np.ndarray, channel: int) -> list[SpoiltRows]:
    """Single rows far off all around them, each with a value of its own."""
    if not 0 < len(rows) <= SHARE * len(known.value):
        return []
    others = known.good.copy()
    others[rows] = False
    value, told = known.value[rows], expected(known.at[others], known.value[others], known.at[rows])
    out = sure_of(value, told, known.relative, known.noise(told.value))
    out &= told.value > FAINT * float(np.mean(known.value[others]))
    if not out.any():
        return []
    mark, instead = float(np.median(value[out])), float(np.median(told.value[out]))
    return [SpoiltRows(rows[out], channel, mark, instead, None, ALONE_OFF)]


def _nothing(size: np.ndarray) -> float:
    """Up to which of the sizes above zero (m,) a value is as good as zero: a detector that is covered reads its own
    noise, and none of the surface's values is near."""
    middle, size = float(np.median(size)), np.sort(size)
    dark = int(np.searchsorted(size, DARK * middle))
    gaps = np.flatnonzero(size[1 : dark + 1] >= GAP * size[:dark]) if dark < len(size) else size[:0]
    return max(ZERO * middle, float(size[int(gaps[-1])]) if len(gaps) else 0.0)


@dataclass(frozen=True, slots=True)
class _Known:
    """The rows that others are judged by, and their noise."""

    at: np.ndarray  # (n, 4) of all rows
    tree: cKDTree  # of them
    value: np.ndarray  # (n,) of all rows
    good: np.ndarray  # (n,) bool
    sound: cKDTree  # of those
    relative: float  # noise of bright rows, over their value
    constant: float  # noise of dim rows, 1/sr
    step: float  # 1/sr: the digits' step, and the noise that values below zero show

    @classmethod
    def of(
        cls, at: np.ndarray, tree: cKDTree, value: np.ndarray, good: np.ndarray, marks: np.ndarray
    ) -> _Known:
        rows, sound = np.flatnonzero(good), cKDTree(at[good])
        rows = rows[:: max(len(rows) // JUDGED, 1)]
        told = expected(at[good], value[good], at[rows], own=True, tree=sound)
        bright = told.value >= np.median(told.value)
        relative = float(np.quantile(told.spread[bright], QUIET))
        constant = float(np.quantile((told.spread * told.value)[~bright], QUIET)) if (~bright).any() else 0.0
        below = -value[(value < 0.0) & ~np.isin(value, marks)]
        noise = float(np.median(below)) / 0.6745 if len(below) else 0.0
        return cls(at, tree, value, good, sound, relative, constant, max(_step(value[good]), noise))

    def expected(self, rows: np.ndarray) -> Expected:
        return expected(self.at[self.good], self.value[self.good], self.at[rows], tree=self.sound)

    def noise(self, value: np.ndarray) -> np.ndarray:
        """(q,) 1/sr, of readings of ``value``."""
        return np.maximum(np.hypot(self.relative * value, min(self.constant, 1e300)), self.step)


def _step(value: np.ndarray) -> float:
    """The step of the digits of values (n,): what all differences are multiples of; about 0 where none is."""
    gaps = np.diff(np.unique(value))
    return float(gaps.min()) if len(gaps) else 0.0


def _some(rows: np.ndarray) -> np.ndarray:
    return rows[:: max(len(rows) // JUDGED, 1)]


def _marked(samples, known: _Known, rows: np.ndarray, mark: float, channel: int) -> SpoiltRows | None:
    """The rows that hold a suspected mark, if they are no measurements."""
    some = _some(rows)
    told = known.expected(some)
    if mark < 0.0:
        wrong = (-mark > SURE * known.noise(told.value)) & (-mark > SURE * known.step)
        wrong |= (told.least > STEPS * known.step) & (told.value - mark > SURE * known.noise(told.value))
    else:
        apart = np.log(mark) - np.log(told.value)
        off = np.abs(apart) > np.maximum(UNLIKE * told.spread, np.log(OFF))
        peaks = np.mean(half_angle(samples, some) <= PEAK) > 1.0 - MOST and np.median(apart) > 0.0
        if off.mean() > MOST and not peaks and _scattered(known, rows):
            return SpoiltRows(rows, channel, mark, float(np.median(told.value)), None)
        if np.median(apart) < 0.0:
            return _too_low(known, rows, mark, channel, told)
        wrong = apart > np.maximum(SURE * told.spread, np.log(APART))
        elsewhere = np.mean(half_angle(samples, some) > PEAK)
        written = bool(is_mark(np.array([mark]))[0]) and mark != 1.0
        if not (written or elsewhere > 1.0 - MOST or np.median(apart) > np.log(IMPOSSIBLE)):
            return None
    if wrong.mean() < MOST:
        return None
    return SpoiltRows(rows, channel, mark, float(np.median(told.value)), None)


def _below_zero(known: _Known, rows: np.ndarray, channel: int) -> list[SpoiltRows]:
    """Rows far below zero, each with a value of its own, where neighbours agree on one above: a sign is wrong."""
    if not len(rows):
        return []
    told = known.expected(rows)
    wrong = np.minimum(-known.value[rows], told.least) > BELOW * told.value
    if wrong.mean() < MOST:
        return []
    mark, instead = (float(np.median(one[wrong])) for one in (known.value[rows], told.value))
    return [SpoiltRows(rows[wrong], channel, mark, instead, None, TURNED)]


def _still(known: _Known, marks: np.ndarray, channel: int) -> list[SpoiltRows]:
    """Rows of values at which the instrument stood still."""
    left, found = known.good | (known.value <= 0.0), []
    for mark in marks:
        rows, others = np.flatnonzero(known.value == mark), np.flatnonzero(left & (known.value != mark))
        good = known.good & left & (known.value != mark)
        among, noise = _scattered(known, rows), known.relative
        if good.sum() < FEWEST or not stands_still(known.at, known.value, others, rows, noise, among=among):
            continue
        told = expected(known.at[good], known.value[good], known.at[_some(rows)])
        found.append(SpoiltRows(rows, channel, float(mark), float(np.median(told.value)), None, STILL))
        left[rows] = False
    return found


def _scattered(known: _Known, rows: np.ndarray) -> bool:
    """Whether rows are of several pairs of directions and most stand among others, as far as these are as many; a
    surface's own values do not."""
    once = np.unique(numbered(known.at[rows]), axis=0, return_index=True)[1]
    if len(once) < STUCK:
        return False
    least = ALONE
    if known.relative * abs(known.value[rows[0]]) > WIDER * known.step:  # no digits make values alike
        chance = 1.0 - len(rows) / len(known.value)  # of a row beside these to be none of them
        least = min(ALONE, MIXED * chance)
    return float(np.median(_share_beside(known, _some(rows[once]), known.good))) > least


def _fading(known: _Known, rows: np.ndarray, mark: float) -> bool:
    """Whether zeros are among the nearest other pairs of directions, as where a gloss has its last digits."""
    other = np.flatnonzero(known.value != mark)
    other = other[np.unique(numbered(known.at[other]), axis=0, return_index=True)[1]]
    _, near = cKDTree(known.at[other]).query(known.at[_some(rows)], k=min(CLOSE, len(other)))
    zero = (known.value[other] <= 0.0)[near.reshape(-1, min(CLOSE, len(other)))]
    return float(np.median(zero.mean(1))) > FADING


def _share_beside(known: _Known, rows: np.ndarray, which: np.ndarray) -> np.ndarray:
    """(m,) how many of the rows nearest to each are among ``which`` (n,) bool."""
    _, near = known.tree.query(known.at[rows], k=min(CLOSE, len(known.at)))
    return which[near.reshape(len(rows), -1)].mean(1)


def _too_low(known: _Known, rows: np.ndarray, mark: float, channel: int, told: Expected) -> SpoiltRows | None:
    """Rows that hold a value far below what their neighbours say, as zeros would, where values had not fallen to it."""
    steps = STEPS if mark > STEPS * known.step else CUT_OFF
    least = max(APART * mark, mark + steps * known.step)
    above, straight = told.least > least, told.straight - 3.0 * told.rough > least
    sure = told.value - mark > SURE * known.noise(told.value)
    wrong = above & sure & (straight | (told.spread < 0.1))
    if wrong.mean() < MOST or _decayed(known, rows, told) or _fading(known, rows, mark):
        return None
    return SpoiltRows(rows, channel, mark, float(np.median(told.value)), None)


def _zeros(samples, known: _Known, rows: np.ndarray, channel: int) -> list[SpoiltRows]:
    """Zeros that are none: all that hang together, if their neighbours contradict most, or those of them that stand
    among others; and whatever surrounds the lamp's direction, and nothing else."""
    found = [_of_cluster(known, cluster) for cluster in _clusters(known, rows)]
    if not found:
        return []
    out = np.sort(np.concatenate(found))
    if len(out) < len(rows) and (_mostly_wrong(known, rows) or _around_lamp(samples, known, rows)):
        out = rows
    if not len(out):
        return []
    told, angle = known.expected(_some(out)), lamp_angle(samples, out)
    lamp = float(angle.max()) if _hides_lamp(samples, known, angle) else None
    return [SpoiltRows(out, channel, 0.0, float(np.median(told.value)), lamp)]


def _of_cluster(known: _Known, cluster: np.ndarray) -> np.ndarray:
    """Those rows of a cluster that are no zeros: all, some or none."""
    if len(cluster) > known.good.sum():
        return cluster[:0]
    some = _some(cluster)
    told = known.expected(some)
    wrong = _contradicted(known, told)
    if wrong.mean() >= MOST and not _decayed(known, cluster, told):
        return cluster
    if len(some) < len(cluster):
        return cluster[:0]
    return cluster[wrong & (_share_beside(known, cluster, known.good) > ALONE)]


def _mostly_wrong(known: _Known, rows: np.ndarray) -> bool:
    """Whether most zeros are contradicted, so that the others, of which neighbours know too little, are none either."""
    wrong = _contradicted(known, known.expected(_some(rows))).mean() >= MOST
    return bool(wrong) and len(rows) <= known.good.sum()


def _around_lamp(samples, known: _Known, rows: np.ndarray) -> bool:
    """Whether zeros surround the lamp's direction at more than one incidence, and nothing else, where values had not
    faded before."""
    angle = lamp_angle(samples, rows)
    if np.ptp(samples.theta_i[rows]) < PEAK or not _hides_lamp(samples, known, angle):
        return False
    told = known.expected(_some(rows))
    return float(np.median(told.value)) > STEPS * known.step and not _decayed(known, rows, told)


def _contradicted(known: _Known, told: Expected) -> np.ndarray:
    """(q,) bool: a zero there is none, whether values run straight or fall by equal factors."""
    above = told.least > STEPS * known.step
    sure = told.value > SURE * known.noise(told.value)
    straight = told.straight - 3.0 * told.rough > 0.0
    return above & sure & (straight | (told.spread < 0.1))


def _decayed(known: _Known, cluster: np.ndarray, told: Expected) -> bool:
    """Whether values fall, toward these zeros, below the least that is told from zero around them."""
    good = np.flatnonzero(known.good)
    _, near = known.sound.query(known.at[_some(cluster)], k=min(4, len(good)))
    least = float(known.value[good[np.unique(near)]].min())
    return float(np.median(told.value)) < DECAYED * least


def _clusters(known: _Known, rows: np.ndarray) -> list[np.ndarray]:
    """Rows that are among the nearest of one another, of all."""
    if not len(rows):
        return []
    at = known.at
    _, near = known.tree.query(at[rows], k=min(LINKED, len(at)))
    number = np.full(len(at), -1)
    number[rows] = np.arange(len(rows))
    other = number[near.reshape(len(rows), -1)]
    first = np.repeat(np.arange(len(rows)), other.shape[1])
    linked = other.ravel() >= 0
    graph = coo_matrix(
        (np.ones(linked.sum()), (first[linked], other.ravel()[linked])), shape=(len(rows), len(rows))
    )
    count, label = connected_components(graph, directed=False)
    return [rows[label == k] for k in range(count)] if count < 200 else [rows]


def _hides_lamp(samples, known: _Known, angle: np.ndarray) -> bool:
    """Whether hardly a row is bright between such angles (m,) from the lamp and the lamp itself."""
    widest = float(angle.max())
    inside = lamp_angle(samples, np.flatnonzero(known.good)) < 0.85 * widest
    return widest < NEAR_LAMP and inside.sum() <= 0.1 * len(angle)


def lamp_angle(samples: GoniometerSamples, rows: np.ndarray) -> np.ndarray:
    """(m,) radians between the directions of a pair."""
    cosine = np.einsum("ij,ij->i", samples.incident[rows], samples.exit[rows])
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def half_angle(samples: GoniometerSamples, rows: np.ndarray) -> np.ndarray:
    """(m,) radians between the normal and the direction half-way between those of a pair."""
    half = samples.incident[rows] + samples.exit[rows]
    return np.arccos(np.clip(half[:, 2] / np.maximum(np.linalg.norm(half, axis=1), 1e-12), -1.0, 1.0))


def without(samples: GoniometerSamples, spoilt: list[SpoiltRows]) -> np.ndarray:
    """(n,) bool: rows that are in no kind of ``spoilt``."""
    keep = np.ones(len(samples.value), bool)
    for one in spoilt:
        keep[one.rows] = False
    return keep
