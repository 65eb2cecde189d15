"""What a lobe sends out of even light: from its shape alone, once for each, since all else is a factor.

A lobe of two roughnesses is the same on either side of each of its axes, so that azimuths of a quarter turn tell all.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from photogonio.reconstruct.lobes.lobe_sums import LobeTerms, add_lobe
from photogonio.reconstruct.modes.integrals import POINTS, albedo_by_quadrature
from photogonio.reconstruct.modes.quadrature import elevation_rule

TURNS = 4  # pieces of a quarter turn
FINE, COARSE = (
    (8, 6, POINTS),
    (8, 4, 6),
)  # points and level in elevation, and points of the albedo; where it turns
# within 3e-7, 2e-5 of Schlick's part


@lru_cache(maxsize=512)
def even_light_parts(
    axes: tuple[float, float], beckmann: bool, separable: bool, f0: float
) -> tuple[float, float]:
    """Share of even light that a mirror lobe of weight 1 sends out, and that of (1 - h.i)^5 times it; with ``f0`` of 0
    or more that of a dielectric, and 0."""
    turning = axes[0] != axes[1]
    terms = LobeTerms(
        axes=np.array([*axes, 0.0]),
        turning=turning,
        peak=False,
        forward=False,
        halfway=False,
        separable=separable,
        beckmann=beckmann,
        f0=f0,
        table=np.empty(0),
        entered=None,
        factors=np.eye(2),
    )
    turns = 0.5 * np.pi * np.arange(TURNS + 1) / TURNS if turning else np.zeros(1)
    share = np.where((turns == 0.0) | (turns == turns[-1]), 0.5, 1.0)
    points, level, inner = COARSE if turning else FINE
    theta, weight = elevation_rule(points, level=level)
    sent = np.zeros((len(theta), 2))
    for turn, part in zip(turns, share / share.sum(), strict=True):
        sides = (1.0, -1.0) if 0.0 < turn < turns[-1] else (1.0,)  # alike along the axes

        def value(theta_i, theta_r, dphi, turn=turn, sides=sides) -> np.ndarray:
            given = np.broadcast_arrays(theta_i, turn, theta_r, dphi)
            incident, around, exit, apart = (np.array(one, float).reshape(-1) for one in given)
            result = np.zeros((len(incident), 2))
            for side in sides:
                add_lobe(terms, [incident, around, exit, around + side * apart], result)
            return result.reshape(*given[0].shape, 2) / len(sides)

        sent += part * albedo_by_quadrature(value, theta, min(axes), points=inner)
    first, second = 2.0 * (weight * np.cos(theta)) @ sent
    return float(first), float(second)
