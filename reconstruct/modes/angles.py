"""Directions as angles and as unit vectors, and the angles of a pair of directions.

Tangent frame: z is the outward normal; theta from the normal, phi from x toward y; radians.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def unit_vectors(theta: ArrayLike, phi: ArrayLike) -> np.ndarray:
    """Unit vectors (..., 3) of angles that broadcast together. Inverse of :func:`spherical_angles`."""
    theta, phi = np.asarray(theta, float), np.asarray(phi, float)
    sin = np.sin(theta)
    return np.stack(np.broadcast_arrays(sin * np.cos(phi), sin * np.sin(phi), np.cos(theta)), axis=-1)


def spherical_angles(directions: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Angles theta in [0, pi] and phi in (-pi, pi], each (...,), of vectors (..., 3) of any length.

    Accurate at the pole and at the horizon alike; phi is 0 at the pole. Inverse of :func:`unit_vectors`.
    """
    x, y, z = np.moveaxis(np.asarray(directions, float), -1, 0)
    return np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)


def pair_angles(incident: ArrayLike, exit: ArrayLike) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """theta_i, theta_r and dphi = phi_r - phi_i in (-pi, pi] of vectors (..., 3) that broadcast together.

    dphi is 0 where either direction is the normal.
    """
    incident, exit = np.asarray(incident, float), np.asarray(exit, float)
    theta_i, theta_r = spherical_angles(incident)[0], spherical_angles(exit)[0]
    along = incident[..., 0] * exit[..., 0] + incident[..., 1] * exit[..., 1]
    across = incident[..., 0] * exit[..., 1] - incident[..., 1] * exit[..., 0]
    dphi = np.arctan2(across, along)
    theta_i, theta_r, dphi = np.broadcast_arrays(theta_i, theta_r, dphi)
    return theta_i, theta_r, dphi


def half_difference(incident: np.ndarray, exit: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """theta_half, theta_difference, phi_difference (n,), radians (Rusinkiewicz 1998)."""
    half = incident + exit
    half = half / np.linalg.norm(half, axis=1, keepdims=True)
    theta_h = np.arctan2(np.hypot(half[:, 0], half[:, 1]), half[:, 2])
    phi_h = np.arctan2(half[:, 1], half[:, 0])
    turned = _about_y(_about_z(incident, -phi_h), -theta_h)
    theta_d = np.arctan2(np.hypot(turned[:, 0], turned[:, 1]), turned[:, 2])
    return theta_h, theta_d, np.arctan2(turned[:, 1], turned[:, 0])


def from_half_difference(
    theta_h: np.ndarray, theta_d: np.ndarray, phi_d: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Incident and exit unit vectors (n, 3), half vector at azimuth 0. Inverse: :func:`half_difference`."""
    sine = np.sin(theta_d)
    difference = np.column_stack([sine * np.cos(phi_d), sine * np.sin(phi_d), np.cos(theta_d)])
    opposite = difference * np.array([-1.0, -1.0, 1.0])
    return _about_y(difference, theta_h), _about_y(opposite, theta_h)


def _about_z(v: np.ndarray, angle: np.ndarray) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * v[:, 0] - s * v[:, 1], s * v[:, 0] + c * v[:, 1], v[:, 2]])


def _about_y(v: np.ndarray, angle: np.ndarray) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * v[:, 0] + s * v[:, 2], v[:, 1], c * v[:, 2] - s * v[:, 0]])
