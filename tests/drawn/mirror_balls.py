"""Two polished balls before a camera, a lamp, and where it shows in them."""

import numpy as np

from photogonio.calib.detect.highlights import Highlight
from photogonio.calib.detect.mirror_rays import MirroredRay, mirrored_ray
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.geometry.mirror import mirrored_point
from photogonio.capture.photoset import MirrorBall
from tests.drawn.boards import looking_at

SIZE = (640, 480)
CAMERA = Camera(
    np.array([[900.0, 0, 318.0], [0, 900.0, 241.0], [0, 0, 1]]),
    np.array([-0.1, 0.05, 3e-4, -2e-4, 0.0]),
    SIZE,
)


BALLS = (MirrorBall(np.array([-60.0, 5, 12]), 12.0), MirrorBall(np.array([60.0, -8, 12]), 12.0))
POSE = looking_at(np.array([10.0, -220, 330]), np.array([0.0, 0, 8]))
LAMP = np.array([150.0, 80, 420])
LAMPS = [LAMP, np.array([-300.0, 100, 150]), np.array([5.0, -350, 400])]


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def highlight(number: int, lamp: np.ndarray, off: np.ndarray | float = 0.0) -> Highlight:
    """Where a lamp shows, moved by ``off`` pixels."""
    ball = BALLS[number]
    point = mirrored_point(ball.center, ball.radius, POSE.center, lamp)
    return Highlight(number, CAMERA.project(POSE, point[None])[0] + off, 0.1, 1.0, 4.0, False)


def ray(number: int, lamp: np.ndarray, off: np.ndarray | float = 0.0) -> MirroredRay:
    found = mirrored_ray(CAMERA, POSE, BALLS[number], highlight(number, lamp, off))
    assert found is not None
    return found


def miss(one: MirroredRay, place: np.ndarray) -> float:
    """Distance of a place from a ray."""
    return float(np.linalg.norm(np.cross(place - one.origin, one.direction)))


def spot(pixel: np.ndarray, width: float, peak: float) -> np.ndarray:
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    return peak * np.exp(-0.5 * ((x - pixel[0]) ** 2 + (y - pixel[1]) ** 2) / width**2)
