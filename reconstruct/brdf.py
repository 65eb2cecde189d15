"""A measured BRDF: modes and lobes, how sure they are, and the coefficient file (docs/modes.md)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, slots=True)
class Lobe:
    """GGX: weight D G2 F / (4 cos_i cos_r), height-correlated Smith G2, Schlick F."""

    roughness: float  # GGX alpha
    f0: np.ndarray  # (c,) base reflectance
    weight: np.ndarray  # (c,)
    model: str = "ggx"


@dataclass(frozen=True, slots=True)
class Brdf:
    """Sum of all modes (divided by the cosines that ``quantity`` names) and all lobes, 1/sr."""

    order: int
    channels: tuple[str, ...]
    modes: np.ndarray  # (m, 3) n, m, l if isotropic; (m, 4) n, l, n', l' otherwise
    coefficients: np.ndarray  # (m, c)
    standard_errors: np.ndarray  # (m, c)
    quantity: str = "brdf"  # "brdf" | "brdf_cos" | "brdf_cos_cos"
    symmetry: str = "isotropic"  # "isotropic" | "reciprocal" | "general"
    lobes: tuple[Lobe, ...] = ()
    scale: str = "absolute"  # "absolute" | "relative"
    valid: dict[str, float] = field(default_factory=dict)  # theta_i_max, theta_r_max, degrees
    fit: dict[str, object] = field(default_factory=dict)
    source: dict[str, object] = field(default_factory=dict)
    extra: dict[str, object] = field(default_factory=dict)  # unknown keys of the file, kept on a round trip
