"""The board's print as a photometric target: radiance of places of even white or black, clear of every edge."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from photogonio.calib.geometry.board import board_size
from photogonio.calib.geometry.camera import Camera, Pose, project_with_scale, projected_with_axes
from photogonio.calib.geometry.print_map import draw_print, square_pitch
from photogonio.calib.geometry.visibility import behind_ball
from photogonio.capture.photoset import MirrorBall, PhotoSet, Plane, Sphere, WhitePatch
from photogonio.capture.radiance import RadianceImage

_CLEAR_WHITE = 2.3  # pixels of the photo between a sample and the next printed edge
_CLEAR_BLACK = 3.3  # the same for black print, which little stray white lights up
# what blurs a sample, variances in pixels squared: a lens, about, a pixel's own width, and reading between four
_LENS, _PIXEL, _BETWEEN = 0.25, 1 / 12, 1 / 6


@dataclass(frozen=True, slots=True)
class PaperSamples:
    """Radiance of the paper at places of one tone, in one photo."""

    points: np.ndarray  # (n, 3) world
    white: np.ndarray  # (n,) bool; else black print
    value: np.ndarray  # (n, c) radiance
    variance: np.ndarray  # (n, c)
    square: np.ndarray  # (n,) int, the square of the board a sample lies in: errors within one go together
    spread: np.ndarray | None = None  # (n, 3) as of :func:`spread_of`; None: points
    aside: np.ndarray | None = (
        None  # (n,) as of :meth:`calib.geometry.camera.Camera.aside`; None: nothing is known of it
    )

    def __len__(self) -> int:
        return len(self.points)

    def keep(self, mask: np.ndarray) -> PaperSamples:
        return PaperSamples(
            self.points[mask],
            self.white[mask],
            self.value[mask],
            self.variance[mask],
            self.square[mask],
            None if self.spread is None else self.spread[mask],
            None if self.aside is None else self.aside[mask],
        )


@dataclass(frozen=True, slots=True)
class PaperPlaces:
    """Where paper is read, of the camera at one place."""

    points: np.ndarray  # (n, 3) world
    white: np.ndarray  # (n,) bool
    pixels: np.ndarray  # (n, 2)
    square: np.ndarray  # (n,) int
    spread: np.ndarray  # (n, 3)
    aside: np.ndarray  # (n,)


def paper_places(
    photoset: PhotoSet,
    camera: Camera,
    pose: Pose,
    *,
    step: float,
    apart: float,
    clear_of_edges: tuple[float, float] = (_CLEAR_WHITE, _CLEAR_BLACK),
) -> PaperPlaces | None:
    """A grid of pitch ``step`` over the board, where the print is even, white and black so many pixels clear of its
    edges, nothing stands before it, and mirror balls are ``apart`` of their radii away."""
    board, balls = photoset.board, photoset.mirror_balls
    print_ = None if board is None else draw_print(board)
    if board is None or print_ is None:
        return None
    size = board_size(board)
    x, y = np.meshgrid(np.arange(step / 2, size[0], step), np.arange(step / 2, size[1], step))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    pixels, scale = project_with_scale(camera, pose, points)
    white, clear = print_.at(points[:, :2])
    width, height = camera.size
    inside = (pixels > 2).all(1) & (pixels[:, 0] < width - 3) & (pixels[:, 1] < height - 3)
    usable = (
        inside
        & (clear * scale > np.where(white, *clear_of_edges))
        & ~covered(points, pose, photoset.sample, balls, photoset.white_patches, size.max() / 100)
    )
    for ball in balls:
        usable &= np.hypot(*(points[:, :2] - ball.center[:2]).T) > apart * ball.radius
    points, pixels, white = points[usable], pixels[usable], white[usable]
    column, row = (points[:, :2] // square_pitch(board)).astype(int).T
    square = column + (column.max(initial=0) + 1) * row
    spread = spread_of(camera, pose, points, _LENS + _PIXEL + _BETWEEN)
    return PaperPlaces(points, white, pixels, square, spread, camera.aside(pixels))


def sample_paper(
    places: PaperPlaces, near: Callable[[np.ndarray], RadianceImage | None]
) -> PaperSamples | None:
    """What one photo shows there.

    ``near`` reads the four pixels right of and below each of some pixels, as :meth:`.photo_reader.Reader.near` does.
    """
    corners = np.floor(places.pixels).astype(int)
    read = near(corners)
    if read is None:
        return None
    value, variance, lit = _between(read, places.pixels - corners)
    own = places.square, places.spread, places.aside
    return PaperSamples(places.points, places.white, value, variance, *own).keep(lit)


def spread_of(camera: Camera, pose: Pose, points: np.ndarray, variance: float = _LENS + _PIXEL) -> np.ndarray:
    """Covariance xx, xy, yy (n, 3) on the board of what a pixel at each of ``points`` gathers, whose ``variance`` in
    the picture is the same in all directions, pixels squared. By default that of lens and pixel."""
    _, right, up = projected_with_axes(camera, pose, points)
    xx, yy, xy = (right**2).sum(1), (up**2).sum(1), (right * up).sum(1)
    return (variance / (xx * yy - xy**2))[:, None] * np.column_stack([yy, -xy, xx])


def _between(read: RadianceImage, part: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Radiance and variance (n, c) between four pixels, and whether all may be read.

    ``read`` (2 n, 2) holds the pixels, ``part`` (n, 2) says how far to the right and down of the first.
    """
    x, y = part.T[:, :, None]
    weights = ((1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y)

    def four(plane: np.ndarray) -> np.ndarray:
        return plane.reshape(len(part), 4, -1)

    def mean(plane: np.ndarray) -> np.ndarray:
        return sum(weight * four(plane)[:, k].astype(float) for k, weight in enumerate(weights))

    clean = np.isfinite(four(read.value)).all((1, 2)) & np.isfinite(four(read.variance)).all((1, 2))
    clean &= ~four(read.saturated).any((1, 2))
    return mean(read.value), mean(read.variance), clean


def covered(
    points: np.ndarray,
    pose: Pose,
    sample: Sphere | Plane,
    balls: tuple[MirrorBall, ...],
    patches: tuple[WhitePatch, ...],
    margin: float,
) -> np.ndarray:
    """Board points (n, 3) that the camera sees behind, or within ``margin`` of, something on the board."""
    eye = pose.center
    hidden = np.zeros(len(points), bool)
    spheres = [(b.center, b.radius) for b in balls]
    outlines = [(p.outline, p.height) for p in patches]
    if isinstance(sample, Sphere):
        spheres.append((sample.center, sample.radius))
    else:
        outlines.append((sample.outline, sample.height))
    for center, radius in spheres:
        hidden |= behind_ball(points, eye, np.asarray(center, float), radius + margin)
    for outline, height in outlines:
        hidden |= _behind_sheet(points, eye, np.asarray(outline, float), float(height), margin)
    return hidden


def _behind_sheet(
    points: np.ndarray, eye: np.ndarray, outline: np.ndarray, height: float, margin: float
) -> np.ndarray:
    reach = height / eye[2]
    flat = points[:, :2] + reach * (eye[:2] - points[:, :2])
    polygon = outline.astype(np.float32).reshape(-1, 1, 2)
    behind = ((flat > outline.min(0) - margin) & (flat < outline.max(0) + margin)).all(1)
    signed = [cv2.pointPolygonTest(polygon, (float(u), float(v)), True) for u, v in flat[behind]]
    behind[behind] = np.array(signed) > -margin
    return behind
