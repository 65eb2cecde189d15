"""The lamp's image in a mirror ball: a spot smaller than a pixel, laid into the picture as an exact shape."""

from __future__ import annotations

import numpy as np

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.synthetic.render.light import see_lamp
from photogonio.synthetic.render.room import BALL, World
from photogonio.synthetic.render.trace import nearest

LIMB = 48  # corners of the polygon that stands for the lamp's outline
SHOWN_RADIUS = 0.005  # angular radius that a point lamp is given in its mirror image, radians
ITERATIONS = 60


def reflection_points(
    ball: np.ndarray, viewer: np.ndarray, places: np.ndarray, *, distant: bool
) -> np.ndarray:
    """Points (n, 3) of a ball (centre, radius) where ``viewer`` sees the reflections of ``places`` (n, 3).

    ``distant``: places are directions. Fixed point: the normal halves the angle between viewer and place; each
    step errs less by about the radius over the distance.
    """
    center, radius = ball[:3], ball[3]
    point = np.broadcast_to(center, places.shape)
    for _ in range(ITERATIONS):
        toward = unit(places) if distant else unit(places - point)
        point = center + radius * unit(toward + unit(viewer - point))
    return point


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def lamp_limb(lamp: np.ndarray, center: np.ndarray) -> tuple[np.ndarray, float]:
    """The lamp's outline (LIMB, 3) as seen from ``center``, and its radiance over its intensity."""
    distant, place = lamp[0] == 1.0, lamp[1:4]
    axis = place if distant else unit(place - center)
    radius = lamp[4] if lamp[4] > 0 else SHOWN_RADIUS * (1.0 if distant else np.linalg.norm(place - center))
    side = unit(np.cross(axis, [1.0, 0.0, 0.0] if abs(axis[0]) < 0.8 else [0.0, 1.0, 0.0]))
    turn = np.arange(LIMB) * 2.0 * np.pi / LIMB
    # a polygon of the circle's own area
    reach = radius * np.sqrt(2.0 * np.pi / LIMB / np.sin(2.0 * np.pi / LIMB))
    ring = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * np.cross(axis, side)
    return place + reach * ring, float(1.0 / (np.pi * (np.sin(radius) if distant else radius) ** 2))


def clip(polygon: np.ndarray, axis: int, bound: float, sign: float) -> np.ndarray:
    """Part of a convex polygon (n, 2) where sign * (coordinate - bound) >= 0 (Sutherland & Hodgman 1974)."""
    if not len(polygon):
        return polygon
    gap = sign * (polygon[:, axis] - bound)
    following, next_gap = np.roll(polygon, -1, axis=0), np.roll(gap, -1)
    crosses = (gap >= 0) != (next_gap >= 0)
    share = np.where(crosses, gap / np.where(crosses, gap - next_gap, 1.0), 0.0)
    meeting = polygon + share[:, None] * (following - polygon)
    corners = np.stack([polygon, meeting], axis=1)
    return corners[np.stack([gap >= 0, crosses], axis=1)]


def area(polygon: np.ndarray) -> float:
    x, y = polygon[:, 0], polygon[:, 1]
    return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))


def coverage(polygon: np.ndarray, width: int, height: int) -> list[tuple[int, int, float]]:
    """(row, column, covered area) of the pixels that a convex polygon (n, 2) touches."""
    found = []
    low, high = np.floor(polygon.min(0) + 0.5).astype(int), np.floor(polygon.max(0) + 0.5).astype(int)
    for row in range(max(low[1], 0), min(high[1], height - 1) + 1):
        strip = clip(clip(polygon, 1, row - 0.5, 1.0), 1, row + 0.5, -1.0)
        for column in range(max(low[0], 0), min(high[0], width - 1) + 1):
            cell = clip(clip(strip, 0, column - 0.5, 1.0), 0, column + 0.5, -1.0)
            if len(cell) > 2:
                found.append((row, column, area(cell)))
    return found


def add_highlights(world: World, camera: Camera, pose: Pose, image: np.ndarray) -> None:
    """Adds every lamp's mirror image in every ball to ``image`` (h, w, c), unless something is in the way."""
    viewer = pose.center
    for k, lamp in enumerate(world.lamps):
        for b, ball in enumerate(world.balls[1:], start=1):
            limb, per_intensity = lamp_limb(lamp, ball[:3])
            points = reflection_points(ball, viewer, limb, distant=lamp[0] == 1.0)
            middle = points.mean(axis=0)
            middle = ball[:3] + ball[3] * unit(middle - ball[:3])
            kind, index, _ = nearest(world, *np.concatenate([viewer, unit(middle - viewer)]), -1)
            if kind != BALL or index != b:
                continue
            seen = see_lamp(world, k, middle[None], b, -1)[0]
            radiance = seen * ball[4] * per_intensity * world.intensity[k]
            for row, column, part in coverage(camera.project(pose, points), *camera.size):
                image[row, column] += part * radiance
