"""The lamp's highlight in a mirror ball: found inside the ball's outline, placed to a fraction of a pixel."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from photogonio.calib.detect.gray import gray
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.cones import outline
from photogonio.calib.geometry.mirror import reflected_ray
from photogonio.capture import robust
from photogonio.capture.photoset import MirrorBall
from photogonio.capture.radiance import RadianceImage

_INSIDE = 0.97  # of the outline's radius: what lies nearer the limb is a reflection from grazing
_LARGEST = 0.02  # of the outline's area; a bigger blob is a reflected surface, not a lamp
_CORE = 3  # saturated pixels that make a lamp's core
_BLOB_LEVEL = 0.5  # of the peak above its surroundings


@dataclass(frozen=True, slots=True)
class Highlight:
    """One lamp seen in one mirror ball."""

    ball: int  # index in the manifest
    pixel: np.ndarray  # (2,)
    sigma: float  # standard error of each coordinate, pixels
    peak: float  # radiance above the surroundings
    area: float  # pixels above half the peak
    clipped: bool  # the core is saturated


def find_highlight(
    image: RadianceImage,
    camera: Camera,
    pose: Pose,
    ball: MirrorBall,
    number: int,
    searched: np.ndarray | None = None,
) -> Highlight | None:
    """The brightest small blob inside the ball's outline that a lamp above the board can cause; None if there is
    none. Reflections of the board, the patch and the sample are larger, dimmer, or mirror rays that go down.

    Only ``searched`` pixels (h, w) of :func:`ball_box` count, those of :func:`lamp_pixels` if it is not given.
    """
    x0, y0, x1, y1 = box = ball_box(camera, pose, ball)
    if x1 - x0 < 6 or y1 - y0 < 6:
        return None
    part = _cut(image, box)
    level, saturated = gray(part), part.saturated
    inside = _polygon_mask(_inner(camera, pose, ball) - [x0, y0], level.shape)
    allowed = lamp_pixels(camera, pose, ball) if searched is None else searched
    best = _brightest_blob(level, saturated, allowed, float(inside.sum()))
    if best is None:
        return None
    pixel, sigma, peak, area, clipped = best
    return Highlight(number, pixel + np.array([x0, y0]), sigma, peak, area, clipped)


def pixels_near(camera: Camera, pose: Pose, ball: MirrorBall, place: np.ndarray, within: float) -> np.ndarray:
    """Pixels (h, w) bool of :func:`ball_box`, in the ball's picture and at most ``within`` off ``place`` (2,)."""
    x0, y0, x1, y1 = ball_box(camera, pose, ball)
    y, x = np.mgrid[y0:y1, x0:x1]
    inside = _polygon_mask(_inner(camera, pose, ball) - [x0, y0], x.shape)
    return inside & (np.hypot(x - place[0], y - place[1]) < within)


def lamp_pixels(camera: Camera, pose: Pose, ball: MirrorBall) -> np.ndarray:
    """Pixels (h, w) bool of :func:`ball_box` in which the ball may show a lamp."""
    x0, y0, x1, y1 = ball_box(camera, pose, ball)
    shape = max(y1 - y0, 0), max(x1 - x0, 0)
    if not all(shape):
        return np.zeros(shape, bool)
    inside = _polygon_mask(_inner(camera, pose, ball) - [x0, y0], shape)
    return inside & _sees_upward(camera, pose, ball, (x0, y0), shape)


def _inner(camera: Camera, pose: Pose, ball: MirrorBall) -> np.ndarray:
    return outline(camera, pose, ball.center, ball.radius * _INSIDE)


def ball_box(camera: Camera, pose: Pose, ball: MirrorBall) -> tuple[int, int, int, int]:
    """Columns and rows ``[x0, x1) x [y0, y1)`` of the picture where a ball's highlight is looked for."""
    limb = _inner(camera, pose, ball)
    x0, y0 = np.floor(limb.min(0)).astype(int) - 4
    x1, y1 = np.ceil(limb.max(0)).astype(int) + 5
    width, height = camera.size
    return int(max(x0, 0)), int(max(y0, 0)), int(min(x1, width)), int(min(y1, height))


def _cut(image: RadianceImage, box: tuple[int, int, int, int]) -> RadianceImage:
    """The box's part of a picture that holds it."""
    left, top = image.origin
    part = np.s_[box[1] - top : box[3] - top, box[0] - left : box[2] - left]
    return RadianceImage(
        image.value[part], image.variance[part], image.valid[part], image.saturated[part], box[:2]
    )


def _polygon_mask(polygon: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    mask = np.zeros(shape, np.uint8)
    cv2.fillPoly(mask, [np.round(polygon).astype(np.int32).reshape(-1, 1, 2)], 1)
    return mask > 0


def _sees_upward(
    camera: Camera, pose: Pose, ball: MirrorBall, corner: tuple[int, int], shape: tuple[int, int]
) -> np.ndarray:
    """Pixels whose mirrored ray does not go down into the table, (h, w) bool."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    pixels = np.column_stack([x.ravel() + corner[0], y.ravel() + corner[1]]).astype(float)
    _, direction = reflected_ray(pose.center, camera.world_rays(pose, pixels), ball.center, ball.radius)
    up = np.nan_to_num(direction[:, 2], nan=-1.0).reshape(shape) > 0.0
    return up if up.any() else np.ones(shape, bool)


def _brightest_blob(
    level: np.ndarray, saturated: np.ndarray, allowed: np.ndarray, whole: float
) -> tuple[np.ndarray, float, float, float, bool] | None:
    if not allowed.any():
        return None
    base = float(np.median(level[allowed]))
    noise = float(robust.deviation(level[allowed] - base)) + 1e-9
    rest = np.where(allowed, level - base, 0.0)
    best, first = None, (False, 0.0)
    for _ in range(6):
        y, x = map(int, np.unravel_index(np.argmax(rest), rest.shape))
        peak = float(rest[y, x])
        if peak < 12 * noise or (best is not None and peak < 0.5 * best[2]):
            break
        blob = _grow(level - base, saturated, (y, x), peak)
        rest = np.where(cv2.dilate(blob.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0, 0.0, rest)
        area = float(blob.sum())
        if area > max(_LARGEST * whole, 30.0):
            continue
        # a core that is clipped is brighter than it looks: than all that is not, if it is no single hot pixel
        rank = int((saturated & blob).sum()) >= _CORE, peak * area
        if best is None or rank > first:
            best, first = _measure(level - base, saturated, blob, peak, area), rank
    return best


def _grow(rest: np.ndarray, saturated: np.ndarray, seed: tuple[int, int], peak: float) -> np.ndarray:
    high = ((rest > _BLOB_LEVEL * peak) | saturated).astype(np.uint8)
    _, labels = cv2.connectedComponents(high, connectivity=8)
    return labels == labels[seed]


def _measure(
    rest: np.ndarray, saturated: np.ndarray, blob: np.ndarray, peak: float, area: float
) -> tuple[np.ndarray, float, float, float, bool]:
    """Centroid of the blob with its skirt, whose unclipped pixels tell where within a clipped core the lamp is."""
    skirt = cv2.dilate(blob.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    weight = np.where(skirt, np.clip(rest, 0.0, peak), 0.0)
    y, x = np.mgrid[: rest.shape[0], : rest.shape[1]]
    center = np.array([(weight * x).sum(), (weight * y).sum()]) / weight.sum()
    size = np.sqrt(area / np.pi)
    return center, 0.05 + 0.1 * size, peak, area, bool((saturated & blob).any())
