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

# of the squared differences, by twins and by what neighbours say: thirty CUReT materials leave 0.10 and 0.19
LEFT, LEFT_NEAR = 0.06, 0.12
NOISE = 3.0  # squared standard errors a pair, that may be left, or
MANY, LEFT_MANY = 60, 0.15  # twins, of which no more than their noise may be left, or
LITTLE = 0.03  # of the squares, whatever their noise: no lamp fades quite as a line does
TELLS = 60.0  # by which their sum must fall
FACTOR = float(np.log(1.1))  # between readings on either side of an angle, or at either end
STEPS = np.radians(np.arange(12.5, 80.0, 1.25))  # angles of exit that are tried
SHARE = 0.1  # of the pairs, that must be on either side of the angle, and on the same
SPREAD = 0.1  # of the lines between twins, that they must vary by
NEAR = 40  # pairs of which neighbours tell


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
    same, near = seen.exchanged(), seen.nearly_exchanged()
    by_near = _by_angle(near, theta_i, theta_r, LEFT_NEAR) if len(near.rows) >= NEAR else None
    if len(same.rows) < FEWEST:
        return by_near
    by_angle = _by_angle(same, theta_i, theta_r, LEFT)
    if len(near.rows) >= NEAR and by_near is None:
        by_angle = None  # few twins may follow anything
    told = [one for one in (by_angle, _by_line(same, len(value))) if one is not None]
    return min(told, key=lambda one: one.left) if told else None


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
    alike = [
        angle for one, _, angle in tried if one <= left + 1e-9
    ]  # of a grid, those between two of its angles
    return _told(pairs, left, slope, least, float(np.mean(alike)))


def _by_line(pairs: Exchanged, lines: int) -> GainChange | None:
    """Readings that grow from line to line."""
    if pairs.twins is None:
        return None
    apart = (pairs.rows - pairs.twins) / lines
    if np.std(apart) < SPREAD * np.max(
        np.abs(apart)
    ):  # the same angles again: one difference, told by anything
        return None
    left, slope = _line(pairs, apart)
    return _told(pairs, left, slope, LEFT, None)


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
    near = pairs.twins is None  # a local fit at a step's edge is off by more than its noise
    sure = left <= LITTLE or (left <= least and (near or left * squares <= NOISE * count))
    sure = sure or (not near and count >= MANY and left <= LEFT_MANY and left * squares <= count)
    if not sure:
        return None
    if abs(slope) < FACTOR or (1.0 - left) * squares < TELLS:
        return None
    apart = float(np.sqrt(np.mean(pairs.ratio**2)))
    return GainChange(float(np.exp(slope)), beyond, count, apart, left)
