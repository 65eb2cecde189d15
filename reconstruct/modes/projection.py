"""Any BRDF as an expansion: coefficients by quadrature, refined until they stand still, with their error.

A BRDF here is a callable ``f(incident, exit) -> (..., c)`` on unit vectors (..., 3) of the tangent frame,
1/sr. Source: Koenderink et al. (1996), section 3: coefficients are integrals of f times the mode over both
hemispheres.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.modes import basis as bases
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.modes.quadrature import azimuth_rule, elevation_rule
from photogonio.reconstruct.modes.zernike import elevation_sequence, radial_index, zernike_sequence

UNBOUNDED = 0.01  # a norm that still grows by more than this in the last step is taken to have no bound
STEPS = 12
TINY = np.finfo(float).tiny

Reflectance = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True, slots=True)
class Projection:
    """Coefficients of a function on a basis, and how much of the function they hold."""

    symmetry: str  # "isotropic" | "chiral" | "reciprocal" | "general"
    order: int
    quantity: str
    modes: np.ndarray  # (m, 3) or (m, 4)
    coefficients: np.ndarray  # (m, c)
    norm: (
        np.ndarray
    )  # (c,) root of the integral of the squared quantity over both hemispheres; inf where it has none
    error: (
        np.ndarray
    )  # (c,) root of the sum of squares of the coefficients' estimated errors, over that of themselves

    @property
    def lost(self) -> np.ndarray:
        """(c,) root of the share of the squared quantity that lies outside the basis: the truncation error.

        Not known (NaN) where the square has no integral. Below about 1e-8 it is rounding.
        """
        held = (self.coefficients**2).sum(0) / np.maximum(self.norm, TINY) ** 2
        return np.where(np.isfinite(self.norm), np.sqrt(np.maximum(1 - held, 0.0)), np.nan)


def project(
    brdf: Reflectance,
    order: int,
    *,
    symmetry: str = "isotropic",
    quantity: str = "brdf",
    tolerance: float = 1e-9,
    evaluations: int = 10_000_000,
) -> Projection:
    """Project a BRDF on all modes up to ``order``, with rules refined until coefficients change by
    ``tolerance``.

    The first rule is exact for expansions of the same order. Later ones have more points, and (isotropic
    and chiral) panels that close in on the mirror direction, the retro-direction and the horizon.
    Refinement stops at ``tolerance``, or before a rule with more than ``evaluations`` pairs; the last
    change is reported as ``error``. What breaks the symmetry or exceeds the order is ``lost``.
    """
    if symmetry not in _PASSES:
        raise ValueError(f"symmetry is {symmetry!r}; it is one of {', '.join(_PASSES)}")
    modes, once, cost = _PASSES[symmetry]
    kept, squared = once(brdf, order, quantity, 0)
    for step in range(1, STEPS):
        before, smaller = kept, squared
        kept, squared = once(brdf, order, quantity, step)
        error = np.sqrt(((kept - before) ** 2).sum(0)) / np.maximum(np.sqrt((kept**2).sum(0)), TINY)
        if error.max(initial=0.0) <= tolerance or cost(order, step + 1) > evaluations:
            break
    growth = np.sqrt(squared / np.maximum(smaller, TINY)) - 1
    norm = np.where(growth > UNBOUNDED, np.inf, np.sqrt(squared))
    return Projection(symmetry, order, quantity, modes(order), kept, norm, error)


def _settings(order: int, step: int) -> dict[str, int]:
    """Of the isotropic rules."""
    if step < 2:
        return {"points": 4 + 6 * step, "more": order, "level": 0}
    return {"points": 4 + step, "more": order, "level": 2 * step - 2}


def _isotropic_cost(order: int, step: int) -> int:
    chosen = _settings(order, step)
    theta, peaked = elevation_rule(**chosen)[0], elevation_rule(**chosen, peak=0.8)[0]
    return 2 * len(theta) * len(peaked) * len(azimuth_rule(**chosen)[0])


def _isotropic(brdf, order, quantity, step):
    product, squared = _azimuthal_products(brdf, order, quantity, step, np.cos)
    modes = bases.isotropic_modes(order)
    p, q = radial_index(modes[:, 0], modes[:, 2]), radial_index(modes[:, 1], modes[:, 2])
    return bases.isotropic_norms(modes)[:, None] * (product[p, q] + product[q, p]), squared


def _chiral(brdf, order, quantity, step):
    product, squared = _azimuthal_products(brdf, order, quantity, step, np.sin)
    modes = bases.chiral_modes(order)
    p, q = radial_index(modes[:, 0], modes[:, 2]), radial_index(modes[:, 1], modes[:, 2])
    return product[p, q] - product[q, p], squared


def _azimuthal_products(brdf, order, quantity, step, wave):
    """(t, t, c) integrals of f Theta_p(i) Theta_q(r) wave(l dphi), l that of q, and (c,) of f^2.

    The incident azimuth is 0 throughout: its integral is a factor 2 pi.
    """
    chosen = _settings(order, step)
    theta_i, weight_i = elevation_rule(**chosen)
    half, share = azimuth_rule(**chosen)
    dphi, weight = np.concatenate([half, -half]), 2 * np.pi * np.concatenate([share, share])
    waves = weight[:, None] * wave(np.outer(dphi, np.arange(order + 1)))
    azimuth = _azimuths(order)
    product, squared = 0.0, 0.0
    for theta, outer, incident in zip(theta_i, weight_i, elevation_sequence(order, theta_i).T, strict=True):
        theta_r, inner = elevation_rule(**chosen, peak=theta)
        value = _values(brdf, quantity, theta, 0.0, theta_r[:, None], dphi[None, :])
        turned = np.einsum("rpc,pl->rlc", value, waves, optimize=True)
        exit = elevation_sequence(order, theta_r) * inner
        row = np.einsum("tr,rtc->tc", exit, turned[:, azimuth], optimize=True)
        product = product + outer * incident[:, None, None] * row[None]
        squared = squared + outer * np.einsum("r,p,rpc->c", inner, weight, value**2, optimize=True)
    return product, squared


def _azimuths(order: int) -> np.ndarray:
    return np.array([l for n in range(order + 1) for l in range(n % 2, n + 1, 2)])


def _pair_rules(order: int, step: int) -> tuple[int, int]:
    """Elevations and azimuths of one hemisphere."""
    grown = order + 2 + (3 * step if step < 2 else 2 ** (step + 1))
    return grown, 2 * grown + 1


def _pair_cost(order: int, step: int) -> int:
    elevations, azimuths = _pair_rules(order, step)
    return (elevations * azimuths) ** 2


def _matrix(brdf, order, quantity, step):
    """(j, j, c) integrals of f Z_j(i) Z_k(r), and (c,) of f^2, by a product rule on both hemispheres."""
    elevations, azimuths = _pair_rules(order, step)
    theta, weight = elevation_rule(elevations)
    phi = 2 * np.pi * (np.arange(azimuths) + 0.5) / azimuths
    theta, phi = (a.ravel() for a in np.meshgrid(theta, phi, indexing="ij"))
    weight = np.repeat(weight, azimuths) * 2 * np.pi / azimuths
    basis = zernike_sequence(order, theta, phi)
    exit = basis * weight
    matrix, squared = 0.0, 0.0
    for part in np.array_split(np.arange(len(theta)), max(1, len(theta) ** 2 // 2_000_000)):
        value = _values(brdf, quantity, theta[part, None], phi[part, None], theta[None], phi[None])
        half = np.einsum("irc,kr->ikc", value, exit, optimize=True)
        matrix = matrix + np.einsum("ji,ikc->jkc", exit[:, part], half, optimize=True)
        squared = squared + np.einsum("i,r,irc->c", weight[part], weight, value**2, optimize=True)
    return matrix, squared


def _general(brdf, order, quantity, step):
    matrix, squared = _matrix(brdf, order, quantity, step)
    j, k = bases.pair_indices(bases.general_modes(order))
    return matrix[j, k], squared


def _reciprocal(brdf, order, quantity, step):
    matrix, squared = _matrix(brdf, order, quantity, step)
    j, k = bases.pair_indices(bases.reciprocal_modes(order))
    return np.where(j == k, 0.5, np.sqrt(0.5))[:, None] * (matrix[j, k] + matrix[k, j]), squared


def _values(brdf, quantity, theta_i, phi_i, theta_r, phi_r) -> np.ndarray:
    value = brdf(unit_vectors(theta_i, phi_i), unit_vectors(theta_r, phi_r))
    return value * bases.cosines(quantity, theta_i, theta_r)[..., None]


_PASSES = {
    "isotropic": (bases.isotropic_modes, _isotropic, _isotropic_cost),
    "chiral": (bases.chiral_modes, _chiral, _isotropic_cost),
    "reciprocal": (bases.reciprocal_modes, _reciprocal, _pair_cost),
    "general": (bases.general_modes, _general, _pair_cost),
}
