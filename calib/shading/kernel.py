"""A lamp's light on the board and how it changes with lamp and balls, each in one compiled pass over the samples."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from photogonio.calib.geometry.visibility import DIMMEST, passed_by, share_of
from photogonio.capture.jit import borrowing, jit

_LIT = 0.9  # share of the lamp seen: lit
_FEWEST_LIT = 0.1  # of the samples, that tell the lamp's strength


def lens(aside: np.ndarray, falloff: Sequence[float] | np.ndarray) -> np.ndarray:
    """What (n,) a lens that darkens the corners of its pictures leaves of the light, ``aside`` (n,) of their middle."""
    return np.exp(falloff[0] * aside + falloff[1] * aside**2)


def straight_light(points: np.ndarray, place: np.ndarray, narrow: float, aim: np.ndarray) -> np.ndarray:
    """Direct light (n,) on the board's plane at ``points`` (n, 3) of a lamp of unit strength at ``place`` (3,), which
    falls off beside its axis toward ``aim`` (3,) with the ``narrow``-th power of the cosine."""
    result = np.empty(len(points))
    _all_straight(points, place, float(narrow), aim, result)
    return result


@borrowing
def _all_straight(points, place, narrow, aim, result):
    for k in range(len(points)):
        result[k] = _straight(points[k], place, narrow, aim)


@borrowing
def light_on_board(
    points, white, spread, across, place, strength, black, lamp, narrow, aim, tilts, soft, balls, result
):
    """Fills ``result`` (4, n): strength and tone of the print, direct light by that, what shadows leave of it, and its
    tilt.

    ``white`` (n,) is the share of white print, ``black`` the radiance of the other over it; ``spread`` (n, 3) and
    ``soft`` (a variance) blur shadows, ``lamp`` is the lamp's radius, ``tilts`` (2,) slopes along ``across`` (2, n).
    """
    for k in range(len(points)):
        tone = (black + (1.0 - black) * white[k]) * strength
        bare = tone * _straight(points[k], place, narrow, aim)
        around = spread[k]
        share = share_of(points[k], place, lamp, balls, around[0] + soft, around[1], around[2] + soft)
        result[0, k], result[1, k], result[2, k] = tone, bare, bare * share
        result[3, k] = 1 + tilts[0] * across[0, k] + tilts[1] * across[1, k]


@borrowing
def slopes_of_shaded(
    points,
    spread,
    light,
    place,
    lamp,
    narrow,
    aim,
    soft,
    balls,
    places,
    lamps,
    tables,
    step,
    margin,
    rows,
    result,
):
    """How shaded light times tilt changes over ``step`` (p + m,), to ``rows`` (p + m,) of ``result``: with the lamp at
    each of ``places`` (p, 3) instead of ``place``, then with each of ``lamps`` (m,), radii, and ``tables`` (m, k, 4) of
    balls.

    ``light`` (4, n) is that of :func:`light_on_board`. Where the way to the lamp passes all balls by ``margin`` more
    than leaves all of it visible, no ball matters.
    """
    count = len(places)
    for k in range(len(points)):
        around, tone, bare, shaded, tilt = spread[k], light[0, k], light[1, k], light[2, k], light[3, k]
        xx, xy, yy = around[0] + soft, around[1], around[2] + soft
        clear = passed_by(points[k], place, lamp, balls, xx, yy, margin)
        if clear:
            by_x, by_y, by_z = _by_place(points[k], place, narrow, aim)
            for p in range(count):
                change = by_x * (places[p, 0] - place[0]) + by_y * (places[p, 1] - place[1])
                change += by_z * (places[p, 2] - place[2])
                result[rows[p], k] = shaded * change / step[p] * tilt
        else:
            for p in range(count):
                share = share_of(points[k], places[p], lamp, balls, xx, xy, yy)
                moved = tone * _straight(points[k], places[p], narrow, aim) * share
                result[rows[p], k] = (moved - shaded) / step[p] * tilt
        for m in range(len(lamps)):
            slope = 0.0
            if not clear:
                moved = bare * share_of(points[k], place, lamps[m], tables[m], xx, xy, yy)
                slope = (moved - shaded) / step[count + m] * tilt
            result[rows[count + m], k] = slope


@borrowing
def _straight(point, place, narrow, aim):
    """:func:`straight_light` at one point."""
    height = place[2]
    if height <= 0:
        return 0.0
    x, y, z = place[0] - point[0], place[1] - point[1], height - point[2]
    squared = x * x + y * y + z * z
    far = math.sqrt(squared)
    light = z / (squared * far)
    if narrow == 0.0:
        return light
    ax, ay, az = aim[0] - place[0], aim[1] - place[1], aim[2] - place[2]
    axis = math.sqrt(ax * ax + ay * ay + az * az)
    cosine = -(x * ax + y * ay + z * az) / (axis * far)
    return light * math.exp(narrow * math.log(max(cosine, DIMMEST)))


@borrowing
def _all_shares(points, place, lamp, balls, soft, share):
    for k in range(len(points)):
        share[k] = share_of(points[k], place, lamp, balls, soft, 0.0, soft)


@borrowing
def _by_place(point, place, narrow, aim):
    """Derivative (3,) of the logarithm of :func:`_straight` by the lamp's place; 0 for a lamp below the board."""
    x, y, z = place[0] - point[0], place[1] - point[1], place[2] - point[2]
    ax, ay, az = aim[0] - place[0], aim[1] - place[1], aim[2] - place[2]
    squared, axis, along = x * x + y * y + z * z, ax * ax + ay * ay + az * az, -(x * ax + y * ay + z * az)
    lit = 1.0 if place[2] > 0 else 0.0
    beam = narrow if along > DIMMEST * math.sqrt(squared * axis) else 0.0
    by_x = lit * (-3 * x / squared + beam * ((x - ax) / along - x / squared + ax / axis))
    by_y = lit * (-3 * y / squared + beam * ((y - ay) / along - y / squared + ay / axis))
    by_z = lit * (1 / z - 3 * z / squared + beam * ((z - az) / along - z / squared + az / axis))
    return by_x, by_y, by_z


@jit
def misfits(points, tone, level, places, lamp, balls, soft, tolerance, result):
    """How badly a lamp at each of ``places`` (m, 3), whose strength is fitted to what is lit, agrees with ``level``
    (n,): means, to ``result`` (m,), of squares over ``tolerance`` of the light, each at most 1."""
    count = len(points)
    bare, share, ratio, aim = np.empty(count), np.empty(count), np.empty(count), np.zeros(3)
    for m in range(len(places)):
        lit = 0
        _all_straight(points, places[m], 0.0, aim, bare)
        _all_shares(points, places[m], lamp, balls, soft, share)
        for k in range(count):
            bare[k] *= tone[k]
            if share[k] > _LIT and bare[k] > 0:
                ratio[lit] = level[k] / bare[k]
                lit += 1
        result[m] = 1.0
        if lit >= _FEWEST_LIT * count:
            strength, total = np.median(ratio[:lit]), 0.0
            for k in range(count):
                expected = strength * bare[k]
                off = (level[k] - expected * share[k]) / (tolerance * max(expected, 1e-300))
                total += min(off * off, 1.0)
            result[m] = total / count
