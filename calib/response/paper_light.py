"""The light of a near lamp on the print, and the codes that a curve makes of it."""

from __future__ import annotations

import numpy as np

from photogonio.calib.response.curve import BENDS, basis, log_srgb, steepness
from photogonio.calib.response.paper_codes import PaperCodes
from photogonio.calib.response.unknowns import Unknowns

_MODEL = 0.0015  # relative error of the light on one square of white print
_INK_MODEL = 0.015  # of black print: the lens's glare, shine, and what a phone's sharpening makes of it
_GRID = np.linspace(0.002, 1.0, 1500)
_SHAPES, _STEEP = basis(_GRID), steepness(_GRID)
_LEAST_RISE, _LEAST_STEEP = 1e-6, 0.2


def direct_light(offset: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Light (n,) on level ground of a lamp of unit strength ``offset`` (n, 3) away, that squared, and its height."""
    squared = (offset**2).sum(1)
    height = np.maximum(offset[:, 2], 1e-3 * np.sqrt(squared))
    return height / squared**1.5, squared, height


def light_of(
    layout: Unknowns, one: PaperCodes, number: int, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Direct light (n,) over its middle with what is even, its logarithm's slopes (n, 3) by the lamp's place, and what
    is even of it (n,)."""
    at = layout.places + 3 * layout.lights.index(one.light)
    place = values[at : at + 3]
    world = one.pose.inverse().apply(place) if one.attached else place
    offset = world - one.points
    direct, squared, height = direct_light(offset)
    middle = layout.middles[number]
    even = values[layout.even + number]
    light = np.maximum(direct / middle + even, 1e-3)
    by_place = -3 * offset / squared[:, None]
    by_place[:, 2] += 1.0 / height
    if one.attached:
        by_place = by_place @ one.pose.rotation.T
    return light, by_place * (direct / middle / light)[:, None], 1.0 / light


def codes_by(bend: np.ndarray, light: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Codes (n,) of the logarithm of light (n,) by a curve's bend, and how steeply that rises with the code (n,)."""
    moved = _GRID + _SHAPES @ bend
    rising = np.maximum.accumulate(log_srgb(moved)) + _LEAST_RISE * _GRID
    steep = np.maximum(np.gradient(rising, _GRID), _LEAST_STEEP)
    code = np.interp(light, rising, _GRID)
    return code, np.interp(code, _GRID, steep)


def design_of(
    layout: Unknowns, one: PaperCodes, number: int, values: np.ndarray, channel: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Derivatives (n, k) by :meth:`Unknowns.asked` of the code that the light should have, how far the code is from it
    (n,), and the standard error of that (n,)."""
    light, by_place, by_even = light_of(layout, one, number, values)
    code, black = one.code[:, channel], ~one.white
    bend = values[:BENDS] + values[(channel + 1) * BENDS : (channel + 2) * BENDS]
    ink, veil = np.exp(values[layout.ink + one.tone * layout.channels + channel]), values[layout.veil]
    tone = np.where(black, ink, 1.0) * light
    total = np.maximum(tone + veil, 1e-3 * tone)
    lens = np.column_stack([one.aside, one.aside**2])
    strength = values[layout.strengths + number * layout.channels + channel]
    said = strength + np.log(total) + lens @ values[layout.lens : layout.veil]
    expected, steep = codes_by(bend, said)
    shape, share = basis(expected), tone / total
    shape *= steepness(expected + shape @ bend)[:, None]
    design = np.column_stack(
        [
            -shape,
            -shape,
            np.ones(len(code)),
            by_place * share[:, None],
            by_even * share,
            np.where(black, share, 0.0)[:, None] * (one.tone[:, None] == np.arange(layout.tones)),
            lens,
            1.0 / total,
        ]
    )
    model = np.where(black & (one.tone == 0), _INK_MODEL, _MODEL) / np.interp(code, _GRID, _STEEP)
    return design / steep[:, None], code - expected, np.hypot(one.noise[:, channel], model)
