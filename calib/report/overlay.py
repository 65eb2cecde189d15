"""A photo with what calibration found drawn on it."""

from __future__ import annotations

import cv2
import numpy as np

from photogonio.calib.detect.gray import gray
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.cones import outline
from photogonio.calib.setup import Marks, Setup, ViewSetup
from photogonio.capture.photoset import Plane, Sphere
from photogonio.capture.radiance import RadianceImage

CORNER = (60, 220, 60)  # RGB: corners that were used
REJECTED = (255, 70, 60)  # corners and pixels left out
BALL = (255, 210, 40)  # outlines of the mirror balls
SAMPLE = (60, 190, 255)  # outline of the sample
HIGHLIGHT = (255, 60, 255)  # lamps as found, a cross; where they belong, a ring
_BRIGHT = 99.0  # percentile drawn as white
_MAGNIFIED = 100.0  # residuals are drawn so much longer than they are


def mark_view(picture: np.ndarray, setup: Setup, view: ViewSetup) -> None:
    """Corners with their residuals a hundredfold, outlines and highlights, onto a picture (h, w, 3) of the setup's
    camera."""
    for ball in setup.mirror_balls:
        _polygon(picture, outline(setup.camera, view.pose, ball.center, ball.radius), BALL)
    _polygon(picture, _sample_outline(setup.camera, view.pose, setup.sample), SAMPLE)
    if view.marks is not None:
        draw_marks(picture, view.marks)


def white_of(level: np.ndarray) -> float:
    """What of a photo's radiance, ``level`` (h, w), is drawn as white."""
    return float(np.percentile(level[np.isfinite(level)], _BRIGHT)) or 1.0


def picture_of(image: RadianceImage, white: float) -> np.ndarray:
    """(h, w, 3) uint8 RGB: a photo, or a part of it, in square-root tones, pixels that are not valid but bright
    tinted."""
    value = np.nan_to_num(image.value.astype(np.float32))
    color = value if value.shape[2] == 3 else np.repeat(gray(image)[..., None], 3, axis=2)
    picture = (np.sqrt(np.clip(color / white, 0, 1)) * 255).astype(np.uint8)
    rejected = image.saturated | (~image.valid & (gray(image) > 0.05 * white))
    picture[rejected] = (0.5 * picture[rejected] + 0.5 * np.array(REJECTED)).astype(np.uint8)
    return picture


def draw_marks(picture: np.ndarray, marks: Marks) -> None:
    """Corners, limb points and highlights onto a picture (h, w, 3)."""
    size = max(2, picture.shape[1] // 250)
    for pixel, miss in zip(marks.corners, marks.corner_misses, strict=True):
        start = _point(pixel)
        cv2.circle(picture, start, size, CORNER, 1, cv2.LINE_AA)
        cv2.line(picture, start, _point(pixel + _MAGNIFIED * miss), CORNER, 1, cv2.LINE_AA)
    for pixel in marks.rejected_corners:
        cv2.drawMarker(picture, _point(pixel), REJECTED, cv2.MARKER_TILTED_CROSS, 3 * size, 1, cv2.LINE_AA)
    for pixel in marks.limb:
        cv2.circle(picture, _point(pixel), 1, SAMPLE, -1)
    for pixel in marks.highlights:
        cv2.drawMarker(picture, _point(pixel), HIGHLIGHT, cv2.MARKER_CROSS, 3 * size, 1, cv2.LINE_AA)
    for pixel in marks.expected_highlights:
        cv2.circle(picture, _point(pixel), 2 * size, HIGHLIGHT, 1, cv2.LINE_AA)


def _sample_outline(camera: Camera, pose: Pose, sample: Sphere | Plane) -> np.ndarray:
    if isinstance(sample, Sphere):
        return outline(camera, pose, sample.center, sample.radius)
    flat = np.asarray(sample.outline, float)
    return camera.project(pose, np.column_stack([flat, np.full(len(flat), sample.height)]))


def _polygon(picture: np.ndarray, points: np.ndarray, color: tuple[int, int, int]) -> None:
    if np.isfinite(points).all() and np.abs(points).max() < 1e6:
        corners = np.round(points * 16).astype(np.int32).reshape(-1, 1, 2)
        cv2.polylines(picture, [corners], True, color, 1, cv2.LINE_AA, shift=4)


def _point(pixel: np.ndarray) -> tuple[int, int]:
    x, y = np.clip(np.nan_to_num(pixel, nan=-1e4), -1e4, 1e5)
    return round(float(x)), round(float(y))
