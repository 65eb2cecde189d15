"""What stands around the sample and may cover it or shade it: mirror balls and white patches."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.spatial import ConvexHull

from photogonio.calib.setup import Light, ViewSetup
from photogonio.capture.photoset import MirrorBall, Plane, Sphere, WhitePatch

BALL_SLACK = 0.1  # a ball may stand off its place by this part of its radius: all balls are taken as larger
OVERLAP = 0.2  # of the smaller radius: a ball that far inside the sample took its place in a probe photo


def cone_of(eye: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Inward unit normals (n, 3) of the planes through the eye and each edge of a convex polygon (n, 3).

    A unit ray d passes the edge k at the angle asin(normals[k] @ d), positive inside.
    """
    rays = corners - eye
    normals = np.cross(rays, np.roll(rays, -1, axis=0))
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return normals if np.min(normals @ rays.mean(0)) >= 0 else -normals


def balls_beside(balls: tuple[MirrorBall, ...], sample: Sphere | Plane) -> np.ndarray:
    """Centre and radius, with slack, (b, 4) of the balls that stand beside the sample, not in its place."""
    rows = [
        [*ball.center, ball.radius * (1.0 + BALL_SLACK)] for ball in balls if not _in_its_place(ball, sample)
    ]
    return np.array(rows, float).reshape(-1, 4)


def _in_its_place(ball: MirrorBall, sample: Sphere | Plane) -> bool:
    if isinstance(sample, Sphere):
        depth = ball.radius + sample.radius - float(np.linalg.norm(ball.center - sample.center))
        return depth > OVERLAP * min(ball.radius, sample.radius)
    outline = np.asarray(sample.outline, np.float32).reshape(-1, 1, 2)
    above = cv2.pointPolygonTest(outline, (float(ball.center[0]), float(ball.center[1])), False) >= 0
    return above and ball.radius + sample.height - ball.center[2] > OVERLAP * ball.radius


def bounding_ball(sample: Sphere | Plane) -> np.ndarray:
    """Centre and radius (4,) of a ball that holds the sample."""
    if isinstance(sample, Sphere):
        return np.array([*sample.center, sample.radius])
    corners = np.column_stack([sample.outline, np.full(len(sample.outline), sample.height)])
    middle = corners.mean(0)
    return np.array([*middle, np.linalg.norm(corners - middle, axis=1).max()])


def may_cover(balls: np.ndarray, sample: np.ndarray, eye: np.ndarray, margin: float) -> np.ndarray:
    """Those of balls (b, 4) that may come before the ball ``sample`` (4,), or within ``margin`` radians of it."""
    axis, axes = sample[:3] - eye, balls[:, :3] - eye
    distance, distances = np.linalg.norm(axis), np.linalg.norm(axes, axis=1)
    between = np.arccos(np.clip(axes @ axis / (distance * distances), -1.0, 1.0))
    reach = np.arcsin(np.minimum(balls[:, 3] / distances, 1.0)) + np.arcsin(min(sample[3] / distance, 1.0))
    return balls[between < reach + 2.0 * margin]


def may_shade(balls: np.ndarray, sample: np.ndarray, light: Light, lamp_angle: float) -> np.ndarray:
    """Those of balls (b, 4) that may come between the ball ``sample`` (4,) and some of the lamp.

    All lines from the one to the other lie in a cylinder about their axis, as wide as the wider of them.
    """
    toward, _ = light.toward(sample[None, :3])
    offset = balls[:, :3] - sample[:3]
    along = offset @ toward[0]
    miss = np.linalg.norm(offset - along[:, None] * toward[0], axis=1)
    lamp = np.sin(lamp_angle) * (np.abs(along) + sample[3])
    width = max(sample[3], light.radius if light.kind == "point" else 0.0)
    return balls[(along > -(sample[3] + balls[:, 3])) & (miss < width + balls[:, 3] + lamp)]


def patch_cones(
    patches: tuple[WhitePatch, ...], sample: Sphere | Plane, view: ViewSetup, margin: float
) -> tuple[tuple[float, np.ndarray], ...]:
    """Height and cone (see :func:`cone_of`) of each white patch: top, foot and, on a plane, shadow.

    Patches that come nowhere near the sample, seen from the camera, are left out.
    """
    cones = []
    for patch in patches:
        points = _patch_points(patch, sample, view)
        if isinstance(sample, Plane) and patch.height < sample.height - 1e-9:
            continue  # beneath the sample
        in_camera = view.pose.apply(points)
        if np.min(in_camera[:, 2]) <= 0:
            continue  # behind the camera
        middle = points.mean(0)
        around = np.array([[*middle, np.linalg.norm(points - middle, axis=1).max()]])
        if len(may_cover(around, bounding_ball(sample), view.pose.center, margin)) == 0:
            continue
        hull = ConvexHull(in_camera[:, :2] / in_camera[:, 2:]).vertices
        cones.append((float(patch.height), cone_of(view.pose.center, points[hull])))
    return tuple(cones)


def _patch_points(patch: WhitePatch, sample: Sphere | Plane, view: ViewSetup) -> np.ndarray:
    top = np.column_stack([patch.outline, np.full(len(patch.outline), patch.height)])
    if isinstance(sample, Sphere):
        return top
    foot = np.column_stack([patch.outline, np.full(len(patch.outline), sample.height)])
    toward, _ = view.light.toward(top)
    if patch.height <= sample.height or np.min(toward[:, 2]) <= 0.05:
        return np.vstack([top, foot])
    drop = (patch.height - sample.height) / toward[:, 2:]
    return np.vstack([top, foot, top - drop * toward])
