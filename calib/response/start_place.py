"""Where a lamp may stand by one photo's codes, whatever power of light they are: the start of a fit that knows more.

A curve that is not known bends all light alike, about as a power does. So the logarithm of light by sRGB's curve is
linear in that of the lamp's direct light, each kind of print with an offset of its own; the place is sought where it is
most nearly so.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.optimize import minimize

from photogonio.calib.response.paper_codes import PaperCodes
from photogonio.calib.response.paper_light import direct_light
from photogonio.calib.response.unknowns import raised
from photogonio.capture.containers.tone import srgb

_HEIGHTS, _AROUND = np.radians([15.0, 25.0, 35.0, 45.0, 55.0, 65.0, 75.0, 85.0]), 24
_DISTANCES = (0.6, 0.8, 1.0, 1.3, 1.8)  # of that at which the lamp was taken to stand
_POWERS = (0.6, 1.6)  # of the light, that a curve bends it to
_INK_WEIGHT = 0.1  # of black print beside white: the errors of either
_BETTER = 0.7  # of the miss of the place that was told: what is so much better is taken for it
_SEARCH = {"maxfev": 150, "xatol": 1.0, "fatol": 1e-5}


def likely_place(one: PaperCodes, told: np.ndarray) -> np.ndarray:
    """The place (3,) that was ``told``, or one of many about, world, where the photo's print speaks against it."""
    middle = np.append(one.points[:, :2].mean(axis=0), 0.0)
    reach = float(np.linalg.norm(told - middle))
    turns = np.arange(_AROUND) * 2 * np.pi / _AROUND
    places = [
        middle + far * reach * np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
        for up, turn, far in product(_HEIGHTS, turns, _DISTANCES)
    ]
    best = places[int(_misses(one, np.array(places)).argmin())]
    ends = [
        minimize(
            lambda at: float(_misses(one, raised(at)[None])[0]), start, method="Nelder-Mead", options=_SEARCH
        )
        for start in (told, best)
    ]
    end = min(ends, key=lambda one: one.fun)
    return raised(end.x) if end.fun < _BETTER * _misses(one, told[None])[0] else told


def _misses(one: PaperCodes, places: np.ndarray) -> np.ndarray:
    """(p,) of the logarithm of light at places (p, 3), root of the mean square."""
    seen = np.log(np.maximum(srgb(one.code), 1e-9)).mean(axis=1)
    kind = np.where(one.white, -1, one.tone)
    weight = np.where(one.white | (one.tone > 0), 1.0, _INK_WEIGHT)
    light = np.log([direct_light(place - one.points)[0] for place in places])
    for each in np.unique(kind):
        own = kind == each
        seen[own] -= np.average(seen[own], weights=weight[own])
        light[:, own] -= np.average(light[:, own], axis=1, weights=weight[own])[:, None]
    power = (light @ (weight**2 * seen)) / np.maximum((light**2) @ weight**2, 1e-300)
    left = seen - np.clip(power, *_POWERS)[:, None] * light
    return np.sqrt(np.mean((weight * left) ** 2, axis=1))
