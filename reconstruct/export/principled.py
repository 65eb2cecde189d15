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
from photogonio.reconstruct.export.loss import pairs
from photogonio.reconstruct.export.rgb import rgb_order
from photogonio.reconstruct.lobes.schlick import ggx
from photogonio.reconstruct.modes.angles import spherical_angles

_ROUGHNESS = np.linspace(0.05, 1.0, 16)  # of engines: the square root of GGX alpha
_F0 = np.array([0.0, 0.01, 0.02, 0.03, 0.04, 0.055, 0.08, 0.12])  # of dielectrics, at normal incidence
_MASK = np.radians(80.0)


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


def fit_principled(brdf: Brdf, model: Model) -> Principled:
    """The material nearest to the BRDF, by projected solid angle, where it is valid (at most 80 degrees)."""
    incident, exit, weight = pairs(
        _seen(brdf), np.random.default_rng(0), isotropic=not brdf.turning, count=6_000
    )
    target = rgb(brdf, np.maximum(brdf(incident, exit), 0.0))

    def trial(metal: bool, roughness: float, f0: float) -> tuple[float, np.ndarray]:
        fixed, linear = model(metal, roughness, f0, incident, exit)
        rest = target - fixed[:, None]
        color = (weight * linear) @ rest / np.maximum(weight @ linear**2, 1e-300)
        color = np.clip(color, 0.0, 1.0)
        return float((weight @ (rest - linear[:, None] * color) ** 2).sum()), color

    starts = [(False, r, f) for r in _ROUGHNESS for f in _F0] + [(True, r, 0.0) for r in _ROUGHNESS]
    metal, roughness, f0 = min(starts, key=lambda start: trial(*start)[0])
    found = minimize(
        lambda p: trial(metal, *p)[0],
        [roughness, f0],
        method="Nelder-Mead",
        bounds=[(0.03, 1.0), (0.0, 0.3 if not metal else 1e-9)],
        options={"xatol": 1e-4, "fatol": 1e-9, "maxfev": 160},
    )
    roughness, f0 = (float(p) for p in found.x)
    return Principled(metal, trial(metal, roughness, f0)[1], roughness, f0, model)


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
