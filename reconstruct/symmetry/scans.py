"""Scans whose readings all have a factor of their own: another gain, filter or lamp than that of the other scans.

A scan is what was read at one incidence. Its rows are predicted by all other rows and their reciprocal twins: a surface
changes with incidence, but no surface makes every reading of one incidence the same multiple of what its neighbours and
the exchanged pairs say, and none of another. Nor does a surface know which rows were read one after another: where
those lie among all others, a run of lines that are off by one factor tells of an instrument that changed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from photogonio.capture.robust import scatter
from photogonio.reconstruct.table.neighbours import expected, places

STEP = np.radians(0.25)  # within which incidences are one
ROWS = 12  # of a scan, at least
SCANS = 4  # of a table, at least
MOST_ROWS = 4000  # evenly taken of more
MOST = 40  # scans that are looked at
FACTOR = np.log(1.3)  # of a scan, that is doubtful
CERTAIN = 2.5  # times how far the scan's own rows lie from that factor,
LINES, LONGEST = 8, 0.4  # of a run, at least, and at most of all rows
LONG = 1.25  # times as long as the one before is each run that is tried
SURE = 10.0  # standard errors of a run's mean, of rows that are off each by its own
AMONG = 0.7  # of the rows nearest to those of a run, that are no part of it
NEAREST = 8  # rows
APART = 3.0  # and what any scan's factor is after the one is mended


@dataclass(frozen=True, slots=True)
class ScanOff:
    """A scan that is off by a factor."""

    incidence: float  # radians
    factor: float  # of what the other scans say
    error: float  # standard deviation of the logarithm of one row's factor
    count: int  # rows


def scan_off(theta_i: np.ndarray, theta_r: np.ndarray, dphi: np.ndarray, value: np.ndarray) -> ScanOff | None:
    """The one scan that is off, if there is one; angles (n,) in radians, ``value`` (n,) 1/sr."""
    good = value > 0.0
    theta_i, theta_r, dphi, value = (column[good] for column in (theta_i, theta_r, dphi, value))
    some = slice(None, None, 1 + len(value) // MOST_ROWS)
    theta_i, theta_r, dphi, value = (column[some] for column in (theta_i, theta_r, dphi, value))
    scan = np.unique(np.rint(theta_i / STEP), return_inverse=True)[1].ravel()
    count = np.bincount(scan, minlength=1)
    if not SCANS <= (count >= ROWS).sum() <= MOST or count[count < ROWS].sum() > 0.1 * len(value):
        return None
    scans = np.flatnonzero(count >= ROWS)
    pairs = places(theta_i, theta_r, dphi), places(theta_r, theta_i, dphi)
    middle, error = _factors(pairs, value, scan, scans)
    worst = int(np.argmax(np.abs(middle)))
    if abs(middle[worst]) < max(FACTOR, CERTAIN * error[worst]):
        return None
    own = scan == scans[worst]
    mended = np.where(own, value * np.exp(-middle[worst]), value)
    left, _ = _factors(pairs, mended, scan, scans)
    if np.abs(left).max() > abs(middle[worst]) / APART:
        return None
    factor = float(np.exp(middle[worst]))
    return ScanOff(float(np.mean(theta_i[own])), factor, float(error[worst]), int(own.sum()))


@dataclass(frozen=True, slots=True)
class RunOff:
    """Rows one after another that are off by a factor."""

    first: int
    count: int
    factor: float  # of what the rows around them say
    error: float  # standard deviation of the logarithm of one row's factor


def run_off(theta_i: np.ndarray, theta_r: np.ndarray, dphi: np.ndarray, value: np.ndarray) -> RunOff | None:
    """The one run of rows (n,), in the order they were written in, that is off, if there is one; only where rows of a
    run lie among others. Angles in radians, ``value`` in 1/sr."""
    rows = np.flatnonzero(value > 0.0)
    if not SCANS * ROWS <= len(rows) <= MOST_ROWS:
        return None
    at = places(theta_i[rows], theta_r[rows], dphi[rows])
    near = cKDTree(at).query(at, k=NEAREST + 1)[1][:, 1:]
    beside = np.abs(near - np.arange(len(rows))[:, None]) < LINES
    if beside.mean() > 1.0 - AMONG:  # lines beside one another are places beside one another
        return None
    ratio = np.log(value[rows]) - np.log(expected(at, value[rows], at, own=True).value)
    ratio -= np.median(ratio)
    typical = scatter(ratio)
    if not typical > 0.0:
        return None
    sums = np.r_[0.0, np.cumsum(np.clip(ratio, -NEAREST * typical, NEAREST * typical))]
    best, length = (0.0, 0, 0), LINES
    while length <= LONGEST * len(rows):
        mean = (sums[length:] - sums[:-length]) / length
        k = int(np.argmax(np.abs(mean)))
        best = max(best, (abs(float(mean[k])) * np.sqrt(length) / typical, k, length))
        length = max(int(LONG * length), length + 1)
    sure, first, count = best
    own = np.zeros(len(rows), bool)
    own[first : first + count] = True
    if sure < SURE or np.mean(~own[near[own]]) < AMONG:
        return None
    middle, error = float(np.median(ratio[own])), scatter(ratio[own])
    if abs(middle) < max(FACTOR, CERTAIN * error):
        return None
    return RunOff(int(rows[first]), count, float(np.exp(middle)), float(error))


def _factors(
    pairs: tuple[np.ndarray, np.ndarray], value: np.ndarray, scan: np.ndarray, scans: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Logarithms (s,) of the middle factor of each of some scans over what the other rows say, and the deviation (s,)
    of a row from it; ``pairs`` (n, 4) are the places of rows and of their reciprocal twins."""
    found = []
    for k in scans:
        rest = scan != k
        told = expected(
            np.concatenate([one[rest] for one in pairs]), np.tile(value[rest], 2), pairs[0][~rest]
        )
        ratio = np.log(value[~rest]) - np.log(told.value)
        found.append((np.median(ratio), scatter(ratio)))
    middle, error = np.array(found).T
    return middle, error
