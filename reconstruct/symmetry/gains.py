"""Exchanged pairs of directions that differ as a change of gain has it: at an angle, or from line to line.

Reciprocity says that both readings of such a pair are alike. Where they are not, a surface is rarely to blame, and its
pairs differ each by its own. What an instrument does wrong differs by what it knows: readings beyond an angle of exit,
where a stop or the sample's edge cuts the beam off, or another filter was put in; or readings one after another, as a
lamp fades. If nearly all of the difference, down to the noise, goes with one such thing, that is the cause.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.symmetry.twins import FEWEST, LEAST_NOISE, Exchanged, Readings

# of the squared differences, by what neighbours say and, where these are few, by twins: thirty CUReT materials leave
# 0.19 and 0.10
LEFT_NEAR, LEFT = 0.12, 0.06
# or, by what neighbours say, no more squared standard errors a pair than noise leaves: CUReT then leaves 0.29 and more
LEFT_BY_NOISE, NOISE = 0.2, 1.5
NEAR = 40  # pairs of which neighbours tell
TELLS = 60.0  # by which their sum must fall
FACTOR = float(np.log(1.1))  # between readings on either side of an angle, or at either end
STEPS = np.radians(np.arange(12.5, 80.0, 1.25))  # angles of exit that are tried
SHARE = 0.1  # of the pairs, that must be on either side of the angle, and on the same
SPREAD = 0.1  # of the lines between twins, that they must vary by


@dataclass(frozen=True, slots=True)
class GainChange:
    """What nearly all of the difference of exchanged pairs goes with."""

    factor: float  # of readings at exit angles beyond one, or at the table's end beside its beginning
    beyond: float | None  # radians; None: it goes from line to line
    count: int  # exchanged pairs
    apart: float  # rms of the logarithm of their ratios
    left: float  # of its square


def gain_of(
    theta_i: np.ndarray, theta_r: np.ndarray, dphi: np.ndarray, value: np.ndarray
) -> GainChange | None:
    """The one change of gain that explains how exchanged pairs differ, if there is one; angles (n,) in radians,
    ``value`` (n,) 1/sr, of rows in the order that they were written in."""
    seen = Readings.of(theta_i, theta_r, dphi, value)
    if len(seen.rows) < 2 * FEWEST:
        return None
    pairs, most = seen.nearly_exchanged(), LEFT_NEAR
    if len(pairs.rows) < NEAR:
        pairs, most = seen.exchanged(), LEFT
    if len(pairs.rows) < FEWEST:
        return None
    told = (_by_angle(pairs, theta_i, theta_r, most), _by_line(pairs, len(value), most))
    return min((one for one in told if one is not None), key=lambda one: one.left, default=None)


def _by_angle(pairs: Exchanged, theta_i: np.ndarray, theta_r: np.ndarray, least: float) -> GainChange | None:
    """Readings beyond an angle of exit: what stands on its other side after the exchange is seen."""
    tried = []
    for angle in STEPS:
        beyond = (theta_r[pairs.rows] > angle).astype(float) - (theta_i[pairs.rows] > angle)
        if SHARE <= np.mean(beyond != 0.0) <= 1.0 - SHARE:
            tried.append((*_line(pairs, beyond), float(angle)))
    if not tried:
        return None
    left, slope, _ = min(tried)
    alike = [angle for one, _, angle in tried if one <= left + 1e-9]  # between two angles of a grid
    return _told(pairs, left, slope, least, float(np.mean(alike)))


def _by_line(pairs: Exchanged, lines: int, least: float) -> GainChange | None:
    """Readings that grow from line to line."""
    apart = pairs.later / lines
    if np.std(apart) < SPREAD * np.max(np.abs(apart)):  # the same angles again, which anything tells
        return None
    left, slope = _line(pairs, apart)
    return _told(pairs, left, slope, least, None)


def _line(pairs: Exchanged, by: np.ndarray) -> tuple[float, float]:
    """Of the squared logarithms what their line through 0 over ``by`` (m,) leaves, and its slope."""
    weight = 1.0 / (pairs.error**2 + LEAST_NOISE**2)
    slope = float(np.sum(weight * by * pairs.ratio) / max(np.sum(weight * by**2), 1e-300))
    rest = np.sum(weight * (pairs.ratio - slope * by) ** 2)
    return float(rest / max(np.sum(weight * pairs.ratio**2), 1e-300)), slope


def _told(
    pairs: Exchanged, left: float, slope: float, least: float, beyond: float | None
) -> GainChange | None:
    squares = float(np.sum(pairs.ratio**2 / (pairs.error**2 + LEAST_NOISE**2)))
    count = len(pairs.rows)
    if left > (LEFT_BY_NOISE if least == LEFT_NEAR and left * squares < NOISE * count else least):
        return None
    if abs(slope) < FACTOR or (1.0 - left) * squares < TELLS:
        return None
    apart = float(np.sqrt(np.mean(pairs.ratio**2)))
    return GainChange(float(np.exp(slope)), beyond, count, apart, left)
