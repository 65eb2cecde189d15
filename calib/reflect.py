"""A polished ball as a mirror: where in it a light is seen, and where a ray goes that it reflects."""

from __future__ import annotations

import numpy as np

_STEPS = 12


def mirrored_point(
    center: np.ndarray, radius: float | np.ndarray, eye: np.ndarray, light: np.ndarray
) -> np.ndarray:
    """Point(s) of a ball where ``light`` is seen from ``eye``, (..., 3).

    The normal there halves the angle between the directions to both (Alhazen's problem), found by fixed-point steps,
    which contract by about radius / distance. Inverse of :func:`reflected_ray`.
    """
    normal = _unit(_unit(eye - center) + _unit(light - center))
    for _ in range(_STEPS):
        point = center + radius * normal
        step = _unit(_unit(eye - point) + _unit(light - point))
        done = np.max(np.abs(step - normal), initial=0.0) < 1e-15
        normal = step
        if done:
            break
    return center + radius * normal


def mirrored_direction(
    center: np.ndarray, radius: float | np.ndarray, eye: np.ndarray, toward: np.ndarray
) -> np.ndarray:
    """As :func:`mirrored_point` for a light infinitely far in unit direction ``toward``."""
    normal = _unit(_unit(eye - center) + toward)
    for _ in range(_STEPS):
        normal = _unit(_unit(eye - center - radius * normal) + toward)
    return center + radius * normal


def hit_sphere(eye: np.ndarray, rays: np.ndarray, center: np.ndarray, radius: float) -> np.ndarray:
    """Nearest points (n, 3) of a ball on rays (n, 3) from ``eye``; NaN where a ray misses."""
    offset = np.asarray(eye) - center
    along = rays @ offset
    under = along**2 - offset @ offset + radius**2
    distance = -along - np.sqrt(np.where(under >= 0, under, np.nan))
    return eye + distance[:, None] * rays


def reflected_ray(
    eye: np.ndarray, rays: np.ndarray, center: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 3) on the ball and unit directions (n, 3) in which it sends rays from ``eye``; NaN for misses."""
    points = hit_sphere(eye, rays, center, radius)
    normal = (points - center) / radius
    return points, rays - 2 * np.einsum("ij,ij->i", rays, normal)[:, None] * normal


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)
