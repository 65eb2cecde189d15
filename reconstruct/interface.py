"""What a rough interface does with light: Fresnel's reflectance, Smith's masking, and all that it sends back.

Pure functions of cosines and angles; ``masking`` is "correlated" (Heitz 2014) or "separable", ``distribution`` of
slopes "ggx" or "beckmann" (Walter et al. 2007).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.special import erf

ANGLES = np.linspace(0.0, 0.5 * np.pi - 1e-3, 25)  # of incidence, at which a coat's albedo is known
TILTS, TURNS = 32, 16  # half vectors: equal shares of the slopes, azimuths of half a turn


def dielectric_fresnel(cos: np.ndarray, f0: float) -> np.ndarray:
    """Unpolarised reflectance of a smooth dielectric with reflectance ``f0`` at normal incidence."""
    index = (1.0 + np.sqrt(f0)) / (1.0 - np.sqrt(f0))
    inside = np.sqrt(1.0 - (1.0 - cos * cos) / index**2)
    s = (cos - index * inside) / (cos + index * inside)
    p = (index * cos - inside) / (index * cos + inside)
    return 0.5 * (s * s + p * p)


def visibility(
    masking: str, distribution: str, roughness: tuple, cos_i: np.ndarray, cos_r: np.ndarray
) -> np.ndarray:
    """G / (4 cos_i cos_r); ``roughness`` is that along the plane of each of the two directions."""
    if distribution == "beckmann":
        hidden_i, hidden_r = _beckmann_hidden(cos_i, roughness[0]), _beckmann_hidden(cos_r, roughness[1])
        both = 0.0 if masking == "correlated" else hidden_i * hidden_r
        return 0.25 / np.maximum(cos_i * cos_r * (1.0 + hidden_i + hidden_r + both), 1e-12)
    # cos (1 + 2 Lambda) of each direction
    root_i, root_r = (
        np.sqrt(a * a + (1.0 - a * a) * cos * cos) for a, cos in zip(roughness, (cos_i, cos_r), strict=True)
    )
    if masking == "correlated":
        return 0.5 / np.maximum(cos_r * root_i + cos_i * root_r, 1e-12)
    return 1.0 / ((cos_i + root_i) * (cos_r + root_r))


def coat_albedo(
    masking: str, distribution: str, roughness: float, f0: float, theta: np.ndarray
) -> np.ndarray:
    """Share of the light from ``theta`` that a rough dielectric sends back; the rest enters.

    Light that meets a second facet counts as entered. Interpolated in theta; within 1e-3 of the integral.
    """
    nodes = _albedo_nodes(masking, distribution, float(roughness), float(f0))
    return np.interp(theta, ANGLES, nodes)


@lru_cache(maxsize=256)
def _albedo_nodes(masking: str, distribution: str, roughness: float, f0: float) -> np.ndarray:
    """At :data:`ANGLES`: the mean over half vectors h drawn by D cos_h of F G <i, h> / (cos_i cos_h)."""
    across, gain = _gains(masking, distribution, roughness)
    return (dielectric_fresnel(across, f0) * gain).mean((1, 2))


@lru_cache(maxsize=8)
def _gains(masking: str, distribution: str, roughness: float) -> tuple[np.ndarray, np.ndarray]:
    """<i, h> and G <i, h> / (cos_i cos_h), 0 where nothing is reflected; of any Fresnel."""
    share = (np.arange(TILTS) + 0.5) / TILTS
    tan2 = share / (1.0 - share) if distribution == "ggx" else -np.log1p(-share)
    cos_h = 1.0 / np.sqrt(1.0 + roughness**2 * tan2)
    turn = (np.arange(TURNS) + 0.5) * np.pi / TURNS
    cos_i, sin_i = np.cos(ANGLES)[:, None, None], np.sin(ANGLES)[:, None, None]
    cos_h, sin_h = cos_h[:, None], np.sqrt(1.0 - cos_h**2)[:, None]
    across = cos_i * cos_h + sin_i * sin_h * np.cos(turn)
    cos_r = 2.0 * across * cos_h - cos_i
    reflected = (across > 0.0) & (cos_r > 0.0)
    safe = np.where(reflected, cos_r, 1.0)
    gain = (
        4.0 * safe * visibility(masking, distribution, (roughness, roughness), cos_i, safe) * across / cos_h
    )
    return np.clip(across, 1e-6, 1.0), np.where(reflected, gain, 0.0)


def _beckmann_hidden(cos: np.ndarray, roughness: float) -> np.ndarray:
    """Smith's Lambda of Gaussian slopes (Smith 1967): (exp(-a^2) / (a sqrt(pi)) - erfc(a)) / 2, a = cot / roughness."""
    sine = np.sqrt(np.maximum(1.0 - cos * cos, 1e-30))
    a = np.maximum(cos, 1e-9) / (roughness * sine)
    return 0.5 * (np.exp(-a * a) / (a * np.sqrt(np.pi)) - (1.0 - erf(a)))
