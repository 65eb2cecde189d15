"""Integrals over the hemisphere: albedos, in closed form or by quadrature, and the mirror's coefficients."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.modes.basis import QUANTITIES, isotropic_norms
from photogonio.reconstruct.modes.quadrature import azimuth_rule, elevation_rule
from photogonio.reconstruct.modes.zernike import zernike_count, zernike_index, zernike_sequence

POINTS = 10  # a panel: 1e-7 for what is smooth in panels of a quarter of its width


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


def directional_albedo(
    symmetry: str,
    modes: np.ndarray,
    coefficients: np.ndarray,
    quantity: str,
    theta_i: ArrayLike,
    phi_i: ArrayLike = 0.0,
) -> np.ndarray:
    """(..., c) fraction of light from (theta_i, phi_i) sent out: the integral of f cos_r dOmega_r."""
    theta_i, phi_i = np.broadcast_arrays(np.asarray(theta_i, float), np.asarray(phi_i, float))
    incident, exit = QUANTITIES[quantity]
    outgoing = exit_integral(symmetry, modes, coefficients, 1 - exit)
    basis = zernike_sequence(_order(symmetry, np.asarray(modes)), theta_i, phi_i)
    return np.einsum("j...,jc->...c", basis, outgoing) / (np.cos(theta_i) ** incident)[..., None]


def bihemispherical_albedo(
    symmetry: str, modes: np.ndarray, coefficients: np.ndarray, quantity: str
) -> np.ndarray:
    """(c,) fraction of even illumination that the sum of modes sends out: integral of f cos_i cos_r / pi."""
    incident, exit = QUANTITIES[quantity]
    outgoing = exit_integral(symmetry, modes, coefficients, 1 - exit)
    return cosine_moments(_order(symmetry, np.asarray(modes)), 1 - incident) @ outgoing / np.pi


def albedo_by_quadrature(
    value: Callable[..., np.ndarray], theta_i: ArrayLike, finest: float, *, points: int = POINTS
) -> np.ndarray:
    """(..., c) directional albedo of ``value(theta_i, theta_r, dphi) -> (..., c)``, even in dphi, whatever its form.

    ``finest`` (radians) is the width of its narrowest feature, a peak in the mirror or retro-direction or at grazing
    angles: panels of ``points`` Gauss points close in on those to a quarter of it.
    """
    theta_i = np.asarray(theta_i, float)
    level = max(2, int(np.ceil(np.log2(4 / finest))))
    dphi, weight = azimuth_rule(points, level=level)
    result = np.empty((theta_i.size, value(0.0, 0.0, 0.0).shape[-1]))
    for row, angle in zip(result, theta_i.ravel(), strict=True):
        theta_r, inner = elevation_rule(points, level=level, peak=angle)
        given = value(angle, theta_r[:, None], dphi[None, :])
        row[:] = inner * np.cos(theta_r) @ (2.0 * weight @ given)
    return result.reshape(*theta_i.shape, result.shape[1])


def albedo_of(
    brdf: Callable[..., np.ndarray], theta_i: ArrayLike, phi_i: float = 0.0, *, finest: float = 0.02
) -> np.ndarray:
    """(..., c) directional albedo of any callable BRDF on unit vectors; see :func:`albedo_by_quadrature`."""

    def value(incident: np.ndarray, exit: np.ndarray, dphi: np.ndarray) -> np.ndarray:
        left, right = (unit_vectors(exit, phi_i + sign * dphi) for sign in (1.0, -1.0))
        toward = unit_vectors(incident, phi_i)
        return 0.5 * (brdf(toward, left) + brdf(toward, right))

    return albedo_by_quadrature(value, theta_i, finest)


def mirror_coefficients(
    modes: np.ndarray, reflectance: float = 1.0, quantity: str = "brdf_cos"
) -> np.ndarray:
    """(m,) coefficients of a perfect mirror on isotropic modes (m, 3), in closed form.

    A mirror's q = f cos_i is reflectance times a delta at the mirror direction, so a_nml is 2 (-1)^l / c times the
    integral of Theta_n Theta_m over the hemisphere: a flat spectrum, 1 for l = 0 and sqrt(2) (-1)^l for l > 0 where
    n = m, and 0 elsewhere. For f cos_i cos_r a cosine more stands in the integral; Jacobi's recurrence for
    cos(theta) = (1 - z) / 2 then couples n to m = n - 2 also. f itself has no expansion: the integral of
    Theta^2 / cos(theta) has no bound.
    """
    n, m, l = np.asarray(modes).T
    sign = np.where(l % 2, -1.0, 1.0) * 2 * isotropic_norms(modes) * reflectance
    if quantity == "brdf_cos":
        return sign * (n == m)
    if quantity != "brdf_cos_cos":
        raise ValueError(f"quantity is {quantity!r}; a mirror has coefficients for brdf_cos and brdf_cos_cos")
    same = 0.5 * (1 - np.where(n > 0, l**2 / np.maximum(n * (n + 2.0), 1), 0.0))
    next_ = -0.25 * (n**2 - l**2) / np.maximum(n * np.sqrt(n**2 - 1.0 * (n > 0)), 1)
    return sign * np.where(n == m, same, np.where(m == n - 2, next_, 0.0))


def _order(symmetry: str, modes: np.ndarray) -> int:
    columns = [0] if symmetry == "isotropic" else [0, 2]
    return int(modes[:, columns].max(initial=0))
