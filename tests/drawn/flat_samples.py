"""A pale sheet on dark ground, moved from where the manifest has it."""

import cv2
import numpy as np

from photogonio.calib.adjust.flat_sample import moved_points
from photogonio.calib.detect.edges import plane_edges
from photogonio.calib.detect.gray import GrayPart
from photogonio.calib.geometry.camera import Camera
from photogonio.capture.photoset import Plane
from tests.drawn.boards import looking_at

SIZE = (480, 360)
CAMERA = Camera(
    np.array([[700.0, 0, 240.0], [0, 700.0, 181.0], [0, 0, 1]]), np.array([-0.1, 0.05, 0, 0, 0.0]), SIZE
)


PLANE = Plane(np.array([[-35.0, -28], [35, -28], [35, 28], [-35, 28]]), 2.0)
EYES = ((10, -20, 230), (120, 30, 180), (-110, 60, 190), (20, 130, 170), (-30, -140, 160), (90, -90, 190))
POSES = [looking_at(np.array(e, float), np.array([0.0, 0, 2]), 0.2 * k) for k, e in enumerate(EYES)]
FINE = 8
MOVE = np.array([0.4, -0.3, 0.006, 0.5, 0.012, -0.008, -0.04, 0.03])


def photo(pose, values: np.ndarray, noise: float, seed: int) -> np.ndarray:
    """A pale sheet, moved by ``values``, on dark ground, each pixel its covered share."""
    turn = np.linspace(0, 1, 60, endpoint=False)[:, None]
    flat = np.concatenate(
        [a + turn * (b - a) for a, b in zip(PLANE.outline, np.roll(PLANE.outline, -1, axis=0), strict=True)]
    )
    rim = moved_points(np.column_stack([flat, np.full(len(flat), PLANE.height)]), PLANE, values)
    pixels = (CAMERA.project(pose, rim) + 0.5) * FINE - 0.5
    mask = np.zeros((SIZE[1] * FINE, SIZE[0] * FINE), np.uint8)
    cv2.fillPoly(mask, [np.round(pixels * 16).astype(np.int32).reshape(-1, 1, 2)], 255, shift=4)
    level = cv2.resize(mask, SIZE, interpolation=cv2.INTER_AREA).astype(np.float32) / 255 * 0.5 + 0.1
    blurred = cv2.GaussianBlur(level, (0, 0), 0.5)
    return blurred + noise * np.random.default_rng(seed).normal(size=blurred.shape).astype(np.float32)


def seen(values: np.ndarray, poses=POSES):
    usable = np.ones(SIZE[::-1], bool)
    found = [
        (p, plane_edges(GrayPart(photo(p, values, 0.004, k), usable), CAMERA, p, PLANE, 8.0))
        for k, p in enumerate(poses)
    ]
    assert all(e is not None for _, e in found)
    return found
