"""A BRDF from a coefficient file, evaluated from docs/modes.md alone and not by the fitter's code."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import factorial

import numpy as np

from photogonio.synthetic.brdf.lobes import lobe_value
from photogonio.synthetic.brdf.reflectance import PairAngles, Reflectance

COSINES = {"brdf": (0, 0), "brdf_cos": (1, 0), "brdf_cos_cos": (1, 1)}


@lru_cache
def radial_coefficients(n: int, az: int) -> tuple[tuple[int, float], ...]:
    """(power, factor) of Zernike's R_n^az by the factorial sum, in whole numbers until the last step."""
    terms = []
    for s in range((n - az) // 2 + 1):
        below = factorial(s) * factorial((n + az) // 2 - s) * factorial((n - az) // 2 - s)
        terms.append((n - 2 * s, float((-1) ** s * factorial(n - s) // below)))
    return tuple(terms)


def elevation(n: int, az: int, cos: np.ndarray) -> np.ndarray:
    """Theta_n^az = sqrt((n+1) / (2 pi)) R_n^az(sqrt(1 - cos theta)), same shape; to 1e-8 at order 24."""
    rho = np.sqrt(np.maximum(1.0 - cos, 0.0))
    radial = sum(factor * rho**power for power, factor in radial_coefficients(n, abs(az)))
    return np.sqrt((n + 1.0) / (2.0 * np.pi)) * radial


def hemisphere_mode(n: int, az: int, directions: np.ndarray) -> np.ndarray:
    """Real mode Z_n^az (n,) of unit vectors (n, 3); sine for az < 0."""
    phi = np.arctan2(directions[:, 1], directions[:, 0])
    turn = np.cos(az * phi) if az >= 0 else np.sin(-az * phi)
    return np.sqrt(2.0 if az else 1.0) * elevation(n, az, directions[:, 2]) * turn


def isotropic_mode(n: int, m: int, az: int, pairs: PairAngles) -> np.ndarray:
    """S_nm^az (n,), orthonormal over both hemispheres."""
    both = elevation(n, az, pairs.cos_i) * elevation(m, az, pairs.cos_r)
    both += elevation(m, az, pairs.cos_i) * elevation(n, az, pairs.cos_r)
    c2 = (4.0 if n == m else 2.0) * (0.5 if az else 1.0)
    return both * np.cos(az * np.arccos(pairs.cos_dphi)) / np.sqrt(c2)


def general_mode(mode: tuple[int, ...], pairs: PairAngles, *, reciprocal: bool) -> np.ndarray:
    """Z_j(i) Z_k(r), (n,), and made symmetric with its mirror image if ``reciprocal`` and j != k."""
    n, az, n2, az2 = mode
    value = hemisphere_mode(n, az, pairs.incident) * hemisphere_mode(n2, az2, pairs.exit)
    if reciprocal and (n, az) != (n2, az2):
        value += hemisphere_mode(n2, az2, pairs.incident) * hemisphere_mode(n, az, pairs.exit)
        value /= np.sqrt(2.0)
    return value


@dataclass(frozen=True, eq=False)
class Expansion(Reflectance):
    """Sum of modes and lobes, as the coefficient file lists them."""

    symmetry: str  # "isotropic" | "reciprocal" | "general"
    quantity: str  # "brdf" | "brdf_cos" | "brdf_cos_cos"
    modes: tuple[tuple[int, ...], ...]
    coefficients: np.ndarray  # (modes, c)
    lobes: tuple[dict, ...] = ()

    @property
    def isotropic(self) -> bool:  # type: ignore[override]
        return self.symmetry == "isotropic" and not any(np.ndim(one["roughness"]) for one in self.lobes)

    @property
    def reciprocal(self) -> bool:  # type: ignore[override]
        return self.symmetry != "general" and self.quantity != "brdf_cos"

    def above(self, pairs: PairAngles) -> np.ndarray:
        total = np.zeros((len(pairs.cos_i), self.coefficients.shape[1]))
        for mode, coefficient in zip(self.modes, self.coefficients, strict=True):
            total += self.mode(mode, pairs)[:, None] * coefficient
        of_i, of_r = COSINES[self.quantity]
        total /= (pairs.cos_i**of_i * pairs.cos_r**of_r)[:, None]
        for lobe in self.lobes:
            total += lobe_value(lobe, pairs)
        return total

    def mode(self, mode: tuple[int, ...], pairs: PairAngles) -> np.ndarray:
        if self.symmetry == "isotropic":
            n, m, az = mode
            return isotropic_mode(n, m, az, pairs)
        return general_mode(mode, pairs, reciprocal=self.symmetry == "reciprocal")
