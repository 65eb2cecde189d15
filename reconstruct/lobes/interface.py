"""What a rough interface does with light: Fresnel's reflectance, Smith's masking, and all that it sends back.

Pure functions of cosines and angles, compiled; masking is height-correlated (Heitz 2014) or ``separable``, slopes are
those of GGX or of Beckmann (Walter et al. 2007).
"""

from __future__ import annotations

import math
from functools import lru_cache

import numba
import numpy as np

LAST = 0.5 * np.pi - 1e-3  # angle of incidence, radians
ANGLES = np.linspace(0.0, LAST, 25)  # of incidence, at which a coat's albedo is known
TILTS, TURNS = 32, 16  # half vectors: equal shares of the slopes, azimuths of half a turn

_jit = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
_inline = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"}, inline="always")


@_inline
def dielectric_fresnel(cos, f0):
    """Unpolarised reflectance of a smooth dielectric with reflectance ``f0`` at normal incidence."""
    index = (1.0 + np.sqrt(f0)) / (1.0 - np.sqrt(f0))
    inside = np.sqrt(1.0 - (1.0 - cos * cos) / (index * index))
    s = (cos - index * inside) / (cos + index * inside)
    p = (index * cos - inside) / (index * cos + inside)
    return 0.5 * (s * s + p * p)


@_inline
def ggx_visibility(separable, rough_i, rough_r, cos_i, cos_r):
    """G / (4 cos_i cos_r); the roughness is that along the plane of each of the two directions."""
    # cos (1 + 2 Lambda) of each direction
    root_i = math.sqrt(rough_i * rough_i + (1.0 - rough_i * rough_i) * cos_i * cos_i)
    root_r = math.sqrt(rough_r * rough_r + (1.0 - rough_r * rough_r) * cos_r * cos_r)
    if separable:
        return 1.0 / ((cos_i + root_i) * (cos_r + root_r))
    return 0.5 / max(cos_r * root_i + cos_i * root_r, 1e-12)


@_jit
def beckmann_visibility(separable, rough_i, rough_r, cos_i, cos_r):
    """The same of Gaussian slopes."""
    hidden_i, hidden_r = _beckmann_hidden(cos_i, rough_i), _beckmann_hidden(cos_r, rough_r)
    both = hidden_i * hidden_r if separable else 0.0
    return 0.25 / max(cos_i * cos_r * (1.0 + hidden_i + hidden_r + both), 1e-12)


@_jit
def _beckmann_hidden(cos, roughness):
    """Smith's Lambda of Gaussian slopes (Smith 1967): (exp(-a^2) / (a sqrt(pi)) - erfc(a)) / 2, a = cot / roughness."""
    a = max(cos, 1e-9) / (roughness * math.sqrt(max(1.0 - cos * cos, 1e-30)))
    return 0.5 * (math.exp(-a * a) / (a * math.sqrt(math.pi)) - (1.0 - math.erf(a)))


@lru_cache(maxsize=256)
def coat_albedo(separable: bool, beckmann: bool, roughness: float, f0: float) -> np.ndarray:
    """Share of the light from each of :data:`ANGLES` that a rough dielectric sends back; the rest enters.

    The mean over half vectors h drawn by D cos_h of F G <i, h> / (cos_i cos_h). Light that meets a second facet
    counts as entered. Interpolated in the angle it is within 1e-3 of the integral.
    """
    across, gain = _gains(separable, beckmann, roughness)
    return _mean_reflected(across, gain, f0)


@lru_cache(maxsize=8)
def _gains(separable: bool, beckmann: bool, roughness: float) -> tuple[np.ndarray, np.ndarray]:
    """<i, h> and G <i, h> / (cos_i cos_h), 0 where nothing is reflected; of any Fresnel."""
    share = (np.arange(TILTS) + 0.5) / TILTS
    tan2 = -np.log1p(-share) if beckmann else share / (1.0 - share)
    turns = np.cos((np.arange(TURNS) + 0.5) * np.pi / TURNS)
    across, gain = np.empty((2, len(ANGLES), TILTS * TURNS))
    _fill_gains(separable, beckmann, roughness, 1.0 / np.sqrt(1.0 + roughness**2 * tan2), turns, across, gain)
    return across, gain


@_jit
def _fill_gains(separable, beckmann, roughness, cos_hs, turns, across, gain):
    for a in range(len(across)):
        cos_i, sin_i = math.cos(ANGLES[a]), math.sin(ANGLES[a])
        for t in range(len(cos_hs)):
            cos_h = cos_hs[t]
            upright, aside = cos_i * cos_h, sin_i * math.sqrt(1.0 - cos_h * cos_h)
            for k in range(len(turns)):
                j = t * len(turns) + k
                between = upright + aside * turns[k]
                cos_r = 2.0 * between * cos_h - cos_i
                reflected = between > 0.0 and cos_r > 0.0
                across[a, j], gain[a, j] = min(max(between, 1e-6), 1.0), 0.0
                if reflected:
                    if beckmann:
                        seen = beckmann_visibility(separable, roughness, roughness, cos_i, cos_r)
                    else:
                        seen = ggx_visibility(separable, roughness, roughness, cos_i, cos_r)
                    gain[a, j] = 4.0 * cos_r * seen * between / cos_h


@_jit
def _mean_reflected(across, gain, f0):
    reflected, mean = np.empty(across.shape[1]), np.empty(len(across))
    for a in range(len(across)):
        for j in range(len(reflected)):
            reflected[j] = dielectric_fresnel(across[a, j], f0) * gain[a, j]
        mean[a] = reflected.mean()
    return mean
