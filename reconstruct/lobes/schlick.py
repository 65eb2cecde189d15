"""Lobes: what modes of low order cannot carry.

Mirror lobes are GGX microfacets (Walter et al. 2007) with Smith's height-correlated masking and shadowing (Heitz
2014) and Schlick's Fresnel term (1994), retro-reflective ones the same peak about the light, as docs/modes.md defines
them. Pure functions of angles.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

RETRO = "retro-"  # begins the names of retro-reflective lobes
ROUND = "round-"  # and of the same about the mirror direction
BLINN_PHONG = "blinn-phong"


def ggx(
    theta_i: ArrayLike, theta_r: ArrayLike, dphi: ArrayLike, roughness: float, f0: ArrayLike
) -> np.ndarray:
    """BRDF of a GGX lobe, 1/sr: D G2 F / (4 cos_i cos_r).

    Angles in radians broadcast together; ``roughness`` is alpha; ``f0`` a number, or (c,) for a result
    (..., c). Stable for narrow lobes and at grazing angles: sines of the half vector are sums of squares,
    never 1 - cos^2. Where both directions graze the lobe is unbounded; the result is then large and finite.
    """
    theta_i, theta_r, dphi = np.broadcast_arrays(*[np.asarray(a, float) for a in (theta_i, theta_r, dphi)])
    cos_i, cos_r, up, aside = _half_vector(theta_i, theta_r, dphi)
    alpha2 = roughness**2
    length2 = up + aside  # of i + r
    shrink = np.where(length2 > 0, length2, 1.0)
    spread = np.where(length2 > 0, (alpha2 * up + aside) / shrink, alpha2)
    normals = alpha2 / (np.pi * spread**2)
    bend = cos_i * np.sqrt(alpha2 + (1 - alpha2) * cos_r**2) + cos_r * np.sqrt(
        alpha2 + (1 - alpha2) * cos_i**2
    )
    visible = 0.5 / np.maximum(bend, np.finfo(float).eps ** 2)
    miss = (1 - np.minimum(np.sqrt(length2) / 2, 1.0)) ** 5
    f0 = np.asarray(f0, float)
    if f0.ndim:
        normals, visible, miss = normals[..., None], visible[..., None], miss[..., None]
    return normals * visible * (f0 + (1 - f0) * miss)


def _half_vector(theta_i, theta_r, dphi):
    """cos_i, cos_r and the squared normal and tangential parts of i + r, without cancellation."""
    cos_i, cos_r = np.maximum(np.cos(theta_i), 0.0), np.maximum(np.cos(theta_r), 0.0)
    sin_i, sin_r = np.sin(theta_i), np.sin(theta_r)
    aside = (sin_i - sin_r) ** 2 + 4 * sin_i * sin_r * np.cos(dphi / 2) ** 2
    return cos_i, cos_r, (cos_i + cos_r) ** 2, aside


def retro(
    theta_i: ArrayLike, theta_r: ArrayLike, dphi: ArrayLike, roughness: float, distribution: str = "ggx"
) -> np.ndarray:
    """A retro-reflective lobe of weight 1, 1/sr: D(psi / 2) / 4, psi the angle between the two directions.

    Angles in radians broadcast together. At normal incidence that is the mirror lobe of the same roughness and
    distribution ("ggx" or "beckmann") without masking, and ``weight`` the fraction that it returns; unlike the mirror
    lobe it is as high at any incidence, as that of beads and corner cubes nearly is.
    """
    theta_i, theta_r, dphi = np.broadcast_arrays(*[np.asarray(a, float) for a in (theta_i, theta_r, dphi)])
    # sin^2(psi / 2) by sums of squares: no digits are lost near the peak
    across = np.sin(theta_i) * np.sin(theta_r) * np.sin(0.5 * dphi) ** 2
    sine2 = np.minimum(np.sin(0.5 * (theta_i - theta_r)) ** 2 + across, 1.0)
    return 0.25 * slopes_density(np.sqrt(1.0 - sine2), roughness, distribution, sine2)


def blinn_phong(theta_i: ArrayLike, theta_r: ArrayLike, dphi: ArrayLike, roughness: float) -> np.ndarray:
    """A cosine power of the half vector's angle from the normal (Blinn 1977), 1/sr: D / 4 with neither Fresnel's term
    nor masking, D = (p + 2) / (2 pi) cos^p, p = 2 / roughness^2 - 2 (Walter et al. 2007).

    Angles in radians broadcast together.
    """
    theta_i, theta_r, dphi = np.broadcast_arrays(*[np.asarray(a, float) for a in (theta_i, theta_r, dphi)])
    _, _, up, aside = _half_vector(theta_i, theta_r, dphi)
    a2 = roughness**2
    cos2 = up / np.maximum(up + aside, 1e-30)
    return 0.25 / (np.pi * a2) * cos2 ** (1.0 / a2 - 1.0)


def slopes_density(
    cos_n: np.ndarray, roughness: float, distribution: str, sine2: np.ndarray | None = None
) -> np.ndarray:
    """D of microfacets whose normals lie at ``cos_n`` from the surface's, 1/sr (Walter et al. 2007)."""
    cos2 = cos_n * cos_n
    density = ggx_density if distribution == "ggx" else beckmann_density
    return density(cos2, 1.0 - cos2 if sine2 is None else sine2, roughness)


def ggx_density(cos2, sine2, roughness):
    """D of microfacets, 1/sr, of the squared cosine and sine of their normals' angle from the surface's."""
    a2 = roughness * roughness
    spread = a2 * cos2 + sine2
    return a2 / (np.pi * (spread * spread))


def beckmann_density(cos2, sine2, roughness):
    """The same of Gaussian slopes."""
    cos2 = np.maximum(cos2, 1e-12)
    a2 = roughness * roughness
    return np.exp(-sine2 / (cos2 * a2)) / (np.pi * a2 * cos2 * cos2)
