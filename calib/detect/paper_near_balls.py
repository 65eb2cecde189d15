"""Paper close to polished balls, pixel by pixel: the edges of their shadows there tell the lamp's direction.

The print there is drawn as the camera blurs it, so that pixels between its edges may be used too: a ball is small,
and so is its shadow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from statistics import NormalDist

import numpy as np

from photogonio.calib.detect.paper import covered, spread_of
from photogonio.calib.geometry.camera import Camera, Pose, project_with_scale
from photogonio.calib.geometry.print_map import Print, draw_print, square_pitch
from photogonio.capture.photoset import Board, LooseMarkers, MirrorBall, Plane, Sphere, WhitePatch
from photogonio.capture.radiance import RadianceImage

_NEAREST, _FARTHEST = 1.1, 4.0  # radii of the ball, from its foot, between which paper is taken
_MOST = 5000  # pixels about a ball; of larger pictures not every one is taken
_MARGIN = 2.5  # pixels about whatever stands on the board
_BLUR = 0.58  # pixels by which lens and pixels soften the print
_REACH = 2.0  # pixels beyond which nothing reaches into one
_NODES = 8  # in each direction, of an even mean over that blur
_MISPLACED, _MISBLURRED = 0.1, 0.2  # pixels, and of the blur: how well the print is drawn
INK = 0.05  # radiance of black print over white, about
_WORST = 0.2  # relative error of the drawing
_FEWEST = 30


@dataclass(frozen=True, slots=True)
class Close:
    """Pixels of paper close to polished balls."""

    points: np.ndarray  # (n, 3) world
    white: np.ndarray  # (n,) share of white print in the pixel
    level: np.ndarray  # (n,) radiance, gray
    noise: np.ndarray  # (n,) its variance, with that of the drawing
    square: np.ndarray  # (n,) int, as of other paper
    spread: np.ndarray  # (n, 3) likewise
    uneven: np.ndarray  # (n,) how much the print varies within a pixel's blur, relative
    aside: np.ndarray | None = None  # (n,) likewise

    def keep(self, mask: np.ndarray) -> Close:
        names = (one.name for one in fields(self))
        given = {name: part[mask] for name in names if (part := getattr(self, name)) is not None}
        return Close(**given)


@dataclass(frozen=True, slots=True)
class ClosePlaces:
    """Which pixels these are, of the camera at one place."""

    pixels: np.ndarray  # (n, 2) int
    points: np.ndarray  # (n, 3) world
    white: np.ndarray  # (n,)
    doubt: np.ndarray  # (n,) relative error of the drawing
    square: np.ndarray  # (n,) int
    spread: np.ndarray  # (n, 3)
    uneven: np.ndarray  # (n,)
    aside: np.ndarray  # (n,)


def close_places(
    board: Board,
    camera: Camera,
    pose: Pose,
    *,
    sample: Sphere | Plane,
    balls: tuple[MirrorBall, ...],
    patches: tuple[WhitePatch, ...],
) -> ClosePlaces | None:
    """Where the print close to balls can be drawn well enough; None if that is too little."""
    print_ = draw_print(board)
    if (
        print_ is None or not balls or isinstance(board, LooseMarkers)
    ):  # around loose markers nothing is known
        return None
    pixels = np.concatenate([_window(camera, pose, ball) for ball in balls])
    points = _on_board(camera, pose, pixels)
    kept = _free(points, camera, pose, sample, balls, patches)
    pixels, points = pixels[kept], points[kept]
    if len(points) < _FEWEST:
        return None
    white, doubt, uneven, whole = _drawn(print_, camera, pose, pixels, points)
    column, row = (points[:, :2] // square_pitch(board)).astype(int).T
    square = column + (column.max(initial=0) + 1) * row
    good = whole & (doubt < _WORST)
    if good.sum() < _FEWEST:
        return None
    points = points[good]
    spread = spread_of(camera, pose, points)
    aside, drawn = camera.aside(pixels[good]), (white[good], doubt[good])
    return ClosePlaces(pixels[good], points, *drawn, square[good], spread, uneven[good], aside)


def close_paper(places: ClosePlaces, near: Callable[[np.ndarray], RadianceImage | None]) -> Close | None:
    """What one photo shows there; None if that is too little. ``near`` as for ``paper.sample_paper``."""
    read = near(places.pixels)
    if read is None:
        return None
    level, variance, usable = _gray(read, len(places.points))
    if usable.sum() < _FEWEST:
        return None
    noise = variance + (places.doubt * level) ** 2
    return Close(
        places.points[usable],
        places.white[usable],
        level[usable],
        noise[usable],
        places.square[usable],
        places.spread[usable],
        places.uneven[usable],
        places.aside[usable],
    )


def _window(camera: Camera, pose: Pose, ball: MirrorBall) -> np.ndarray:
    """Pixels (n, 2) int about a ball, evenly taken, well within the picture."""
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    reach = _FARTHEST * ball.radius
    ring = ball.center[:2] + reach * np.column_stack([np.cos(turn), np.sin(turn)])
    limb = camera.project(pose, np.column_stack([ring, np.zeros(len(ring))]))
    low = np.maximum(np.floor(limb.min(0)), 3).astype(int)
    high = np.minimum(np.ceil(limb.max(0)), np.array(camera.size) - 4).astype(int)
    if (high <= low).any():
        return np.zeros((0, 2), int)
    step = max(1, int(np.ceil(np.sqrt(np.prod(high - low + 1) / _MOST))))
    x, y = np.meshgrid(np.arange(low[0], high[0] + 1, step), np.arange(low[1], high[1] + 1, step))
    return np.column_stack([x.ravel(), y.ravel()])


def _on_board(camera: Camera, pose: Pose, pixels: np.ndarray) -> np.ndarray:
    """Points (n, 3) of the board's plane that pixels (n, 2) see; NaN where none."""
    eye, rays = pose.center, camera.world_rays(pose, pixels.astype(float))
    down = np.where(rays[:, 2] < 0, rays[:, 2], np.nan)
    points = eye - (eye[2] / down)[:, None] * rays
    points[:, 2] *= 0.0
    return points


