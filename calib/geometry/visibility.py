"""Direct light on the board from a lamp that is a small ball, with the shadows of balls that stand in its way."""

from __future__ import annotations

import math

import numpy as np

from photogonio.capture.jit import borrowing, jit

# of the lamp's radius: the width of each of three lines that stand for its disc, and how far the outer two lie from
# the middle, so that the disc's variance is kept
_SMOOTH = 0.25
_APART = math.sqrt(2 * (0.25 - _SMOOTH**2))
_TAIL = 3.5  # standard deviations of a line beyond which nothing is left of it
# of the blur's standard deviation and of the lamp's radius, by which the way to the lamp passes a ball that leaves all
# of it visible
_WIDE, _LAMP = 9.0, 1.5
DIMMEST = 0.05  # of the cosine beside a lamp's axis: nothing is taken for darker


def lit_fraction(
    points: np.ndarray, light: np.ndarray, lamp_radius: float, balls: np.ndarray, blur: float
) -> np.ndarray:
    """The share (n,) of a lamp's disc that ``balls`` (k, 4: centre, radius) leave visible from ``points`` (n, 3).

    ``blur`` (length on the board) is the radius of an even disc over which each point is taken, as a lens does.
    """
    result = np.empty(len(points))
    _lit(points, light, float(lamp_radius), balls, blur * blur / 4, result)
    return result


@borrowing
def _lit(points, light, lamp_radius, balls, spread, result):
    for k in range(len(points)):
        result[k] = share_of(points[k], light, lamp_radius, balls, spread, 0.0, spread)


@borrowing
def share_of(point, light, lamp_radius, balls, xx, xy, yy):
    """Of one point and what lies about it with covariance xx, xy, yy.

    A ball is much larger in angle than the lamp, so its limb cuts the disc along a straight line. Across it the disc is
    a sum of three normal distributions (Gauss's rule for its chords), which blur widens.
    """
    result, wide = 1.0, _WIDE * np.sqrt(xx + yy)
    lx, ly, lz = light[0] - point[0], light[1] - point[1], light[2] - point[2]
    squared = lx * lx + ly * ly + lz * lz
    for j in range(len(balls)):
        bx, by, bz = balls[j, 0] - point[0], balls[j, 1] - point[1], balls[j, 2] - point[2]
        # where the way to the light passes the ball by more than the lamp's radius and the blur, its disc does
        reach, along = balls[j, 3] + _LAMP * lamp_radius + wide, lx * bx + ly * by + lz * bz
        if (bx * bx + by * by + bz * bz - reach * reach) * squared > along * along:
            continue
        far = np.sqrt(squared)
        near = max(np.sqrt(bx * bx + by * by + bz * bz), balls[j, 3] * (1 + 1e-9))
        cosine = along / (far * near)
        if cosine <= 0 or near >= far:
            continue
        sine = balls[j, 3] / near
        apart, limb = np.arccos(min(cosine, 1.0)), np.arcsin(sine)
        # how the angle between limb and lamp changes with the point, along x and y
        turn = np.sqrt(max(1 - cosine * cosine, 1e-12))
        to_lamp, to_ball = (1 / near - cosine / far) / turn, (1 / far - cosine / near) / turn
        to_ball = (to_ball - sine / np.sqrt(1 - sine * sine) / near) / near
        u, v = lx / far * to_lamp + bx * to_ball, ly / far * to_lamp + by * to_ball
        disc, blur = lamp_radius / far, u * u * xx + 2 * u * v * xy + v * v * yy
        width = np.sqrt(_SMOOTH * _SMOOTH * disc * disc + blur)
        outer, over = _APART * disc, apart - limb
        if over >= outer + _TAIL * width:
            continue
        if over <= -outer - _TAIL * width:
            return 0.0
        root = 1 / (math.sqrt(2.0) * width)
        sides = math.erf((over - outer) * root) + math.erf((over + outer) * root)
        result *= 0.5 + 0.25 * math.erf(over * root) + 0.125 * sides
    return result


@borrowing
def passed_by(point, light, lamp_radius, balls, xx, yy, margin):
    """Whether the way from a point to the light passes every ball by ``margin`` more than leaves all of it visible."""
    x, y, z = light[0] - point[0], light[1] - point[1], light[2] - point[2]
    squared, wide = x * x + y * y + z * z, _WIDE * np.sqrt(xx + yy) + _LAMP * lamp_radius + margin
    for j in range(len(balls)):
        u, v, w = balls[j, 0] - point[0], balls[j, 1] - point[1], balls[j, 2] - point[2]
        reach, along = balls[j, 3] + wide, x * u + y * v + z * w
        if (u * u + v * v + w * w - reach * reach) * squared <= along * along:
            return False
    return True


@jit
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


@jit
def log_cosine(points: np.ndarray, light: np.ndarray, aim: np.ndarray) -> np.ndarray:
    """Logarithm (n,) of the cosine between a lamp's axis, which points from ``light`` (3,) at ``aim`` (3,), and its
    rays to ``points`` (n, 3)."""
    result = np.empty(len(points))
    ax, ay, az = aim[0] - light[0], aim[1] - light[1], aim[2] - light[2]
    axis = np.sqrt(ax * ax + ay * ay + az * az)
    for k in range(len(points)):
        x, y, z = points[k, 0] - light[0], points[k, 1] - light[1], points[k, 2] - light[2]
        cosine = (x * ax + y * ay + z * az) / (axis * np.sqrt(x * x + y * y + z * z))
        result[k] = np.log(max(cosine, DIMMEST))
    return result


def behind_ball(points: np.ndarray, eye: np.ndarray, center: np.ndarray, radius: float) -> np.ndarray:
    """Whether a ball stands on the straight line between ``eye`` and each point, (n,) bool."""
    behind = np.empty(len(points), bool)
    _behind(*(np.ascontiguousarray(one, float) for one in (points, eye, center)), float(radius), behind)
    return behind


@jit
def _behind(points, eye, center, radius, behind):
    u, v, w = center[0] - eye[0], center[1] - eye[1], center[2] - eye[2]
    for k in range(len(points)):
        x, y, z = points[k, 0] - eye[0], points[k, 1] - eye[1], points[k, 2] - eye[2]
        along = min(max((x * u + y * v + z * w) / (x * x + y * y + z * z), 0.0), 1.0)
        x, y, z = along * x - u, along * y - v, along * z - w
        behind[k] = x * x + y * y + z * z < radius * radius
