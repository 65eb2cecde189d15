"""A lobe as the coefficient file has it: a mirror lobe, a coat over a diffuse ground, or a peak about a direction.

docs/modes.md defines them; :mod:`reconstruct.lobes.families` holds the same lobes as a fit tries them.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from photogonio.reconstruct.lobes.coat import Interface, coat_albedo_of
from photogonio.reconstruct.lobes.even_light import even_light_parts
from photogonio.reconstruct.lobes.lobe_sums import LobeTerms, add_lobe
from photogonio.reconstruct.modes.integrals import POINTS, albedo_by_quadrature
from photogonio.reconstruct.modes.parallel import over_rows
from photogonio.reconstruct.modes.quadrature import elevation_rule

# about the light's own direction, about the mirror direction, and of the half vector about the normal
PEAKS = ("retro", "round", "blinn-phong")
MODELS = ("mirror", "coat", "retro", "round")  # of files
DISTRIBUTIONS = ("ggx", "beckmann")
MASKINGS = ("correlated", "separable")
FRESNELS = ("schlick", "dielectric")


@dataclass(frozen=True, slots=True)
class Lobe:
    """weight D G F / (4 cos_i cos_r), with a ground under a coat; or weight D(psi / 2) / 4 about a direction."""

    roughness: float | tuple[float, float]  # alpha; or along the azimuth, and across
    f0: np.ndarray  # (c,) base reflectance; with the exact dielectric formula all alike; nothing to a peak
    weight: np.ndarray  # (c,)
    model: str = "mirror"  # one of MODELS or of PEAKS
    distribution: str = "ggx"  # of slopes, one of DISTRIBUTIONS; "phong" of a peak about the normal
    masking: str = "correlated"  # one of MASKINGS
    fresnel: str = "schlick"  # one of FRESNELS; a coat's is "dielectric"
    azimuth: float = 0.0  # radians from the sample's x, at which the first of two roughnesses lies
    ground: np.ndarray | None = None  # (c,) albedo of the ground under a coat, seen without it
    extra: dict[str, object] = field(default_factory=dict)  # unknown keys of the file, kept on a round trip

    @property
    def turning(self) -> bool:
        """Whether it changes when the sample is turned."""
        return np.ndim(self.roughness) > 0

    @property
    def peak(self) -> bool:
        """Whether it is a peak about a direction, without Fresnel's term and masking."""
        return self.model in PEAKS

    @property
    def axes(self) -> tuple[float, float]:
        """Roughness along the azimuth, and across."""
        along, across = np.broadcast_to(self.roughness, 2)
        return float(along), float(across)

    @property
    def mean_roughness(self) -> float:
        """The geometric mean of both."""
        along, across = self.axes
        return float(np.sqrt(along * across))

    @property
    def finest(self) -> float:
        """Radians: the width of its narrowest feature."""
        return min(self.axes)

    def evaluate(
        self, theta_i: ArrayLike, theta_r: ArrayLike, dphi: ArrayLike, phi_i: ArrayLike = 0.0
    ) -> np.ndarray:
        """(..., c) BRDF, 1/sr; angles in radians that broadcast together. Only a turning lobe needs ``phi_i``."""
        given = [np.asarray(a, float) for a in (theta_i, phi_i, theta_r, phi_i + np.asarray(dphi))]
        shape = np.broadcast_shapes(*(a.shape for a in given))
        flat = [(a if a.shape == shape else np.broadcast_to(a, shape)).reshape(-1) for a in given]
        result = np.zeros((len(flat[0]), len(self.weight)))
        terms = self.terms()
        over_rows(lambda a, b: add_lobe(terms, [one[a:b] for one in flat], result[a:b]), len(result))
        return result.reshape(*shape, result.shape[1])

    def directional_albedo(
        self, theta_i: ArrayLike, phi_i: float = 0.0, *, points: int = POINTS
    ) -> np.ndarray:
        """(..., c) fraction of the light from (theta_i, phi_i) that the lobe sends out; ``points`` as of
        :func:`.integrals.albedo_by_quadrature`."""
        if self.ground is not None and not self.turning:
            table = coat_albedo_of(self.interface)
            sent = table.at(np.cos(np.asarray(theta_i, float)))[..., None]
            return self.weight * sent + (1.0 - sent) * (1.0 - table.mean) * self.ground
        return albedo_by_quadrature(
            lambda i, r, dphi: self._both_sides(i, r, dphi, phi_i), theta_i, self.finest, points=points
        )

    def bihemispherical_albedo(self) -> np.ndarray:
        """(c,) fraction of even light that the lobe sends out."""
        if self.peak:
            return np.asarray(self.weight, float) * _peak_of_even_light(
                self.roughness, self.model, self.distribution
            )
        terms = self.terms()
        one, other = even_light_parts(self.axes, terms.beckmann, terms.separable, terms.f0)
        if self.ground is not None:  # what enters, twice, of Lambert's f
            other = np.pi * (1.0 - coat_albedo_of(self.interface).mean) ** 2
        return one * terms.factors[0] + other * terms.factors[1]

    def _both_sides(self, theta_i, theta_r, dphi, phi_i: float) -> np.ndarray:
        """Mean of both signs of ``dphi``."""
        if not self.turning:
            return self.evaluate(theta_i, theta_r, dphi)
        return 0.5 * (
            self.evaluate(theta_i, theta_r, dphi, phi_i) + self.evaluate(theta_i, theta_r, -dphi, phi_i)
        )

    @property
    def interface(self) -> Interface:
        """What a coat's own lobe is, whatever its weight."""
        return Interface(
            *self.axes,
            self.azimuth,
            self.distribution == "beckmann",
            self.masking == "separable",
            float(self.f0[0]),
        )

    def only(self, channels: list[int]) -> Lobe:
        """Of some channels alone."""
        ground = None if self.ground is None else self.ground[channels]
        return replace(self, f0=self.f0[channels], weight=self.weight[channels], ground=ground)

    def terms(self) -> LobeTerms:
        """What compiled code takes."""
        weight = np.asarray(self.weight, float)
        if self.peak:
            factors = np.stack([weight, np.zeros_like(weight)])
        elif self.fresnel == "dielectric":
            ground = np.zeros_like(weight) if self.ground is None else np.asarray(self.ground, float) / np.pi
            factors = np.stack([weight, ground])
        else:
            f0 = np.broadcast_to(np.asarray(self.f0, float), weight.shape)
            factors = np.stack([weight * f0, weight * (1.0 - f0)])
        albedo = coat_albedo_of(self.interface) if self.model == "coat" else None
        return LobeTerms(
            axes=np.array([*self.axes, self.azimuth]),
            turning=self.turning,
            peak=self.peak,
            forward=self.model == "round",
            halfway=self.model == "blinn-phong",
            separable=self.masking == "separable",
            beckmann=self.distribution == "beckmann",
            f0=float(self.f0[0]) if self.fresnel == "dielectric" else -1.0,
            table=np.empty(0) if albedo is None else albedo.table,
            entered=albedo.entered if albedo is not None and albedo.turning else None,
            factors=factors,
        )


@lru_cache(maxsize=512)
def _peak_of_even_light(roughness: float | tuple[float, float], model: str, distribution: str) -> float:
    """Share of even light that a peak of weight 1 sends out: once for each shape."""
    one = Lobe(roughness, np.zeros(1), np.ones(1), model=model, distribution=distribution)
    theta, weight = elevation_rule(8, level=6)
    return float(2.0 * (weight * np.cos(theta)) @ one.directional_albedo(theta)[:, 0])
