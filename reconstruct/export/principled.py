"""The materials of engines: a metal, or a dielectric over a diffuse ground, fitted to a measured BRDF.

Engines take no tables. Of what they all know, the parameters nearest to the measurement are found over the directions
that it covers: a grid over the two that are not linear, colours by least squares, and a search from the best.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.export.loss import ANGLES, around, pairs
from photogonio.reconstruct.export.rgb import rgb_order
from photogonio.reconstruct.lobes.schlick import ggx
from photogonio.reconstruct.modes.angles import spherical_angles, unit_vectors

_ROUGHNESS = np.linspace(0.05, 1.0, 16)  # of engines: the square root of GGX alpha
_F0 = np.array([0.0, 0.01, 0.02, 0.03, 0.04, 0.055, 0.08, 0.12])  # of dielectrics, at normal incidence
_MASK = np.radians(80.0)
_ANGLES = np.radians([*ANGLES, 45.0, 80.0])  # of viewers at whom light is counted
_TURNS = np.radians([0.0, 45.0, 90.0, 135.0])  # of the sample, if it counts
_NODES = 20, 32  # of that count, polar and azimuth
_ADDED = 1.002  # light that a material may add to the BRDF's, at most
_PENALTY = 1e5  # times the squared share of light added


@dataclass(frozen=True, slots=True)
class Principled:
    """Parameters of a material; colours linear sRGB."""

    metal: bool
    base_color: np.ndarray  # (3,) diffuse albedo, or the metal's reflectance at normal incidence
    roughness: float  # the square root of GGX alpha
    f0: float  # of the dielectric at normal incidence; 0 without a gloss
    model: Model

    @property
    def ior(self) -> float:
        """Index of refraction that reflects ``f0`` at normal incidence."""
        root = np.sqrt(self.f0)
        return float((1 + root) / (1 - root))

    def __call__(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        """f (n, 3), 1/sr, of unit vectors (n, 3), as the engine's model has it."""
        fixed, linear = self.model(self.metal, self.roughness, self.f0, incident, exit)
        return fixed[:, None] + linear[:, None] * self.base_color


# metal, roughness, f0, incident, exit -> what does not depend on the colour, and what a colour is multiplied by; (n,)
Model = Callable[[bool, float, float, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True, slots=True)
class _Wanted:
    """What a material is to be near to, and what it may send out."""

    incident: np.ndarray  # (n, 3)
    exit: np.ndarray  # (n, 3)
    weight: np.ndarray  # (n,)
    value: np.ndarray  # (n, 3) 1/sr
    light: np.ndarray  # (a, m, 3) directions all round, for each viewer
    viewer: np.ndarray  # (a, m, 3)
    area: np.ndarray  # (a, m) projected solid angles
    most: np.ndarray  # (a, 3) share of even light that may reach each viewer

    @classmethod
    def of(cls, brdf: Brdf) -> _Wanted:
        rng = np.random.default_rng(0)
        incident, exit, weight = pairs(_seen(brdf), rng, isotropic=not brdf.turning, count=6_000)
        light, area = (np.stack(part) for part in zip(*[around(t, *_NODES) for t in _ANGLES], strict=True))
        most = np.full((len(_ANGLES), 3), np.inf)
        for turn in _TURNS if brdf.turning else _TURNS[:1]:
            about = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
            toward = np.repeat((unit_vectors(_ANGLES, 0.0) @ about)[:, None], light.shape[1], axis=1)
            f = rgb(brdf, np.maximum(brdf((light @ about).reshape(-1, 3), toward.reshape(-1, 3)), 0.0))
            most = np.minimum(most, np.einsum("am,amc->ac", area, f.reshape(*light.shape[:2], -1)))
        viewer = np.repeat(unit_vectors(_ANGLES, 0.0)[:, None], light.shape[1], axis=1)
        value = rgb(brdf, np.maximum(brdf(incident, exit), 0.0))
        return cls(incident, exit, weight, value, light, viewer, area, _ADDED * most)

    def nearest(self, model: Model, metal: bool, roughness: float, f0: float) -> tuple[float, np.ndarray]:
        """How far the material is, squared, and its best colour: the brightest that adds no light, if need be."""
        fixed, linear = model(metal, roughness, f0, self.incident, self.exit)
        rest = self.value - fixed[:, None]
        color = (self.weight * linear) @ rest / np.maximum(self.weight @ linear**2, 1e-300)
        sent = model(metal, roughness, f0, self.light.reshape(-1, 3), self.viewer.reshape(-1, 3))
        gloss, ground = ((self.area * one.reshape(self.area.shape)).sum(axis=1)[:, None] for one in sent)
        room = self.most - gloss
        color = np.clip(np.minimum(color, (room / np.maximum(ground, 1e-300)).min(axis=0)), 0.0, 1.0)
        beyond = np.minimum(room - ground * color, 0.0) / self.most  # of the gloss alone
        off = float((self.weight @ (rest - linear[:, None] * color) ** 2).sum())
        return off + _PENALTY * float((beyond**2).max() * (self.weight @ self.value**2).sum()), color


def fit_principled(brdf: Brdf, model: Model) -> Principled:
    """The material nearest to the BRDF, by projected solid angle, where it is valid (at most 80 degrees), of those that
    send no more light to a viewer than the BRDF does."""
    wanted = _Wanted.of(brdf)
    starts = [(False, r, f) for r in _ROUGHNESS for f in _F0] + [(True, r, 0.0) for r in _ROUGHNESS]
    metal, roughness, f0 = min(starts, key=lambda start: wanted.nearest(model, *start)[0])
    found = minimize(
        lambda p: wanted.nearest(model, metal, *p)[0],
        [roughness, f0],
        method="Nelder-Mead",
        bounds=[(0.03, 1.0), (0.0, 0.3 if not metal else 1e-9)],
        options={"xatol": 1e-4, "fatol": 1e-9, "maxfev": 160},
    )
    roughness, f0 = (float(p) for p in found.x)
    return Principled(metal, wanted.nearest(model, metal, roughness, f0)[1], roughness, f0, model)


def rgb(brdf: Brdf, value: np.ndarray) -> np.ndarray:
    """(n, 3) of values (n, c): R, G and B by name; else their mean, gray."""
    order = rgb_order(brdf.channels)
    return np.repeat(value.mean(axis=1, keepdims=True), 3, axis=1) if order is None else value[:, order]


def specular(roughness: float, incident: np.ndarray, exit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) D G2 / (4 cos_i cos_r), and the cosine between half vector and light."""
    (theta_i, phi_i), (theta_r, phi_r) = spherical_angles(incident), spherical_angles(exit)
    lobe = ggx(theta_i, theta_r, phi_r - phi_i, max(roughness**2, 1e-3), 1.0)
    half = incident + exit
    return lobe, np.clip((incident * half).sum(1) / np.maximum(np.linalg.norm(half, axis=1), 1e-12), 0.0, 1.0)


def of_metal(lobe: np.ndarray, cos: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A conductor's gloss by Schlick's reflectance: see :data:`Model`."""
    miss = (1 - cos) ** 5
    return lobe * miss, lobe * (1 - miss)


def schlick(f0: float, cos: np.ndarray) -> np.ndarray:
    """Schlick's reflectance; none at all where ``f0`` is 0."""
    return f0 + (1 - f0) * (1 - cos) ** 5 if f0 > 0 else np.zeros_like(cos)


def _seen(brdf: Brdf) -> float:
    reach = [np.radians(float(brdf.valid.get(key, 80.0))) for key in ("theta_i_max", "theta_r_max")]
    return float(np.clip(min(reach), np.radians(20.0), _MASK))
