"""Lamps that nothing but mirror balls tells of: is what was found there the lamp?

Where the photos show the board's paper its light decides. Without it, a reflection of something else passes for the
lamp unless the balls contradict one another, or the white patch shows another falloff than that lamp's.
"""

from __future__ import annotations

import numpy as np

from calib.irradiance import Reading
from calib.lamps import expected_pixel
from calib.patch import UNEVEN
from calib.sight import Sight
from calib.together import Settled

_FARTHEST = 1.5  # pixels by which highlights of one lamp may miss
_WILD = 6.0  # and in their standard errors
_MOST = 0.5  # share of the patches that must agree with their lamps, for the others to tell something


def contradiction(settled: Settled, members: list[Sight]) -> str | None:
    """Why the highlights of one lamp (its views are ``members``) are not believed; None if they may be."""
    name = members[0].light
    lamp = settled.lamps[name]
    if lamp.fixed or lamp.source not in ("mirror balls", "probe"):
        return None
    if any(s.view.name in settled.shading for s in members):
        return None
    misses = [
        (
            float(np.hypot(*(h.pixel - expected_pixel(settled.camera, s, lamp, settled.values, h.ball)))),
            h.sigma,
        )
        for s in members
        for h in s.highlights
    ]
    worst, sigma = max(misses, default=(0.0, 1.0))
    if worst > max(_FARTHEST, _WILD * settled.highlight_scale * sigma):
        return f"the mirror balls contradict one another about its lamp, by {worst:.1f} px"
    return None


def denied_by_patch(settled: Settled, sights: list[Sight], readings: dict[str, Reading]) -> list[str]:
    """Views whose white patch shows a falloff that is not their lamp's, where most patches agree with theirs."""
    mirrored = [
        s.view.name
        for s in sights
        if s.view.name in readings
        and s.view.name not in settled.shading
        and not settled.lamps[s.light].fixed
        and settled.lamps[s.light].source == "mirror balls"
    ]
    uneven = [n for n in mirrored if readings[n].patch.problem == UNEVEN]
    agreeing = [n for n in mirrored if readings[n].patch.value is not None]
    return uneven if len(agreeing) >= max(2, _MOST * len(mirrored)) else []
