"""Families of lobes that a fit may try, each as a fixed part plus columns with bounded coefficients.

A mirror lobe is D G F / (4 cos_i cos_r) with slopes of GGX or of Beckmann (Walter et al. 2007). They differ in Smith's
masking G (height-correlated, Heitz 2014; or separable) and in Fresnel's F (Schlick 1994 with a free base reflectance
a channel, as in the coefficient file; or the exact dielectric formula with one index for all channels). A dielectric
lobe is that of a coat: under it lies a diffuse ground, lit and seen through the rough interface, (1 - E(i)) (1 - E(r))
times a free coefficient a channel, E being all that the interface sends back. A turning family has a roughness along
two axes of the sample: the covariance of its slopes is roughness^2 exp(2 E), E = [[e, k], [k, -e]], so that
e = k = 0 is isotropic and nothing is singular there; the roughnesses are roughness exp(+-hypot(e, k)), and the rougher
axis lies at half the azimuth of (e, k). A peak about the light's own direction, or about the mirror direction and as
round and high at any incidence (Phong 1975), or of the half vector about the normal, as high at any incidence (Blinn
1977), has a free weight a channel. Of mirror lobes version 1 of the file knows
only isotropic GGX with height-correlated masking and Schlick's Fresnel:
:mod:`reconstruct.represent.isotropic` says the others in its terms.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from photogonio.reconstruct.lobes.interface import coat_albedo
from photogonio.reconstruct.lobes.kernel import mirror_parts, stretched_parts
from photogonio.reconstruct.lobes.schlick import BLINN_PHONG, RETRO, ROUND, blinn_phong, retro

TYPICAL_F0 = 0.04  # of a dielectric of index 1.5: what is assumed where the scale cannot tell it
ROUGHNESS_BOUNDS = (0.02, 1.0)
F0_BOUNDS = (0.005, 0.3)  # of a dielectric: index 1.15 to 3.4
TURN_BOUNDS = (1.0 / 3.5, 3.5)  # of exp e and exp k: roughnesses that differ by a factor of 12
TURN_NAMES = ("stretch", "skew")  # exp e and exp k: shapes are searched as logarithms


@dataclass(frozen=True, slots=True)
class Family:
    """One kind of lobe."""

    name: str
    fresnel: str  # "schlick" | "dielectric" | "none": a peak, of no interface
    masking: str  # "correlated" | "separable"; of no meaning for a peak
    absolute: bool  # weight 1; else a free weight a channel
    limit: float = np.inf  # of a free weight
    turning: bool = False  # of unequal roughness along two axes of the sample
    distribution: str = (
        "ggx"  # of slopes: "ggx" | "beckmann" | "phong", the cosine power of a peak about the normal
    )
    # of a peak: what lies about what; "light": the exit direction about the light's own, "mirror": about the mirror
    # direction, "normal": the half vector about the normal
    about: str = "light"
    bare: bool = False  # a dielectric lobe of a free weight without a ground of its own

    @property
    def in_file(self) -> bool:
        """Whether the coefficient file says it as it is."""
        own = (self.fresnel, self.masking, self.distribution, self.turning)
        return self.retro or own == ("schlick", "correlated", "ggx", False)

    @property
    def peak(self) -> bool:
        """Whether it is as high at any incidence, without Fresnel's term and masking."""
        return self.fresnel == "none"

    @property
    def retro(self) -> bool:
        return self.peak and self.about == "light"

    @property
    def with_beckmann(self) -> Family:
        """The same with Beckmann's slopes: a peak of the same width with hardly any tails."""
        name = f"{self.name.removesuffix('ggx')}beckmann" if self.peak else f"beckmann-{self.name}"
        return replace(self, name=name, distribution="beckmann")

    @property
    def shape_names(self) -> tuple[str, ...]:
        """The nonlinear parameters, shared by all channels."""
        own = ("roughness", "f0") if self.fresnel == "dielectric" and self.absolute else ("roughness",)
        return own + TURN_NAMES if self.turning else own

    @property
    def coefficient_names(self) -> tuple[str, ...]:
        """The linear coefficients, one each a channel."""
        if self.peak:
            return ("weight",)
        if self.fresnel == "schlick":
            return ("f0",) if self.absolute else ("weight f0", "weight (1 - f0)")
        if self.bare:
            return ("weight",)
        return ("ground",) if self.absolute else ("weight", "ground")

    @property
    def has_ground(self) -> bool:
        """Whether the last coefficient is that of a diffuse ground under the coat."""
        return self.fresnel == "dielectric" and not self.bare

    def upper_bounds(self) -> np.ndarray:
        """Of the coefficients, (q,); all lower bounds are 0."""
        limits = {"f0": 1.0, "ground": np.inf}
        return np.array([limits.get(name, self.limit) for name in self.coefficient_names])


