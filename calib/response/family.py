"""Tone curves as programs of cameras draw them, and how they go together: what is expected of one that nobody names.

Empirical models of response take the covariance of many curves (Grossberg & Nayar, "Modeling the space of camera
response functions", 2004). Here they are those that operators of rendering make: a power, a rational shoulder (Reinhard
et al. 2002) or Hable's film (2010) on light, then an S about a pivot and a lifted black on sRGB's code, each of many
strengths.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from itertools import product

import numpy as np

from photogonio.capture.containers.tone import srgb

_POWERS = (0.9, 1.0, 1.12)  # of light
_SHOULDERS = (0.0, 0.4, 1.0, 2.0)  # a of L (1 + a) / (1 + a L)
_FILMS = (2.0, 4.0, 8.0)  # light at which Hable's curve is at full scale
_BENDS = (-0.25, -0.1, 0.0, 0.12, 0.25, 0.4)  # k of s + 4 k s (1 - s) (s - pivot)
_PIVOTS = (0.3, 0.42, 0.5, 0.6)
_LIFTS = (0.0, 0.02)
_LEAST_SLOPE = 0.1  # of an S: a curve rises
_CODES = np.linspace(0.0, 1.0, 1025)  # that sRGB would have


def curves() -> Iterator[np.ndarray]:
    """Codes (n,) that light gets of which sRGB's code is _CODES, from curve to curve."""
    light = srgb(_CODES)
    shoulders = [lambda x, a=a: x * (1 + a) / (1 + a * x) for a in _SHOULDERS]
    films = [lambda x, w=w: _hable(w * x) / _hable(w) for w in _FILMS]
    for power, shoulder in product(_POWERS, shoulders + films):
        code = _coded(np.clip(shoulder(light**power), 0.0, 1.0))
        for bend, pivot in product(_BENDS, _PIVOTS):
            bent = code + 4.0 * bend * code * (1.0 - code) * (code - pivot)
            slope = 1 + 4.0 * bend * (-3 * code**2 + 2 * (1 + pivot) * code - pivot)
            if slope.min() >= _LEAST_SLOPE:
                yield from (lift + (1.0 - lift) * bent for lift in _LIFTS)


def _hable(x: np.ndarray | float) -> np.ndarray | float:
    return (x * (0.22 * x + 0.03) + 0.002) / (x * (0.22 * x + 0.3) + 0.06) - 0.1 / 3.0


def _coded(light: np.ndarray) -> np.ndarray:
    return np.interp(light, srgb(_CODES), _CODES)


@cache
def moved_by_them() -> tuple[np.ndarray, np.ndarray]:
    """Codes (m,), and how far each curve moves them to become sRGB's (m, curves)."""
    codes = np.linspace(0.03, 1.0, 195)
    return codes, np.column_stack([np.interp(codes, one, _CODES) - codes for one in curves()])
