"""Lamps from mirrored rays: a near point by least squares, or a direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.calib.detect.highlights import Highlight
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.mirror import reflected_ray
from photogonio.capture.photoset import MirrorBall

_FAR = 40.0  # a near point farther than so many baselines is called directional


@dataclass(frozen=True, slots=True)
class MirroredRay:
    """One highlight's ray toward the lamp, in the world frame."""

    ball: int
    origin: np.ndarray  # (3,)
    direction: np.ndarray  # (3,) unit
    spread: float  # standard error of the direction, radians


@dataclass(frozen=True, slots=True)
class Place:
    """Where rays meet."""

    kind: str  # "point" | "directional"
    place: np.ndarray  # (3,)
    covariance: np.ndarray  # (3, 3)
    residual: float  # rms miss, length units or radians


def mirrored_ray(
    camera: Camera, pose: Pose, ball: MirrorBall, highlight: Highlight, ball_sigma: float = 0.0
) -> MirroredRay | None:
    """The ray toward the lamp of one highlight; None if its pixel misses the ball.

    The direction turns by twice the normal's angle: pixel error over radius, and the ball's own place ``ball_sigma``.
    """
    ray = camera.world_rays(pose, highlight.pixel[None])
    point, direction = reflected_ray(pose.center, ray, ball.center, ball.radius)
    if not np.isfinite(point).all():
        return None
    distance = np.linalg.norm(point[0] - pose.center)
    across = highlight.sigma * distance / np.sqrt(camera.matrix[0, 0] * camera.matrix[1, 1])
    facing = max(0.2, float(-(ray[0] @ (point[0] - ball.center)) / ball.radius))
    spread = 2 * np.hypot(across, ball_sigma) / (ball.radius * facing)
    return MirroredRay(highlight.ball, point[0], direction[0], float(spread))


def meet(rays: list[MirroredRay], kind: str | None, scale: float) -> Place:
    """Where the rays meet: a point from two or more, a direction from one or if ``kind`` says so.

    ``scale`` is the size of the scene, length units: a point much farther than it, or behind, becomes a direction.
    """
    if len(rays) == 1 or kind == "directional":
        return _direction(rays)
    origin = np.array([r.origin for r in rays])
    toward = np.array([r.direction for r in rays])
    point, normal = _nearest_point(origin, toward, np.array([r.spread for r in rays]))
    offset = point - origin
    ahead = np.einsum("ij,ij->i", offset, toward)
    near = bool((ahead > 0).all() and np.linalg.norm(point - origin.mean(0)) < _FAR * scale)
    if not near and kind is None:
        return _direction(rays)
    miss = np.linalg.norm(offset - ahead[:, None] * toward, axis=1)
    return Place("point", point, np.linalg.inv(normal), float(np.sqrt(np.mean(miss**2))))


def _nearest_point(
    origin: np.ndarray, toward: np.ndarray, spread: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Least squares of the miss distances over their errors (spread times range), iterated for the range."""
    across = np.eye(3) - toward[:, :, None] * toward[:, None, :]
    reach = np.full(len(origin), 1.0)
    for _ in range(5):
        weight = 1.0 / (spread * reach) ** 2
        normal = np.einsum("i,ijk->jk", weight, across) + 1e-12 * weight.sum() * np.eye(3)
        point = np.linalg.solve(normal, np.einsum("i,ijk,ik->j", weight, across, origin))
        reach = np.maximum(np.linalg.norm(point - origin, axis=1), 1e-9)
    return point, normal


def _direction(rays: list[MirroredRay]) -> Place:
    toward = np.array([r.direction for r in rays])
    weight = np.array([r.spread for r in rays]) ** -2.0
    mean = weight @ toward
    mean /= np.linalg.norm(mean)
    off = np.arccos(np.clip(toward @ mean, -1.0, 1.0))
    across = np.eye(3) - np.outer(mean, mean)
    return Place("directional", mean, across / weight.sum(), float(np.sqrt(np.mean(off**2))))
