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
from photogonio.reconstruct.export.loss import ANGLES, pairs
from photogonio.reconstruct.export.rgb import rgb_order
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.modes.mirror_quadrature import around

_ROUGHNESS = np.linspace(0.05, 1.0, 16)  # of engines: the square root of GGX alpha
_F0 = np.array([0.0, 0.01, 0.02, 0.03, 0.04, 0.055, 0.08, 0.12])  # of dielectrics, at normal incidence
_MASK = np.radians(80.0)
_ANGLES = np.radians([*ANGLES, 45.0, 80.0])  # of viewers at whom light is counted
_TURNS = np.radians([0.0, 45.0, 90.0, 135.0])  # of the sample, if it counts, from its ridges' own on
_NODES, _TURNING_NODES = (20, 32), (10, 20)  # of that count, polar and azimuth; and of a material that turns
_ANISOTROPY, _ROTATION = (0.0, 0.3, 0.6, 0.8), np.radians(np.arange(0.0, 180.0, 22.5))  # that are tried first
_LEAST = 1e-3  # GGX alpha
_ADDED = 1.001  # light that a material may add to the BRDF's, at most
_PENALTY = 1e5  # times the squared share of light added


@dataclass(frozen=True, slots=True)
class Gloss:
    """How rough, and where the wider of two roughnesses lies, as OpenPBR says it."""

    roughness: float  # the square root of GGX alpha
    anisotropy: float = 0.0
    rotation: float = 0.0  # radians from the sample's x

    @property
    def axes(self) -> tuple[float, float]:
        """GGX alpha along the rotation and across (OpenPBR Surface 1.1)."""
        less = 1.0 - self.anisotropy
        along = max(self.roughness**2, _LEAST) * np.sqrt(2.0 / (1.0 + less**2))
        return float(along), float(max(less * along, _LEAST))

    @property
    def mean(self) -> float:
        """GGX alpha, the geometric mean of both."""
        along, across = self.axes
        return float(np.sqrt(along * across))


