"""Direct light on the board from a lamp that is a small ball, with the shadows of balls that stand in its way."""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, error_model="numpy")
def lit_fraction(
    points: np.ndarray, light: np.ndarray, lamp_radius: float, balls: np.ndarray, blur: float
) -> np.ndarray:
    """The share (n,) of a lamp's disc that ``balls`` (k, 4: centre, radius) leave visible from ``points`` (n, 3).

    A ball is much larger in angle than the lamp, so its limb cuts the disc along a straight line. ``blur`` (length at
    the points) widens the edge as a lens does.
    """
    result = np.ones(len(points))
    for k in range(len(points)):
        lx, ly, lz = light[0] - points[k, 0], light[1] - points[k, 1], light[2] - points[k, 2]
        squared = lx * lx + ly * ly + lz * lz
        for j in range(len(balls)):
            bx, by, bz = balls[j, 0] - points[k, 0], balls[j, 1] - points[k, 1], balls[j, 2] - points[k, 2]
            # where the way to the light passes the ball by more than the lamp's radius and the blur, its disc does
            reach, along = balls[j, 3] + lamp_radius + blur, lx * bx + ly * by + lz * bz
            if (bx * bx + by * by + bz * bz - reach * reach) * squared > along * along:
                continue
            far = np.sqrt(squared)
            near = max(np.sqrt(bx * bx + by * by + bz * bz), balls[j, 3] * (1 + 1e-9))
            cosine = along / (far * near)
            if cosine <= 0 or near >= far:
                continue
            disc = np.sqrt((lamp_radius / far) ** 2 + (blur / near) ** 2)
            sine = balls[j, 3] / near
            if cosine < np.sqrt(1 - sine * sine) * (1 - 0.5 * disc * disc) - sine * disc:
                continue  # beyond the ball's limb by more than the disc: no need of the angles
            edge = (np.arccos(min(cosine, 1.0)) - np.arcsin(sine)) / disc
            if edge >= 1:
                continue
            if edge <= -1:
                result[k] = 0.0
                break
            result[k] *= 0.5 + (edge * np.sqrt(1 - edge * edge) + np.arcsin(edge)) / np.pi
    return result


@numba.njit(cache=True, nogil=True, error_model="numpy")
def lit_board(points, light, tone, lamp_radius, balls, blur, bare, shaded):
    """``tone`` (n,) times the direct light on the board's plane: ``bare`` (n,), and ``shaded`` (n,) by ``balls``."""
    straight, share = direct(points, light), lit_fraction(points, light, lamp_radius, balls, blur)
    for k in range(len(points)):
        bare[k] = tone[k] * straight[k]
        shaded[k] = bare[k] * share[k]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def direct(points: np.ndarray, light: np.ndarray) -> np.ndarray:
    """cos / r^2 on the board's plane at ``points`` (n, 3), (n,); zero for a light below it."""
    result = np.zeros(len(points))
    height = light[2]
    if height <= 0:
        return result
    for k in range(len(points)):
        x, y, z = light[0] - points[k, 0], light[1] - points[k, 1], height - points[k, 2]
        squared = x * x + y * y + z * z
        result[k] = z / (squared * np.sqrt(squared))
    return result
