"""Glossy models: cosine powers, and rough interfaces of microfacets over a metal or over a diffuse ground."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline

from photogonio.synthetic.brdf.reflectance import Channels, PairAngles, Reflectance, spread


def fresnel(cos: np.ndarray, ior: float) -> np.ndarray:
    """Unpolarised reflectance of a smooth dielectric seen from outside (Fresnel), shape of ``cos``."""
    inside = np.sqrt(1.0 - (1.0 - cos**2) / ior**2)
    across = (cos - ior * inside) / (cos + ior * inside)
    along = (ior * cos - inside) / (ior * cos + inside)
    return 0.5 * (across**2 + along**2)


def schlick(cos: np.ndarray, f0: Channels) -> np.ndarray:
    """Schlick 1994: f0 + (1 - f0)(1 - cos)^5, (n, c)."""
    base = np.asarray(f0, float)
    return base + (1.0 - base) * ((1.0 - cos) ** 5)[:, None]


def normal_reflectance(ior: float) -> float:
    return ((ior - 1.0) / (ior + 1.0)) ** 2


def ggx(pairs: PairAngles, alpha_x: float, alpha_y: float) -> np.ndarray:
    """D G2 / (4 cos_i cos_r), (n,): GGX slopes, height-correlated Smith masking (Walter 2007; Heitz 2014)."""
    x, y, cos = pairs.half[:, 0] / alpha_x, pairs.half[:, 1] / alpha_y, pairs.cos_h
    density = 1.0 / (np.pi * alpha_x * alpha_y * (x * x + y * y + cos * cos) ** 2)

    def slant(v: np.ndarray) -> np.ndarray:
        return np.sqrt(v[:, 2] ** 2 + (alpha_x * v[:, 0]) ** 2 + (alpha_y * v[:, 1]) ** 2)

    shared = pairs.cos_r * slant(pairs.incident) + pairs.cos_i * slant(pairs.exit)
    return 0.5 * density / shared


COAT_ANGLES = np.linspace(0.0, 0.5 * np.pi, 129)  # of incidence, at which a coat's albedo is tabulated


@lru_cache
def coat_albedo(roughness: float, ior: float, approximate: bool) -> CubicSpline:
    """Share of light that a rough clear coat (GGX) reflects, of the angle of incidence: the integral of its lobe times
    cos_r, over half vectors, of which tan^2 = roughness^2 u / (1 - u) takes equal shares of D cos_h for even u."""
    node, weight = np.polynomial.legendre.leggauss(96)
    share, turn = 0.5 * (node + 1.0), (np.arange(96) + 0.5) * np.pi / 96
    tan = roughness * np.sqrt(share / (1.0 - share))
    cos_h = 1.0 / np.sqrt(1.0 + tan**2)
    half = np.stack(
        np.broadcast_arrays(
            np.outer(tan * cos_h, np.cos(turn)), np.outer(tan * cos_h, np.sin(turn)), cos_h[:, None]
        ),
        axis=-1,
    ).reshape(-1, 3)
    part = np.repeat(0.5 * weight, len(turn)) / len(turn)
    value = [
        _reflected(np.array([np.sin(a), 0.0, np.cos(a)]), half, part, roughness, ior, approximate)
        for a in COAT_ANGLES
    ]
    return CubicSpline(COAT_ANGLES, value)


def _reflected(light, half, part, roughness, ior, approximate) -> float:
    """Share of ``light`` (3,) that facets of normals ``half`` (n, 3), ``part`` (n,) of all, send above the horizon."""
    cos_d = half @ light
    exit = 2.0 * cos_d[:, None] * half - light
    up = (cos_d > 0.0) & (exit[:, 2] > 0.0) & (light[2] > 1e-9)
    if not up.any():
        return 1.0
    pairs = PairAngles(np.broadcast_to(light, (int(up.sum()), 3)), exit[up])
    density = roughness**2 / (np.pi * (1.0 + (roughness**2 - 1.0) * pairs.cos_h**2) ** 2)
    reflectance = (
        schlick(cos_d[up], (normal_reflectance(ior),))[:, 0] if approximate else fresnel(cos_d[up], ior)
    )
    lobe = ggx(pairs, roughness, roughness) / density
    return float(np.sum(part[up] * reflectance * lobe * pairs.cos_r * 4.0 * cos_d[up] / pairs.cos_h))


@dataclass(frozen=True)
class Phong(Reflectance):
    """Lambert and a cosine power about the mirror direction (Phong 1975; Lafortune & Willems 1994).

    ``specular`` is the fraction in the lobe at normal incidence, the most of any incidence.
    """

    albedo: Channels = (0.3, 0.3, 0.3)
    specular: float = 0.2
    power: float = 20.0

    def above(self, pairs: PairAngles) -> np.ndarray:
        cos = np.clip(2.0 * pairs.cos_i * pairs.cos_r - pairs.cos_phase, 0.0, 1.0)
        lobe = self.specular * (self.power + 2.0) / (2.0 * np.pi) * cos**self.power
        return spread(np.full_like(lobe, 1.0 / np.pi), self.albedo) + lobe[:, None]


@dataclass(frozen=True)
class BlinnPhong(Reflectance):
    """Lambert and a cosine power of the half vector (Blinn 1977), ``specular`` of all at normal incidence.

    There the integral of cos_h^p cos_r over the hemisphere is 8 pi (2^(-p/2) + p) / ((p+2)(p+4)).
    """

    albedo: Channels = (0.3, 0.3, 0.3)
    specular: float = 0.2
    power: float = 40.0

    def above(self, pairs: PairAngles) -> np.ndarray:
        p = self.power
        norm = (p + 2.0) * (p + 4.0) / (8.0 * np.pi * (2.0 ** (-0.5 * p) + p))
        lobe = self.specular * norm * pairs.cos_h**p
        return spread(np.full_like(lobe, 1.0 / np.pi), self.albedo) + lobe[:, None]


def v_cavity(pairs: PairAngles) -> np.ndarray:
    """Shadowing and masking of long V-grooves, (n,) (Torrance & Sparrow 1967; Blinn 1977)."""
    edge = 2.0 * pairs.cos_h * np.minimum(pairs.cos_i, pairs.cos_r) / np.maximum(pairs.cos_d, 1e-300)
    return np.minimum(edge, 1.0)


@lru_cache
def gaussian_norm(width: float) -> float:
    """Integral of exp(-(d/width)^2) cos d over the hemisphere, by Gauss-Legendre over five widths."""
    top = min(0.5 * np.pi, 6.0 * width)
    node, weight = np.polynomial.legendre.leggauss(128)
    angle = 0.5 * top * (node + 1.0)
    return float(
        np.pi * top * np.sum(weight * np.exp(-((angle / width) ** 2)) * np.cos(angle) * np.sin(angle))
    )


@dataclass(frozen=True)
class TorranceSparrow(Reflectance):
    """Lambert and V-grooves of mirror facets whose angle to the normal is Gaussian (Torrance & Sparrow 1967).

    ``width`` in radians: exp(-(d/width)^2); the facets are of refractive index ``ior``.
    """

    albedo: Channels = (0.3, 0.3, 0.3)
    width: float = 0.25
    ior: float = 1.5

    def above(self, pairs: PairAngles) -> np.ndarray:
        density = np.exp(-((np.arccos(pairs.cos_h) / self.width) ** 2)) / gaussian_norm(self.width)
        mirror = (
            density * v_cavity(pairs) * fresnel(pairs.cos_d, self.ior) / (4.0 * pairs.cos_i * pairs.cos_r)
        )
        return spread(np.full_like(mirror, 1.0 / np.pi), self.albedo) + mirror[:, None]


@dataclass(frozen=True)
class Blinn(Reflectance):
    """Lambert and V-grooves with the ellipsoidal distribution of Trowbridge and Reitz (Blinn 1977).

    ``c3`` is the ellipsoid's eccentricity, 0 a mirror and 1 fully rough; the density is normalised.
    """

    albedo: Channels = (0.3, 0.3, 0.3)
    c3: float = 0.3
    ior: float = 1.5

    def above(self, pairs: PairAngles) -> np.ndarray:
        density = self.c3**2 / (np.pi * (pairs.cos_h**2 * (self.c3**2 - 1.0) + 1.0) ** 2)
        mirror = (
            density * v_cavity(pairs) * fresnel(pairs.cos_d, self.ior) / (4.0 * pairs.cos_i * pairs.cos_r)
        )
        return spread(np.full_like(mirror, 1.0 / np.pi), self.albedo) + mirror[:, None]


@dataclass(frozen=True)
class Conductor(Reflectance):
    """Rough metal: GGX with Schlick's Fresnel from ``f0``; light that meets a second facet is lost."""

    f0: Channels = (0.9, 0.8, 0.6)
    roughness: float = 0.3

    def above(self, pairs: PairAngles) -> np.ndarray:
        return ggx(pairs, self.roughness, self.roughness)[:, None] * schlick(pairs.cos_d, self.f0)


