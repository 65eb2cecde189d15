"""Compiled columns of mirror lobes, many pairs side by side. Called through photogonio.reconstruct.lobes.families.

Loops run over lanes without a branch that depends on the lane, so that the compiler can use vector instructions
(Beckmann's exponentials apart). Every lane is computed alone: results do not depend on how pairs are grouped.
"""

from __future__ import annotations

import math

import numpy as np

from photogonio.capture.jit import contracted, inlined, jit
from photogonio.reconstruct.lobes.interface import (
    beckmann_visibility,
    cubic_piece,
    dielectric_fresnel,
    ggx_visibility,
)
from photogonio.reconstruct.lobes.schlick import beckmann_density, ggx_density
from photogonio.reconstruct.modes.kernel import HALF_PI_REST, LANES, TURN, TURN_REST, short_sine

_ggx_density, _beckmann_density = inlined(ggx_density), inlined(beckmann_density)


@contracted
def mirror_parts(angles, separable, beckmann, roughness, f0, albedo, sine2, along, parts):
    """parts (2, n): D G / (4 cos_i cos_r), and the same times Schlick's (1 - cos_h)^5; or, where ``albedo`` (k, 4) of a
    coat of ``f0`` is given, the coat's lobe and (1 - E(i)) (1 - E(r)) / pi of its ground.

    ``angles`` (3, n) are theta_i, theta_r and dphi, radians.
    ``sine2`` (n,), the squared sine of the half vector as the slopes feel it, and ``along`` (2, n), the roughness
    along both directions, are of lobes that turn; else they are empty.
    """
    theta_i, theta_r, dphi = angles[0], angles[1], angles[2]
    cos_i, cos_r, half, lobe = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES)
    slope, rough_i, rough_r = np.empty(LANES), np.full(LANES, roughness), np.full(LANES, roughness)
    for start in range(0, len(theta_i), LANES):
        count = min(LANES, len(theta_i) - start)
        _half_vectors(theta_i, theta_r, dphi, start, count, cos_i, cos_r, half, lobe)
        for j in range(LANES):
            up = min((cos_i[j] + cos_r[j]) / (2.0 * half[j]), 1.0)
            lobe[j], slope[j] = up * up, 1.0 - up * up
        if len(sine2):
            for j in range(count):
                slope[j] = sine2[start + j]
                rough_i[j], rough_r[j] = along[0, start + j], along[1, start + j]
        if beckmann:
            for j in range(count):
                lobe[j] = _beckmann_density(lobe[j], slope[j], roughness) * beckmann_visibility(
                    separable, rough_i[j], rough_r[j], cos_i[j], cos_r[j]
                )
        else:
            for j in range(LANES):
                lobe[j] = _ggx_density(lobe[j], slope[j], roughness) * ggx_visibility(
                    separable, rough_i[j], rough_r[j], cos_i[j], cos_r[j]
                )
        if len(albedo):
            for j in range(count):
                parts[0, start + j] = lobe[j] * dielectric_fresnel(half[j], f0)
                entered = (1.0 - cubic_piece(albedo, cos_i[j])) * (1.0 - cubic_piece(albedo, cos_r[j]))
                parts[1, start + j] = entered / math.pi
        else:
            for j in range(count):
                miss = 1.0 - half[j]
                parts[0, start + j] = lobe[j]
                parts[1, start + j] = lobe[j] * miss**5


@inlined
def _half_vectors(theta_i, theta_r, dphi, start, count, cos_i, cos_r, half, across):
    """Cosines of both directions, and between either and the half vector; lanes beyond ``count`` repeat the last."""
    for j in range(LANES):
        at = start + min(j, count - 1)
        cos_i[j], cos_r[j], across[j] = theta_i[at], theta_r[at], dphi[at]
    for j in range(LANES):
        turns = np.rint(across[j] * (0.5 / math.pi))
        sine = short_sine(0.5 * ((across[j] - turns * TURN) - turns * TURN_REST))
        across[j] = short_sine(cos_i[j]) * short_sine(cos_r[j]) * (1.0 - 2.0 * sine * sine)
        cos_i[j] = short_sine((0.5 * math.pi - cos_i[j]) + HALF_PI_REST)
        cos_r[j] = short_sine((0.5 * math.pi - cos_r[j]) + HALF_PI_REST)
        cosine = max(min(cos_i[j] * cos_r[j] + across[j], 1.0), -1.0)
        half[j] = 0.5 * math.sqrt(max(2.0 + 2.0 * cosine, 1e-18))


@jit
def stretched_parts(toward, size2, between, longer, shorter, roughness, sine2, rough):
    """``sine2`` (n,) and ``rough`` (2, n), as :func:`mirror_parts` takes them, of directions whose x and y are
    ``toward`` (2, 2, n), of squared lengths ``size2`` (2, n) and of a sum of squared length ``between`` (n,).

    ``longer`` and ``shorter`` are what x^2, y^2 and x y have in the squares of the directions as the slopes stretch
    them, and in those of the half vector.
    """
    along, across, both = longer
    short_along, short_across, short_both = shorter
    for j in range(len(sine2)):
        for k in range(2):
            x, y = toward[0, k, j], toward[1, k, j]
            hidden = along * (x * x) + across * (y * y) + both * (x * y)
            rough[k, j] = roughness * math.sqrt((hidden + 1e-30) / size2[k, j])
        x, y = toward[0, 0, j] + toward[0, 1, j], toward[1, 0, j] + toward[1, 1, j]
        sine2[j] = (short_along * x * x + short_across * y * y + short_both * (x * y)) / between[j]
