"""Measures of how far one BRDF is from another; formulas and sources in docs/metrics.md.

``a`` is judged, ``b`` is the reference; both are values (n, c), 1/sr, at the same pairs of directions,
and every measure gives one number a channel, (c,). The pairs' weights are their share of dOmega_i dOmega_r.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.modes.angles import unit_vectors

Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]  # incident, exit (n, 3) -> f (n, c)


@dataclass(frozen=True, slots=True)
class Directions:
    """Pairs of directions with their weights."""

    incident: np.ndarray  # (n, 3) unit vectors, tangent frame
    exit: np.ndarray  # (n, 3)
    weight: np.ndarray  # (n,) sr^2, or relative

    @property
    def cos_i(self) -> np.ndarray:
        return self.incident[:, 2]

    @property
    def cos_r(self) -> np.ndarray:
        return self.exit[:, 2]


def quadrature(mask: float, *, isotropic: bool, polar: int = 48, share: int = 6) -> Directions:
    """Gauss-Legendre in both polar angles up to ``mask`` (radians) and, in panels, in the azimuth between them.

    The panels narrow toward the mirror direction and back toward the light, where a gloss is narrow: near grazing
    its width in azimuth is 2 alpha cot(theta). ``share`` nodes each. Isotropic: that azimuth alone, over a whole
    turn. Otherwise the incident azimuth too, at evenly spaced middles, with half as many nodes of each kind.
    """
    if not isotropic:
        polar, share = polar // 2, share // 2
    node, weight = np.polynomial.legendre.leggauss(polar)
    theta, weight = 0.5 * mask * (node + 1.0), 0.5 * mask * weight
    dphi, turn = _graded_turn(share)
    count = 1 if isotropic else polar
    phi_i = (np.arange(count) + 0.5) * 2.0 * np.pi / count if count > 1 else np.zeros(1)
    grids = np.meshgrid(theta, theta, phi_i, dphi, indexing="ij")
    theta_i, theta_r, phi, between = (grid.ravel() for grid in grids)
    cap, even = weight * np.sin(theta), np.full(count, 2.0 * np.pi / count)
    omega = cap[:, None, None, None] * cap[:, None, None] * even[:, None] * turn
    return Directions(unit_vectors(theta_i, phi), unit_vectors(theta_r, phi + between), omega.ravel())


def _graded_turn(share: int) -> tuple[np.ndarray, np.ndarray]:
    """Azimuths over a whole turn and their weights, which add up to 2 pi."""
    edges = np.pi * np.array([0.0, 1 / 64, 1 / 16, 1 / 4, 3 / 4, 15 / 16, 63 / 64, 1.0])
    edges = np.concatenate([edges, 2.0 * np.pi - edges[-2::-1]])
    node, weight = np.polynomial.legendre.leggauss(share)
    half = 0.5 * np.diff(edges)
    place = edges[:-1, None] + half[:, None] * (node + 1.0)
    return place.ravel(), np.multiply.outer(half, weight).ravel()


def relative_l2(a: np.ndarray, b: np.ndarray, at: Directions) -> np.ndarray:
    """sqrt(sum W (a - b)^2 / sum W b^2) with W = weight cos_i cos_r: the project's relative error."""
    weight = (at.weight * at.cos_i * at.cos_r)[:, None]
    return np.sqrt((weight * (a - b) ** 2).sum(0) / (weight * b**2).sum(0))


def ngan_l2(a: np.ndarray, b: np.ndarray, at: Directions) -> np.ndarray:
    """sqrt(sum w (a cos_i - b cos_i)^2 / sum w) with w the solid angles (Ngan, Durand & Matusik 2005)."""
    return _rms((a - b) * at.cos_i[:, None], at)


def standard_log(a: np.ndarray, b: np.ndarray, at: Directions) -> np.ndarray:
    """rms of ln(1 + a cos_i) - ln(1 + b cos_i) (Löw et al. 2012); negative values count as 0."""
    cosine = at.cos_i[:, None]
    return _rms(np.log1p(np.maximum(a, 0) * cosine) - np.log1p(np.maximum(b, 0) * cosine), at)


def cube_root(a: np.ndarray, b: np.ndarray, at: Directions) -> np.ndarray:
    """rms of cbrt(a cos_i) - cbrt(b cos_i) (Fores, Ferwerda & Gu 2012)."""
    cosine = at.cos_i[:, None]
    return _rms(np.cbrt(a * cosine) - np.cbrt(b * cosine), at)


def maximum(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Largest |a - b|, 1/sr."""
    return np.abs(a - b).max(0)


def negative_fraction(f: np.ndarray, at: Directions) -> np.ndarray:
    """Share of the pairs' solid angles where f < 0."""
    return (at.weight[:, None] * (f < 0)).sum(0) / at.weight.sum()


def reciprocity_residual(evaluate: Evaluate, at: Directions) -> np.ndarray:
    """sqrt(sum W (f(i, r) - f(r, i))^2 / sum W f(i, r)^2), W = weight cos_i cos_r."""
    return relative_l2(evaluate(at.exit, at.incident), evaluate(at.incident, at.exit), at)


def directional_albedo(
    evaluate: Evaluate, theta_i: np.ndarray, *, polar: int = 64, share: int = 6
) -> np.ndarray:
    """Integral of f cos_r over the exit hemisphere, (len(theta_i), c), for light at azimuth 0.

    Gauss-Legendre in sin^2 theta_r, exact for a Lambertian surface; azimuths as :func:`quadrature` has them.
    """
    node, weight = np.polynomial.legendre.leggauss(polar)
    theta_r = np.arcsin(np.sqrt(0.5 * (node + 1.0)))
    phi_r, turn = _graded_turn(share)
    theta, phi = (grid.ravel() for grid in np.meshgrid(theta_r, phi_r, indexing="ij"))
    exit = unit_vectors(theta, phi)
    # cos sin dtheta = d(sin^2) / 2, and the nodes' weights add up to 2
    weight = np.multiply.outer(0.25 * weight, turn).ravel()
    rows = [
        weight @ evaluate(np.broadcast_to([np.sin(angle), 0.0, np.cos(angle)], exit.shape).copy(), exit)
        for angle in theta_i
    ]
    return np.array(rows)


def _rms(difference: np.ndarray, at: Directions) -> np.ndarray:
    return np.sqrt((at.weight[:, None] * difference**2).sum(0) / at.weight.sum())
