"""Matte models: Lambert, Minnaert, Oepik, Oren-Nayar, and a back-scattering hot spot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.synthetic.brdf.reflectance import Channels, PairAngles, Reflectance, spread


@dataclass(frozen=True)
class Lambert(Reflectance):
    """A perfect diffuser: albedo / pi."""

    albedo: Channels = (0.5, 0.5, 0.5)

    def above(self, pairs: PairAngles) -> np.ndarray:
        return spread(np.full_like(pairs.cos_i, 1.0 / np.pi), self.albedo)


@dataclass(frozen=True)
class Minnaert(Reflectance):
    """albedo (k+1)/(2 pi) (cos_i cos_r)^(k-1) (Minnaert 1941).

    Its directional albedo is albedo cos_i^(k-1), so for k < 1 more than all light returns near grazing: a
    description of the moon, not a law of nature.
    """

    albedo: Channels = (0.5, 0.5, 0.5)
    k: float = 0.7

    def above(self, pairs: PairAngles) -> np.ndarray:
        power = (pairs.cos_i * pairs.cos_r) ** (self.k - 1.0)
        return spread((self.k + 1.0) / (2.0 * np.pi) * power, self.albedo)


@dataclass(frozen=True)
class Oepik(Reflectance):
    """albedo / pi cos_i^(k-1): exit radiance as cos_i^k in every direction (after Oepik 1924).

    Reciprocal only for k = 1; Minnaert's law is this one made reciprocal. The
    directional albedo is albedo cos_i^(k-1).
    """

    reciprocal = False
    albedo: Channels = (0.5, 0.5, 0.5)
    k: float = 1.4

    def above(self, pairs: PairAngles) -> np.ndarray:
        return spread(pairs.cos_i ** (self.k - 1.0) / np.pi, self.albedo)


@dataclass(frozen=True)
class OrenNayar(Reflectance):
    """V-grooves of Lambertian facets with shadowing, masking and one interreflection (Oren & Nayar 1994).

    ``sigma`` is the standard deviation of the facets' slope angle, radians.
    """

    albedo: Channels = (0.5, 0.5, 0.5)
    sigma: float = 0.5

    def above(self, pairs: PairAngles) -> np.ndarray:
        albedo, s2 = np.asarray(self.albedo, float), self.sigma**2
        theta_i, theta_r = np.arccos(np.minimum(pairs.cos_i, 1.0)), np.arccos(np.minimum(pairs.cos_r, 1.0))
        alpha, beta, cos_dphi = np.maximum(theta_i, theta_r), np.minimum(theta_i, theta_r), pairs.cos_dphi
        steep = 2.0 * beta / np.pi
        c1 = 1.0 - 0.5 * s2 / (s2 + 0.33)
        c2 = 0.45 * s2 / (s2 + 0.09) * (np.sin(alpha) - np.where(cos_dphi < 0, steep**3, 0.0))
        c3 = 0.125 * s2 / (s2 + 0.09) * (4.0 * alpha * beta / np.pi**2) ** 2
        direct = (
            c1 + cos_dphi * c2 * np.tan(beta) + (1.0 - np.abs(cos_dphi)) * c3 * np.tan(0.5 * (alpha + beta))
        )
        twice = 0.17 * s2 / (s2 + 0.13) * (1.0 - cos_dphi * steep**2)
        return (spread(direct, albedo) + spread(twice, albedo**2)) / np.pi


@dataclass(frozen=True)
class OrenNayarQualitative(Reflectance):
    """The short form, without interreflection (Oren & Nayar 1994): A + B max(0, cos dphi) sin a tan b."""

    albedo: Channels = (0.5, 0.5, 0.5)
    sigma: float = 0.5

    def above(self, pairs: PairAngles) -> np.ndarray:
        s2 = self.sigma**2
        low, high = np.minimum(pairs.cos_i, pairs.cos_r), np.maximum(pairs.cos_i, pairs.cos_r)
        sin_tan = np.sqrt(np.maximum(1.0 - low**2, 0.0)) * np.sqrt(np.maximum(1.0 - high**2, 0.0)) / high
        a, b = 1.0 - 0.5 * s2 / (s2 + 0.33), 0.45 * s2 / (s2 + 0.09)
        return spread((a + b * np.maximum(pairs.cos_dphi, 0.0) * sin_tan) / np.pi, self.albedo)


@dataclass(frozen=True)
class RetroReflector(Reflectance):
    """A diffuse ground and a cosine-power lobe around the light's own direction: the hot spot of a road sign.

    ``retro`` is the fraction returned in the lobe at normal incidence; ``power`` its sharpness.
    """

    albedo: Channels = (0.3, 0.3, 0.3)
    retro: float = 0.3
    power: float = 40.0

    def above(self, pairs: PairAngles) -> np.ndarray:
        lobe = (self.power + 2.0) / (2.0 * np.pi) * np.maximum(pairs.cos_phase, 0.0) ** self.power
        return spread(np.full_like(lobe, 1.0 / np.pi), self.albedo) + self.retro * lobe[:, None]
