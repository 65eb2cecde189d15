"""How a view's radiance changes with the values of its shading fit."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from photogonio.calib.geometry.visibility import log_cosine
from photogonio.calib.shading.kernel import lens, slopes_of_shaded
from photogonio.calib.shading.parameters import BLACK, EVEN, FALLOFF, LOCAL, NARROW, PATCHES, SHARED, THROWN

if TYPE_CHECKING:
    from photogonio.calib.shading.model import LightOnPaper, LitPaper, ShadingScene

_STEP = 1e-4  # for derivatives: of the lamp's distance, in length units of the sample, of the logarithm
_CLEAR = 4.0  # of such steps, by which a ball that no sample's light touches stays clear of it
# values whose derivatives need differences, and all of polished balls
_MOVING = (0, 1, 2, *range(LOCAL, LOCAL + 5))


def slopes(
    board: LitPaper,
    values: np.ndarray,
    scene: ShadingScene,
    light: LightOnPaper,
    thrown: np.ndarray,
    count: int,
) -> np.ndarray:
    """d radiance / d values, (count, n): by differences where lamp and shadows move, else as the model says."""
    design, now = np.empty((count, len(light.tone))), scene.moved(values[LOCAL:])
    far = float(np.linalg.norm(values[:3]))
    places = values[:3] + _STEP * far * np.eye(3)
    moving = [k for k in (*_MOVING, *range(LOCAL + SHARED, count)) if 3 <= k < count]
    moved = [now.moved(now.shared + _STEP * (np.arange(len(now.shared)) == k - LOCAL)) for k in moving]
    step = np.full(3 + len(moving), _STEP)
    step[:3] *= far
    slopes_of_shaded(
        board.points,
        board.spread,
        light.parts,
        values[:3].copy(),
        now.lamp_radius,
        now.narrow,
        np.array(now.aim),
        now.soft**2 / 4,
        now.table,
        places,
        np.array([one.lamp_radius for one in moved]),
        np.array([one.table for one in (*moved, now)])[:-1],
        step,
        _CLEAR * _STEP * (1 + far + now.lamp_radius),
        np.array([0, 1, 2, *moving]),
        design,
    )
    for k in range(3):
        design[k] += light.tone * (values[EVEN] * (board.even(places[k], now) - light.even) / step[k])
    base = light.radiance(values, thrown)
    design[3] = base
    design[THROWN] = light.tone * thrown.T
    design[EVEN] = light.tone * light.even
    design[7:9] = light.shaded * board.across
    design[PATCHES] = 0.0
    design[PATCHES, board.of_patches] = base[board.of_patches]
    if count > LOCAL:
        ink = np.exp(values[BLACK]) * (1.0 - board.white) * np.exp(values[3])
        if any(now.falloff):
            ink *= lens(board.aside, now.falloff)
        design[BLACK] = base * ink / light.tone
        design[FALLOFF : FALLOFF + 2] = base * board.aside, base * board.aside**2
        design[NARROW] = light.shaded * light.tilt * log_cosine(board.points, values[:3], np.array(scene.aim))
    return design