CORRELATED_SCHLICK = Family("correlated-schlick", "schlick", "correlated", True)  # the coefficient file's own
_KINDS = (
    ("schlick", "correlated"),
    ("schlick", "separable"),
    ("dielectric", "correlated"),
    ("dielectric", "separable"),
)


def families(*, absolute: bool, turning: bool = False) -> tuple[Family, ...]:
    """All families; those of a relative scale have a free weight a channel."""
    mark = "anisotropic " if turning else ""
    return tuple(
        Family(f"{mark}{masking}-{fresnel}", fresnel, masking, absolute, turning=turning)
        for fresnel, masking in _KINDS
    )


def retro_lobe(*, absolute: bool) -> Family:
    """A peak about the light's own direction, its weight free, and at most 1 on an absolute scale."""
    return Family(f"{RETRO}ggx", "none", "", False, limit=1.0 if absolute else np.inf)


def round_lobe(*, absolute: bool) -> Family:
    """The same about the mirror direction: round, and as high at any incidence, as that of Phong's model."""
    limit = 1.0 if absolute else np.inf
    return Family(f"{ROUND}ggx", "none", "", False, limit=limit, about="mirror")


def blinn_phong_lobe(*, absolute: bool) -> Family:
    """A cosine power of the half vector: as wide as microfacets, and as high at any incidence (Blinn 1977)."""
    limit = 1.0 if absolute else np.inf
    return Family(BLINN_PHONG, "none", "", False, limit=limit, distribution="phong", about="normal")


def second_lobe(*, absolute: bool) -> Family:
    """What is added to a first lobe: the file's own kind, its weight free, and at most 1 on an absolute scale."""
    return Family("second", "schlick", "correlated", False, limit=1.0 if absolute else np.inf)


def tail_lobe(*, absolute: bool) -> Family:
    """The tails of a gloss whose core is another lobe: of the same interface, so that Fresnel's term is the same."""
    limit = 1.0 if absolute else np.inf
    return Family("tail", "dielectric", "correlated", False, limit=limit, bare=True)


