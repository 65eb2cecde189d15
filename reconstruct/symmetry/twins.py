"""Reciprocity without a model: readings at a pair of directions against those at the exchanged pair.

Helmholtz reciprocity says f(i, r) = f(r, i); of an isotropic surface without handedness mirrored pairs (dphi, -dphi)
agree as well, and how far readings of those differ is the noise by which exchanged ones are judged. Where no mirrored
pair was read twice, local fits of neighbouring readings tell the noise; where no exchanged pair was read, they tell
what it would have been, if less surely.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import chdtrc

from photogonio.reconstruct.table.neighbours import expected, places

SAME = np.radians(0.3)  # between pairs that are the same
FAR = np.radians(3.0)  # between incidence and exit: nearer pairs are all but their own twins
CLOSE = np.radians(6.0)  # from an exchanged pair to the nearest reading, where neighbours may tell it
FEWEST = 8  # exchanged pairs
MATTERS = 0.03  # rms of the logarithm of f by which exchange must matter: an error of an angle looks the same
WOULD_SHOW = 0.05  # rms that must have shown, where reciprocity is said to have held
CHANCE = 1e-6  # of twins as far apart by their noise alone, which is
DOUBLED = 1.5  # times as large as it was found
SHARE = 0.25  # of the twins that must be apart by more than noise: a few rows prove nothing
PEAKED, FAR_APART = (
    0.08,
    4.0,
)  # or so many by so many standard errors, as where a gloss alone is not reciprocal
QUIET = 0.15  # of the rows are where nothing but noise spoils a local fit
LEAST_NOISE = 1e-3  # of a reading
SMOOTH = 0.1  # relative misfit of neighbours that may stand for a twin,
EXPLAINED = 0.3  # and what a cosine leaves of the squares where such show that reciprocity is broken
FAINT = 20.0  # steps of the digits
MOST_ROWS = 20000
HELD, BROKEN, UNTOLD = "held", "broken", "cannot be told"


@dataclass(frozen=True, slots=True)
class Twins:
    """What exchanged pairs say."""

    verdict: str  # HELD, BROKEN or UNTOLD
    count: int = 0  # exchanged pairs that were compared
    apart: float = 0.0  # rms of the logarithm of the ratio of twins, beyond the noise
    noise: float = 0.0  # rms standard error of that logarithm
    cosine: float = 0.0  # power of cos(theta_r) / cos(theta_i) that the ratios follow
    cosine_error: float = np.inf
    left: float = 1.0  # of the squared logarithms, what such a power leaves

    @property
    def reason(self) -> str:
        """In words."""
        if self.verdict == UNTOLD:
            return (
                f"{self.count} exchanged pairs do not tell" if self.count else "no exchanged pairs were read"
            )
        return (
            f"{self.count} exchanged pairs differ by {self.apart:.1%} beyond their noise of {self.noise:.1%}"
            if self.verdict == BROKEN
            else f"{self.count} exchanged pairs agree within {max(self.apart, self.noise):.1%}"
        )


def compare_twins(theta_i: np.ndarray, theta_r: np.ndarray, dphi: np.ndarray, value: np.ndarray) -> Twins:
    """Compare readings ``value`` (n,), 1/sr, with those of exchanged pairs; angles (n,) in radians."""
    seen = Readings.of(theta_i, theta_r, dphi, value)
    if len(seen.rows) < 2 * FEWEST:
        return Twins(UNTOLD)
    same = seen.exchanged()
    if len(same.rows) >= FEWEST:
        return _judged(same.ratio, same.error, theta_i[same.rows], theta_r[same.rows])
    near = seen.nearly_exchanged()
    if len(near.rows) < FEWEST:
        return Twins(UNTOLD, len(near.rows))
    found = _judged(near.ratio, near.error, theta_i[near.rows], theta_r[near.rows])
    sure = found.verdict != BROKEN or (found.left < EXPLAINED and 0.5 < abs(found.cosine) < 2.0)
    return found if sure else replace(found, verdict=UNTOLD)


@dataclass(frozen=True, slots=True)
class Exchanged:
    """Readings beside what was read with incidence and exit exchanged."""

    rows: np.ndarray  # (m,) of all readings
    later: np.ndarray  # (m,) rows that the reading comes after its twin, or after those that tell it
    ratio: np.ndarray  # (m,) logarithm of the reading over its twin
    error: np.ndarray  # (m,) standard error of it, by noise

    @classmethod
    def untold(cls, rows: np.ndarray) -> Exchanged:
        """Few ``rows`` (m,), of which nothing is said."""
        return cls(rows, 0.0 * rows, 0.0 * rows, np.ones(len(rows)))


@dataclass(frozen=True, slots=True)
class Readings:
    """Those that tell something, with their noise."""

    rows: np.ndarray  # (k,) of all readings
    theta_i: np.ndarray  # (k,) radians
    theta_r: np.ndarray  # (k,)
    value: np.ndarray  # (k,) 1/sr
    at: np.ndarray  # (k, 4) places
    back: np.ndarray  # (k, 4) of the exchanged pairs
    noise: np.ndarray  # (k,) standard error of the logarithm

    @classmethod
    def of(cls, theta_i: np.ndarray, theta_r: np.ndarray, dphi: np.ndarray, value: np.ndarray) -> Readings:
        """Of readings ``value`` (n,), 1/sr; angles (n,) in radians."""
        good = np.flatnonzero(value > 0.0)
        if len(good):
            good = good[value[good] > FAINT * _step(value[good])]
        good = good[:: 1 + len(good) // MOST_ROWS]
        theta_i, theta_r, dphi, value = (column[good] for column in (theta_i, theta_r, dphi, value))
        at, back = places(theta_i, theta_r, dphi), places(theta_r, theta_i, dphi)
        noise = reading_noise(at, value) if len(value) >= 2 * FEWEST else np.zeros(len(value))
        return cls(good, theta_i, theta_r, value, at, back, noise)

    def exchanged(self) -> Exchanged:
        """Pairs that were read both ways, each once."""
        rows = np.flatnonzero(self.theta_i - self.theta_r > FAR)
        distance, twin = cKDTree(self.at).query(self.back[rows])
        rows, twin = rows[distance < SAME], twin[distance < SAME]
        ratio, error = (
            np.log(self.value[rows] / self.value[twin]),
            np.hypot(self.noise[rows], self.noise[twin]),
        )
        return Exchanged(self.rows[rows], self.rows[rows] - self.rows[twin], ratio, error)

    def nearly_exchanged(self) -> Exchanged:
        """Readings beside what a local fit says of the exchanged pairs, where it is smooth; :data:`FEWEST` or more, or
        how many there would be."""
        rows = np.flatnonzero(np.abs(self.theta_i - self.theta_r) > FAR)
        rows = rows[cKDTree(self.at).query(self.back[rows])[0] < CLOSE]
        if len(rows) < FEWEST:
            return Exchanged.untold(self.rows[rows])
        tree = cKDTree(self.at)
        told = expected(self.at, self.value, self.back[rows], tree=tree)
        bent = np.abs(np.log(np.maximum(told.straight, 1e-300) / told.value))
        smooth = (bent < SMOOTH) & (told.spread < SMOOTH)  # elsewhere a peak is between
        rows, ratio = rows[smooth], np.log(self.value[rows] / told.value)[smooth]
        if len(rows) < FEWEST:
            return Exchanged.untold(self.rows[rows])
        share = self.rows / max(int(self.rows.max()), 1)
        line = np.log(expected(self.at, np.exp(share), self.back[rows], tree=tree).value)
        later = (share[rows] - line) * self.rows.max()
        error = np.hypot(told.spread[smooth], self.noise[rows])
        return Exchanged(self.rows[rows], later, ratio, error)


def _step(value: np.ndarray) -> float:
    """The step of the digits of values (n,): of readings that are few steps the logarithm means little."""
    gaps = np.diff(np.unique(value))
    return float(gaps.min()) if len(gaps) else 0.0


def reading_noise(at: np.ndarray, value: np.ndarray) -> np.ndarray:
    """(n,) standard errors of the logarithms of readings ``value`` (n,) at places (n, 4): a share of the value and a
    constant, by mirrored and repeated readings, or where there are few by local fits."""
    distance, near = cKDTree(at).query(at, k=2)
    itself = near[:, 1] == np.arange(len(at))  # of places that are exactly alike either comes first
    other = np.where(itself, near[:, 0], near[:, 1])
    again = distance[:, 1] < SAME
    if again.sum() >= FEWEST:
        apart = np.abs(value - value[other])[again] / (0.6745 * np.sqrt(2.0))
        size, quantile = 0.5 * (value + value[other])[again], 0.5
    else:
        told = expected(at, value, at, own=True)
        apart, size, quantile = told.spread * told.value, told.value, QUIET
    bright = size >= np.median(size)
    share = np.quantile(apart[bright] / size[bright], quantile)
    constant = np.quantile(apart[~bright], quantile) if (~bright).any() else 0.0
    return np.hypot(np.maximum(share, LEAST_NOISE), (constant + 0.3 * _step(value)) / value)


def _judged(ratio: np.ndarray, error: np.ndarray, theta_i: np.ndarray, theta_r: np.ndarray) -> Twins:
    """The verdict on logarithms of ratios (m,) with standard errors (m,) of readings at the angles (m,) to their
    twins."""
    count = len(ratio)
    noise = float(np.sqrt(np.mean(error**2)))
    excess = float(np.mean(ratio**2) - noise**2)
    apart = np.sqrt(max(excess, 0.0))
    z = np.abs(ratio / error) / DOUBLED
    power = np.log(np.cos(theta_r) / np.cos(theta_i))
    weight = 1.0 / (error**2 + LEAST_NOISE**2)
    square = max(float(np.sum(weight * power**2)), 1e-300)
    slope = float(np.sum(weight * power * ratio)) / square
    rest = float(np.sum(weight * (ratio - slope * power) ** 2))
    left = rest / max(float(np.sum(weight * ratio**2)), 1e-300)
    slope_error = np.sqrt(max(rest / count, 1.0) / square)
    verdict = UNTOLD
    many = np.mean(z > 2.0) >= SHARE or np.sum(z > FAR_APART) >= max(PEAKED * count, FEWEST)
    if apart >= MATTERS and chdtrc(count, np.sum(z**2)) < CHANCE and many:
        verdict = BROKEN
    elif apart < MATTERS and 3.0 * noise**2 * np.sqrt(2.0 / count) < WOULD_SHOW**2:
        verdict = HELD
    return Twins(verdict, count, float(apart), noise, slope, float(slope_error), left)
