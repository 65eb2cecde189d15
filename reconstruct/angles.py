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
