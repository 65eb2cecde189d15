"""The cone of rays that touches a ball: its outline in a photo, and how far rays lie beside it."""

from __future__ import annotations

import numpy as np

from photogonio.calib.geometry.camera import Camera, Pose


def outline(camera: Camera, pose: Pose, center: np.ndarray, radius: float, count: int = 90) -> np.ndarray:
    """The limb of a ball in the picture, (count, 2) pixels: the tangent cone from the camera's centre."""
    axis = pose.apply(np.asarray(center, float))
    distance = float(np.linalg.norm(axis))
    axis = axis / distance
    across = np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.9 else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across)
    up = np.cross(axis, across)
    half = np.arcsin(min(radius / distance, 1.0))
    turn = np.linspace(0, 2 * np.pi, count, endpoint=False)[:, None]
    rays = np.cos(half) * axis + np.sin(half) * (np.cos(turn) * across + np.sin(turn) * up)
    return camera.project(Pose(np.eye(3), np.zeros(3)), rays)


def cone_residual(rays: np.ndarray, axis: np.ndarray, radius: float, focal_length: float) -> np.ndarray:
    """How far unit rays (n, 3) lie beside a ball's limb, pixels, from its centre ``axis`` (3,) in the camera frame."""
    distance = np.linalg.norm(axis)
    angle = np.arccos(np.clip(rays @ (axis / distance), -1.0, 1.0))
    return focal_length * (angle - np.arcsin(radius / distance))


def cone_derivatives(
    rays: np.ndarray, axis: np.ndarray, radius: float, focal_length: float
) -> tuple[np.ndarray, float]:
    """Derivatives of :func:`cone_residual` by the centre (n, 3) and by the radius."""
    distance = np.linalg.norm(axis)
    toward = axis / distance
    cosine = rays @ toward
    sine = np.sqrt(np.maximum(1 - cosine**2, 1e-18))
    touch = np.sqrt(distance**2 - radius**2)
    by_center = (
        -(rays - cosine[:, None] * toward) / (distance * sine[:, None]) + radius / (distance * touch) * toward
    )
    return focal_length * by_center, -focal_length / touch