def _free(
    points: np.ndarray,
    camera: Camera,
    pose: Pose,
    sample: Sphere | Plane,
    balls: tuple[MirrorBall, ...],
    patches: tuple[WhitePatch, ...],
) -> np.ndarray:
    """Which points (n, 3) lie in the ring about a ball, and nothing stands before them."""
    kept = np.zeros(len(points), bool)
    for ball in balls:
        away = np.hypot(*(points[:, :2] - ball.center[:2]).T)
        kept |= away < _FARTHEST * ball.radius
    for ball in balls:
        kept &= ~(np.hypot(*(points[:, :2] - ball.center[:2]).T) < _NEAREST * ball.radius)
    chosen = np.flatnonzero(kept)
    if len(chosen):
        scale = np.median(project_with_scale(camera, pose, points[chosen[:: max(1, len(chosen) // 50)]])[1])
        kept[chosen] = ~covered(points[chosen], pose, sample, balls, patches, _MARGIN / float(scale))
    return kept


def _drawn(
    print_: Print, camera: Camera, pose: Pose, pixels: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Share of white (n,) of the pixels' blurred print, the relative error (n,) of the tone that this gives, how much
    that varies within the blur, relative (n,), and whether the print reaches as far as they blur, (n,) bool."""
    right = _on_board(camera, pose, pixels + np.array([1, 0]))[:, :2] - points[:, :2]
    down = _on_board(camera, pose, pixels + np.array([0, 1]))[:, :2] - points[:, :2]
    node = [NormalDist().inv_cdf((k + 0.5) / _NODES) for k in range(_NODES)]
    total, across, along, bend = np.zeros((4, len(points)))
    for a in node:
        for b in node:
            there = print_.tone_at(points[:, :2] + _BLUR * (a * right + b * down))
            total += there
            across += a * there
            along += b * there
            bend += (a * a + b * b - 2) * there
    count = _NODES**2
    white = total / count
    tone, slope = INK + (1 - INK) * white, np.hypot(across, along) / count
    error = np.hypot(_MISPLACED / _BLUR * slope, _MISBLURRED * bend / count)
    corners = [points[:, :2] + _REACH * (a * right + b * down) for a in (-1, 1) for b in (-1, 1)]
    whole = np.all([print_.on_print(corner) for corner in corners], axis=0)
    return white, error / tone, slope / tone, whole


def _gray(read: RadianceImage, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean over the channels and its variance (n,) of the first of every four pixels, and whether all may be read."""
    value, variance = (p.reshape(count, 4, -1)[:, 0].astype(float) for p in (read.value, read.variance))
    clean = np.isfinite(value).all(1) & np.isfinite(variance).all(1)
    clean &= ~read.saturated.reshape(count, 4, -1)[:, 0].any(1)
    channels = value.shape[1]
    return value.mean(1), variance.mean(1) / channels, clean