@dataclass(frozen=True, slots=True)
class Principled:
    """Parameters of a material; colours linear sRGB."""

    metal: bool
    base_color: np.ndarray  # (3,) diffuse albedo, or the metal's reflectance at normal incidence
    roughness: float  # the square root of GGX alpha
    f0: float  # of the dielectric at normal incidence; 0 without a gloss
    model: Model
    anisotropy: float = 0.0  # see :class:`Gloss`
    rotation: float = 0.0

    @property
    def gloss(self) -> Gloss:
        return Gloss(self.roughness, self.anisotropy, self.rotation)

    @property
    def ior(self) -> float:
        """Index of refraction that reflects ``f0`` at normal incidence."""
        root = np.sqrt(self.f0)
        return float((1 + root) / (1 - root))

    def __call__(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        """f (n, 3), 1/sr, of unit vectors (n, 3), as the engine's model has it."""
        seen = Halves.of(incident, exit)
        fixed, linear = self.model(self.metal, self.gloss, self.f0, seen, specular(self.gloss, seen))
        return fixed[:, None] + linear[:, None] * self.base_color


@dataclass(frozen=True, slots=True)
class Halves:
    """Pairs of directions, and what no roughness changes of them."""

    incident: np.ndarray  # (3, n) unit vectors, as all
    exit: np.ndarray
    half: np.ndarray
    cos: np.ndarray  # (n,) between half vector and light
    miss: np.ndarray  # (n,) (1 - cos)^5

    @classmethod
    def of(cls, incident: np.ndarray, exit: np.ndarray) -> Halves:
        """Of unit vectors (n, 3)."""
        incident, exit = np.ascontiguousarray(incident.T), np.ascontiguousarray(exit.T)
        half = incident + exit
        half /= np.maximum(_length(*half), 1e-12)
        cos = np.clip(incident[0] * half[0] + incident[1] * half[1] + incident[2] * half[2], 0.0, 1.0)
        return cls(incident, exit, half, cos, (1 - cos) ** 5)


# metal, gloss, f0, directions, their lobe (n,) -> what does not depend on the colour, and what a colour is multiplied
# by; (n,)
Model = Callable[[bool, Gloss, float, Halves, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True, slots=True)
class _Wanted:
    """What a material is to be near to, and what it may send out."""

    seen: Halves  # n pairs
    weight: np.ndarray  # (n,)
    value: np.ndarray  # (n, 3) 1/sr
    sent: Halves  # a * m pairs: directions all round, for each viewer
    area: np.ndarray  # (a, m) projected solid angles
    most: np.ndarray  # (a, 3) share of even light that may reach each viewer

    @classmethod
    def of(cls, brdf: Brdf, turning: bool) -> _Wanted:
        """For a material that is ``turning``, or one that is to add no light however a BRDF that turns is lit."""
        incident, exit, weight = pairs(
            _seen(brdf), np.random.default_rng(0), isotropic=not brdf.turning, count=6_000
        )
        nodes = _TURNING_NODES if turning else _NODES
        even, area = (np.stack(part) for part in zip(*[around(t, *nodes) for t in _ANGLES], strict=True))
        sides = []
        for turn in _turns(brdf):
            about = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
            toward = np.repeat((unit_vectors(_ANGLES, 0.0) @ about)[:, None], even.shape[1], axis=1)
            f = rgb(brdf, np.maximum(brdf((even @ about).reshape(-1, 3), toward.reshape(-1, 3)), 0.0))
            sent = np.einsum("am,amc->ac", area, f.reshape(*even.shape[:2], -1))
            sides.append((even @ about, toward, area, _ADDED * sent))
        light, viewer, areas, most = (np.concatenate(part) for part in zip(*sides, strict=True))
        if not turning:
            light, viewer, areas = sides[0][:3]
            most = np.min([sent for *_, sent in sides], axis=0)
        value = rgb(brdf, np.maximum(brdf(incident, exit), 0.0))
        all_round = Halves.of(light.reshape(-1, 3), viewer.reshape(-1, 3))
        return cls(Halves.of(incident, exit), weight, value, all_round, areas, most)

    def lobes(self, gloss: Gloss) -> tuple[np.ndarray, np.ndarray]:
        """Of the pairs and of those all round: the dear part, and the same for any reflectance."""
        return specular(gloss, self.seen), specular(gloss, self.sent)

    def nearest(
        self, model: Model, metal: bool, gloss: Gloss, f0: float, lobes: tuple[np.ndarray, np.ndarray]
    ) -> tuple[float, np.ndarray]:
        """How far the material is, squared, and its best colour: the brightest that adds no light, if need be."""
        fixed, linear = model(metal, gloss, f0, self.seen, lobes[0])
        rest = self.value - fixed[:, None]
        color = (self.weight * linear) @ rest / np.maximum(self.weight @ linear**2, 1e-300)
        sent = model(metal, gloss, f0, self.sent, lobes[1])
        lobe, ground = ((self.area * one.reshape(self.area.shape)).sum(axis=1)[:, None] for one in sent)
        room = self.most - lobe
        color = np.clip(np.minimum(color, (room / np.maximum(ground, 1e-300)).min(axis=0)), 0.0, 1.0)
        beyond = np.minimum(room - ground * color, 0.0) / self.most  # of the gloss alone
        off = float((self.weight @ (rest - linear[:, None] * color) ** 2).sum())
        return off + _PENALTY * float((beyond**2).max() * (self.weight @ self.value**2).sum()), color

    def start(self, model: Model, some: slice) -> tuple[bool, Gloss, float]:
        """The nearest of some metals and dielectrics: metal, gloss, f0."""
        tried = []
        for gloss in [Gloss(r) for r in _ROUGHNESS[some]]:
            lobes = self.lobes(gloss)
            for metal, f0 in [(True, 0.0), *((False, f0) for f0 in _F0[some])]:
                tried.append((self.nearest(model, metal, gloss, f0, lobes)[0], metal, gloss, f0))
        return min(tried, key=lambda one: one[:2])[1:]  # of two as near, a dielectric


def fit_principled(brdf: Brdf, model: Model, *, turning: bool = False) -> Principled:
    """The material nearest to the BRDF, by projected solid angle, where it is valid (at most 80 degrees), of those that
    send no more light to a viewer than the BRDF does; with ``turning`` its gloss may have two roughnesses."""
    wanted = _Wanted.of(brdf, turning)

    def nearest(metal: bool, gloss: Gloss, f0: float) -> tuple[float, np.ndarray]:
        return wanted.nearest(model, metal, gloss, f0, wanted.lobes(gloss))

    metal, gloss, f0 = wanted.start(model, slice(None, None, 2 if turning else 1))
    if turning:
        wide = [Gloss(gloss.roughness * k, a, t) for k in (0.8, 1.0) for a in _ANISOTROPY for t in _ROTATION]
        gloss = min(wide, key=lambda one: nearest(metal, one, f0)[0])
    count = 4 if turning else 2
    first = np.array([gloss.roughness, f0, gloss.anisotropy, gloss.rotation])[:count]
    step = np.array(
        [0.05 * gloss.roughness, 0.05 * f0 + 2.5e-4, -0.1 if gloss.anisotropy > 0.5 else 0.1, 0.2]
    )
    found = minimize(
        lambda p: nearest(metal, Gloss(p[0], *p[2:]), p[1])[0],
        first,
        method="Nelder-Mead",
        bounds=[(0.03, 1.0), (0.0, 0.3 if not metal else 1e-9), (0.0, 0.98), (-np.pi, 2.0 * np.pi)][:count],
        options={
            "xatol": 1e-4,
            "fatol": 1e-9,
            "maxfev": 80 * count,
            "initial_simplex": first + np.vstack([np.zeros(count), np.diag(step[:count])]),
        },
    )
    roughness, f0, *turned = (float(p) for p in found.x)
    color = nearest(metal, Gloss(roughness, *turned), f0)[1]
    return Principled(metal, color, roughness, f0, model, *turned)


def rgb(brdf: Brdf, value: np.ndarray) -> np.ndarray:
    """(n, 3) of values (n, c): R, G and B by name; else their mean, gray."""
    order = rgb_order(brdf.channels)
    return np.repeat(value.mean(axis=1, keepdims=True), 3, axis=1) if order is None else value[:, order]


def specular(gloss: Gloss, seen: Halves) -> np.ndarray:
    """(n,) D G2 / (4 cos_i cos_r)."""
    along, across = gloss.axes
    turn = (float(np.cos(gloss.rotation)), float(np.sin(gloss.rotation)))
    x, y, z = _turned(seen.half, turn)
    slopes = (x / along) ** 2 + (y / across) ** 2 + z**2
    x, y, z = _turned(seen.incident, turn)
    light = _length(x * along, y * across, z)
    x, y, z = _turned(seen.exit, turn)
    viewer = _length(x * along, y * across, z)
    masked = np.maximum(seen.exit[2] * light + seen.incident[2] * viewer, 1e-12)
    return 0.5 / (np.pi * along * across * slopes**2 * masked)


def _turned(vectors: np.ndarray, turn: tuple[float, float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The sample's frame to the gloss's, which is turned by the angle of that cosine and sine."""
    cos, sin = turn
    x, y, z = vectors
    return (x, y, z) if sin == 0.0 else (cos * x + sin * y, cos * y - sin * x, z)


def _length(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    return np.sqrt(x * x + y * y + z * z)


def of_metal(lobe: np.ndarray, seen: Halves) -> tuple[np.ndarray, np.ndarray]:
    """A conductor's gloss by Schlick's reflectance: see :data:`Model`."""
    return lobe * seen.miss, lobe * (1 - seen.miss)


def schlick(f0: float, seen: Halves) -> np.ndarray:
    """(n,) Schlick's reflectance; none at all where ``f0`` is 0."""
    return f0 + (1 - f0) * seen.miss if f0 > 0 else np.zeros_like(seen.miss)


def _seen(brdf: Brdf) -> float:
    reach = [np.radians(float(brdf.valid.get(key, 80.0))) for key in ("theta_i_max", "theta_r_max")]
    return float(np.clip(min(reach), np.radians(20.0), _MASK))


def _turns(brdf: Brdf) -> np.ndarray:
    """Azimuths of viewers, radians: along ridges and across them most and least light is sent out."""
    if not brdf.turning:
        return _TURNS[:1]
    lobes = getattr(brdf, "lobes", ())  # tables that are handed on have none
    return np.unique(np.concatenate([_TURNS, *(_TURNS + lobe.azimuth for lobe in lobes if lobe.turning)]))