@dataclass(frozen=True)
class AnisotropicConductor(Reflectance):
    """GGX metal of unequal roughness along x and y. On a ball x runs along the circles about board z."""

    isotropic = False
    f0: Channels = (0.9, 0.8, 0.6)
    roughness_x: float = 0.15
    roughness_y: float = 0.4

    def above(self, pairs: PairAngles) -> np.ndarray:
        return ggx(pairs, self.roughness_x, self.roughness_y)[:, None] * schlick(pairs.cos_d, self.f0)


@dataclass(frozen=True)
class BrushedMetal(AnisotropicConductor):
    """Steel brushed along x: smooth along the strokes, rough across."""

    f0: Channels = (0.62, 0.59, 0.56)
    roughness_x: float = 0.06
    roughness_y: float = 0.35


@dataclass(frozen=True)
class Plastic(Reflectance):
    """A rough clear coat (GGX) over a coloured diffuse ground.

    Light enters and leaves through the coat, (1 - E(i))(1 - E(r)), E being all that the rough coat reflects, and
    what it sends back inside is scattered again: diffuse = albedo / (pi n^2 (1 - albedo E_in)), 1 - E_in =
    (1 - E_out) / n^2, so that a white ground returns all that enters. ``approximate``: Schlick instead of Fresnel.
    """

    albedo: Channels = (0.5, 0.3, 0.2)
    roughness: float = 0.2
    ior: float = 1.5
    approximate: bool = False

    def reflected(self, cos: np.ndarray) -> np.ndarray:
        if self.approximate:
            return schlick(cos, (normal_reflectance(self.ior),))[:, 0]
        return fresnel(cos, self.ior)

    def above(self, pairs: PairAngles) -> np.ndarray:
        albedo = np.asarray(self.albedo, float)
        back = coat_albedo(self.roughness, self.ior, self.approximate)
        node, weight = np.polynomial.legendre.leggauss(64)
        cos = 0.5 * (node + 1.0)
        mean = float(np.sum(weight * cos * back(np.arccos(cos))))
        let_out = (1.0 - mean) / self.ior**2
        ground = albedo / (np.pi * self.ior**2 * (1.0 - albedo * (1.0 - let_out)))
        entered_i, entered_r = (
            1.0 - back(np.arccos(np.minimum(cos, 1.0))) for cos in (pairs.cos_i, pairs.cos_r)
        )
        coat = ggx(pairs, self.roughness, self.roughness) * self.reflected(pairs.cos_d)
        return spread(entered_i * entered_r, ground) + coat[:, None]


@dataclass(frozen=True)
class PlasticSchlick(Plastic):
    """:class:`Plastic` with Schlick's Fresnel, as renderers have it."""

    approximate: bool = True


@dataclass(frozen=True)
class SatinPaint(Plastic):
    """Wall paint of a soft sheen."""

    albedo: Channels = (0.72, 0.68, 0.6)
    roughness: float = 0.4


@dataclass(frozen=True)
class GlossyPaint(Reflectance):
    """Lambert under a mirror that returns ``mirror`` of the light at every angle (the seed's figure 2).

    A true mirror lobe is a delta, and shows nothing under a point light; here it is GGX of a small roughness.
    """

    albedo: Channels = (0.5, 0.5, 0.5)
    mirror: float = 0.02
    roughness: float = 0.03

    def above(self, pairs: PairAngles) -> np.ndarray:
        lobe = self.mirror * ggx(pairs, self.roughness, self.roughness)
        return spread(np.full_like(lobe, 1.0 / np.pi), self.albedo) + lobe[:, None]
