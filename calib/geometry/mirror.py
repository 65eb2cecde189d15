"""A polished ball as a mirror: where in it a light is seen, and where a ray goes that it reflects."""

from __future__ import annotations

import numpy as np

from photogonio.capture.jit import borrowing

_STEPS = 12
_SETTLED = 1e-14  # of the normal: rounding


def mirrored_point(
    center: np.ndarray, radius: float | np.ndarray, eye: np.ndarray, light: np.ndarray
) -> np.ndarray:
    """Point(s) of a ball where ``light`` is seen from ``eye``, (..., 3).

    The normal there halves the angle between the directions to both (Alhazen's problem), found by fixed-point steps,
    which contract by about radius / distance. Inverse of :func:`reflected_ray`.
    """
    center, eye, light = np.broadcast_arrays(center, eye, light)
    radii = np.broadcast_to(np.asarray(radius, float), (*center.shape[:-1], 1))
    rows = [np.array(one, float).reshape(-1, one.shape[-1]) for one in (center, eye, light, radii)]
    result = np.empty(rows[0].shape)
    _mirror(*rows, result)
    return result.reshape(center.shape)


@borrowing
def _mirror(centers, eyes, lights, radii, result):
    """The same of rows (n, 3); radii are (n, 1)."""
    for k in range(len(centers)):
        x, y, z = halfway(centers[k], eyes[k], lights[k], radii[k, 0])
        result[k, 0], result[k, 1] = centers[k, 0] + radii[k, 0] * x, centers[k, 1] + radii[k, 0] * y
        result[k, 2] = centers[k, 2] + radii[k, 0] * z


@borrowing
def halfway(center, eye, light, radius):
    """The ball's normal there, of one point; compiled."""
    u, v, w = eye[0] - center[0], eye[1] - center[1], eye[2] - center[2]
    i, j, l = light[0] - center[0], light[1] - center[1], light[2] - center[2]
    x, y, z, reach = 0.0, 0.0, 0.0, 0.0  # first as from the ball's centre
    for _ in range(_STEPS + 1):
        a, b, c = u - reach * x, v - reach * y, w - reach * z
        d, e, f = i - reach * x, j - reach * y, l - reach * z
        near, far = 1.0 / np.sqrt(a * a + b * b + c * c), 1.0 / np.sqrt(d * d + e * e + f * f)
        a, b, c = a * near + d * far, b * near + e * far, c * near + f * far
        length = 1.0 / np.sqrt(a * a + b * b + c * c)
        a, b, c = a * length, b * length, c * length
        moved = max(abs(a - x), abs(b - y), abs(c - z))
        x, y, z, reach = a, b, c, radius
        if moved < _SETTLED:
            break
    return x, y, z


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