def lobe_columns(
    family: Family,
    shape: np.ndarray,
    theta_i: np.ndarray,
    theta_r: np.ndarray,
    dphi: np.ndarray,
    phi_i: np.ndarray | float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """The fixed part (n,) and the columns (n, q) of a lobe; lobe = fixed + columns @ coefficients, 1/sr.

    ``shape`` holds the nonlinear parameters in the order of ``family.shape_names``. Only a turning family needs
    ``phi_i``, and ``dphi`` with its sign.
    """
    if family.about == "normal":
        column = blinn_phong(theta_i, theta_r, dphi, shape[0])
        return np.zeros_like(column), column[:, None]
    if family.peak:
        turn = np.pi - dphi if family.about == "mirror" else dphi
        column = retro(theta_i, theta_r, turn, shape[0], family.distribution)
        return np.zeros_like(column), column[:, None]
    f0 = shape[1] if family.fresnel == "dielectric" and family.absolute else TYPICAL_F0
    first, second = _mirror_parts(family, shape, f0, theta_i, theta_r, dphi, phi_i)
    if family.fresnel == "schlick" and family.absolute:
        return second, (first - second)[:, None]
    if family.absolute:
        return first, second[:, None]
    if family.bare:
        return np.zeros_like(first), first[:, None]
    return np.zeros_like(first), np.column_stack([first, second])


def turned_roughness(shape: np.ndarray) -> tuple[float, float, float]:
    """Larger and smaller roughness of a turning lobe's ``shape``, and the azimuth in [0, pi) of the larger."""
    e, k = np.log(shape[-2:])
    size = float(np.hypot(e, k))
    azimuth = float(0.5 * np.arctan2(k, e) % np.pi)
    mean = float(shape[0])
    return float(mean * np.exp(size)), float(mean * np.exp(-size)), azimuth


def _mirror_parts(family: Family, shape: np.ndarray, f0: float, theta_i, theta_r, dphi, phi_i) -> np.ndarray:
    """(2, n) D G / (4 cos_i cos_r), and the same times (1 - cos_h)^5; or a coat's lobe, and its ground of albedo 1."""
    separable, beckmann = family.masking == "separable", family.distribution == "beckmann"
    roughness, albedo = float(shape[0]), np.empty((0, 4))
    if family.fresnel == "dielectric":
        albedo = coat_albedo(separable, beckmann, roughness, float(f0))
    angles = np.empty((5 if family.turning else 3, np.broadcast(theta_i, theta_r, dphi).size))
    angles[0], angles[1], angles[2] = theta_i, theta_r, dphi
    if family.turning:
        angles[3], angles[4] = phi_i, phi_i + dphi
    sine2, along = _turned(shape, angles) if family.turning else _STILL
    parts = np.empty((2, angles.shape[1]))
    mirror_parts(angles, separable, beckmann, roughness, float(f0), albedo, sine2, along, parts)
    return parts


_STILL = np.empty(0), np.empty((2, 0))


def _turned(shape: np.ndarray, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of a turning lobe at theta_i, theta_r, dphi, phi_i and phi_r, ``angles`` (5, n): the half vector's squared sine
    (n,) in units of its slopes, the roughness along both directions (2, n)."""
    toward, size2, between = _directions(angles.tobytes())
    sine2, rough = np.empty(len(between)), np.empty(size2.shape)
    e, k = np.log(shape[-2:])
    longer, shorter = _stretch(e, k), _stretch(-e, -k)  # of v^T exp(2 E) v, and of v^T exp(-2 E) v
    stretched_parts(toward, size2, between, longer, shorter, float(shape[0]), sine2, rough)
    return sine2, rough


@lru_cache(maxsize=4)
def _directions(angles: bytes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x and y (2, 2, n) of both directions of such angles, their squared lengths (2, n), and that of the directions'
    sum (n,): searches ask for the same cells again and again."""
    theta_i, theta_r, _, phi_i, phi_r = np.frombuffer(angles).reshape(5, -1)
    (sin_i, sin_r), toward = np.sin([theta_i, theta_r]), np.empty((2, 2, len(theta_i)))
    toward[0, 0], toward[1, 0] = sin_i * np.cos(phi_i), sin_i * np.sin(phi_i)
    toward[0, 1], toward[1, 1] = sin_r * np.cos(phi_r), sin_r * np.sin(phi_r)
    x, y = toward
    between = np.cos(theta_i) * np.cos(theta_r) + x[0] * x[1] + y[0] * y[1]
    return toward, x * x + y * y + 1e-30, np.maximum(2.0 + 2.0 * between, 1e-18)


def _stretch(e: float, k: float) -> tuple[float, float, float]:
    """What x^2, y^2 and x y have in v^T exp(2 E) v of v = (x, y), E = [[e, k], [k, -e]]."""
    size = 2.0 * np.hypot(e, k)
    share = 2.0 * np.sinh(size) / size if size > 0.0 else 2.0
    middle = np.cosh(size)
    return middle + share * e, middle - share * e, 2.0 * share * k
