"""Integrals over the hemisphere: albedos in closed form, product Gauss rules, projections on the bases."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from reconstruct.modes import QUANTITIES, isotropic_norms
from reconstruct.zernike import zernike_count, zernike_index, zernike_sequence


@lru_cache(maxsize=64)
def hemisphere_rule(count: int) -> tuple[np.ndarray, np.ndarray]:
    """theta (count,) and weights of a Gauss-Legendre rule in cos(theta): sum w g(theta) = integral of g
    sin(theta).

    Exact for polynomials in cos(theta) of degree up to 2 count - 1; with 2 pi / n equal azimuths for
    trigonometric ones below degree n.
    """
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return np.arccos((nodes + 1) / 2)[::-1].copy(), weights[::-1] / 2


def cosine_moments(order: int, power: int) -> np.ndarray:
    """(j,) integrals of Z_j cos(theta)^power over the hemisphere, power 0 or 1, in closed form.

    Only l = 0 survives; cos(theta) = (1 - P_1(2 rho^2 - 1)) / 2 leaves n = 0 and 2.
    """
    moments = np.zeros(zernike_count(max(order, 2)))
    if power == 0:
        moments[0] = np.sqrt(2 * np.pi)
    else:
        moments[0], moments[zernike_index(2, 0)] = np.sqrt(np.pi / 2), -np.sqrt(np.pi / 6)
    return moments[: zernike_count(order)]


def exit_integral(symmetry: str, modes: np.ndarray, coefficients: np.ndarray, power: int) -> np.ndarray:
    """(j, c) coefficients on Z_j(i) of the sum of modes times cos_r^power, integrated over the exit."""
    modes, coefficients = np.asarray(modes, int), np.asarray(coefficients, float)
    order = _order(symmetry, modes)  # before modes with l > 0, perhaps of the highest order, are dropped
    if symmetry == "isotropic":
        kept = modes[:, 2] == 0
        modes, coefficients = modes[kept], coefficients[kept] * isotropic_norms(modes[kept])[:, None]
        j, k = zernike_index(modes[:, 0], 0), zernike_index(modes[:, 1], 0)
    else:
        j, k = zernike_index(modes[:, 0], modes[:, 1]), zernike_index(modes[:, 2], modes[:, 3])
    if symmetry == "reciprocal":
        coefficients = coefficients * np.where(j == k, 0.5, np.sqrt(0.5))[:, None]
    moments = cosine_moments(order, power)
    result = np.zeros((zernike_count(order), coefficients.shape[1]))
    np.add.at(result, j, coefficients * moments[k][:, None])
    if symmetry != "general":
        np.add.at(result, k, coefficients * moments[j][:, None])
    return result


def directional_albedo(symmetry, modes, coefficients, quantity, theta_i, phi_i=0.0) -> np.ndarray:
    """(..., c) fraction of light from (theta_i, phi_i) sent out: the integral of f cos_r dOmega_r."""
    theta_i, phi_i = np.broadcast_arrays(np.asarray(theta_i, float), np.asarray(phi_i, float))
    incident, exit = QUANTITIES[quantity]
    outgoing = exit_integral(symmetry, modes, coefficients, 1 - exit)
    basis = zernike_sequence(_order(symmetry, np.asarray(modes)), theta_i, phi_i)
    return np.einsum("j...,jc->...c", basis, outgoing) / (np.cos(theta_i) ** incident)[..., None]


def bihemispherical_albedo(symmetry, modes, coefficients, quantity) -> np.ndarray:
    """(c,) fraction of even illumination that the sum of modes sends out: integral of f cos_i cos_r / pi."""
    incident, exit = QUANTITIES[quantity]
    outgoing = exit_integral(symmetry, modes, coefficients, 1 - exit)
    return cosine_moments(_order(symmetry, np.asarray(modes)), 1 - incident) @ outgoing / np.pi


def _order(symmetry: str, modes: np.ndarray) -> int:
    columns = [0] if symmetry == "isotropic" else [0, 2]
    return int(modes[:, columns].max(initial=0))


def lobe_albedo(lobe, theta_i) -> np.ndarray:
    """(..., c) directional albedo of a lobe, by a rule graded to its peak."""
    theta_i = np.asarray(theta_i, float)
    flat_i = theta_i.reshape(-1)
    rows = np.stack([_one_lobe_albedo(lobe, angle) for angle in flat_i]) if len(flat_i) else np.empty((0, 0))
    return rows.reshape(*theta_i.shape, -1)


def _one_lobe_albedo(lobe, theta_i: float) -> np.ndarray:
    theta, weight = _graded(min(theta_i, np.pi / 2), np.pi / 2, lobe.roughness)
    turn, share = _graded(0.0, np.pi, lobe.roughness)
    value = lobe.evaluate(theta_i, theta[:, None], np.pi - turn[None, :])
    return 2 * np.einsum("t,p,tpc->c", weight * np.sin(theta) * np.cos(theta), share, value)


def _graded(peak: float, end: float, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights on [0, end]: panels that double in width away from ``peak``, 12 Gauss points each."""
    steps = np.concatenate([[0.0], width * 2.0 ** np.arange(-2, 12)])
    bounds = np.unique(np.clip(np.concatenate([peak - steps, peak + steps]), 0.0, end))
    nodes, weights = np.polynomial.legendre.leggauss(12)
    half = np.diff(bounds)[:, None] / 2
    return (bounds[:-1, None] + half * (nodes + 1)).ravel(), (half * weights).ravel()
