"""Corners placed by the whole print around them: the known pattern, drawn as the camera would see it, is laid over
the photo. All edges of a neighbourhood take part, many more than a saddle point has, so that aliasing and noise
average out; light that changes over the patch, blur and a little occlusion are fitted or left out along the way.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from calib.board import Corners
from calib.camera import Camera, Pose
from calib.paper import project_with_scale
from calib.pattern import Print

_REACH = 0.62  # of a square: the window's half width
_LARGEST = 14  # pixels of half window; larger ones are not needed
_SMALLEST = 6
_NEAREST = 4  # pixels between a corner and the picture's edge
_FINE = 3  # samples of the pattern across a pixel
_TUKEY = 4.0
_EDGE_ERROR = 0.04  # of the contrast: pixels on an edge are drawn no better than that
_FEWEST_INLIERS = 0.7
_FEWEST_KNOWN = 0.6  # share of a window that the print fills, and of that what is usable
_WORST_FIT = 0.12  # residual over contrast
_WORST_SIGMA = 0.12  # pixels
_LINEAR = 0.25  # pixels: a smaller step needs no new drawing
_BOLDEST_MOVE = 1.2  # pixels
_CORRELATED = 1.5  # neighbouring pixels share blur: the standard error is larger by so much


@dataclass(frozen=True, slots=True)
class _Patch:
    """One window: the pattern and what to fit it to."""

    level: np.ndarray  # (n,) photo
    usable: np.ndarray  # (n,) bool
    u: np.ndarray  # (n,) offsets from the window's middle, pixels
    v: np.ndarray


def register(
    print_: Print,
    camera: Camera,
    pose: Pose,
    level: np.ndarray,
    usable: np.ndarray,
    numbers: np.ndarray,
    points: np.ndarray,
    square: float,
    *,
    bare: bool = False,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which of ``points`` (n, 3) on the board are seen clearly (n,) bool, where (n, 2), and how surely (n,).

    ``level`` (h, w) float32 is linear; pixels that are not ``usable`` take no part. ``bare`` leaves the
    markers out: the edges of the squares alone place a corner.
    """
    pixels, scale = project_with_scale(camera, pose, points)
    found = np.zeros(len(points), bool)
    sigma = np.full(len(points), np.inf)
    height, width = level.shape
    for k in range(len(points)):
        half = int(np.clip(_REACH * square * scale[k], _SMALLEST, _LARGEST))
        middle = np.round(pixels[k]).astype(int)
        if not (_NEAREST < middle[0] < width - _NEAREST and _NEAREST < middle[1] < height - _NEAREST):
            continue
        result = _fit(print_, camera, pose, level, usable, middle, half, bare)
        if result is not None:
            shift, sigma[k] = result
            pixels[k] = pixels[k] + shift
            found[k] = True
    return found, pixels, sigma


def _fit(
    print_: Print,
    camera: Camera,
    pose: Pose,
    level: np.ndarray,
    usable: np.ndarray,
    middle: np.ndarray,
    half: int,
    bare: bool,
) -> tuple[np.ndarray, float] | None:
    """Shift (2,) of the photo against the drawn pattern and its standard error; None if they do not agree."""
    v, u = np.mgrid[-half : half + 1, -half : half + 1].astype(float)
    flat = _to_board(camera, pose, middle, half)
    patch = _Patch(
        _window(level, middle, half).astype(float), _window(usable, middle, half), u.ravel(), v.ravel()
    )
    place = _quadratic(patch.u / half, patch.v / half) @ flat
    known = print_.on_print(place)
    if known.mean() < _FEWEST_KNOWN:
        return None
    if bare:
        known = print_.beside_markers(place)
    shift = np.zeros(2)
    for _ in range(3):
        solved = _solve(_draw(print_, flat, half, shift), known, patch, half)
        if solved is None or np.hypot(*(shift + solved[0])) > _BOLDEST_MOVE:
            return None
        shift = shift + solved[0]
        if np.hypot(*solved[0]) < _LINEAR:
            break
    return (shift, solved[1]) if solved[1] < _WORST_SIGMA else None


def _window(plane: np.ndarray, middle: np.ndarray, half: int) -> np.ndarray:
    """The square about ``middle`` of a plane (h, w), row after row; 0 beyond the plane."""
    (left, top), (height, width), size = middle - half, plane.shape, 2 * half + 1
    if left >= 0 and top >= 0 and left + size <= width and top + size <= height:
        return plane[top : top + size, left : left + size].ravel()
    part = plane[max(top, 0) : top + size, max(left, 0) : left + size]
    before = max(-top, 0), max(-left, 0)
    after = size - before[0] - part.shape[0], size - before[1] - part.shape[1]
    return np.pad(part, list(zip(before, after, strict=True))).ravel()


def _to_board(camera: Camera, pose: Pose, middle: np.ndarray, half: int) -> np.ndarray:
    """Quadratic map (6, 2) from pixel offsets over ``half`` to board x, y around ``middle``."""
    v, u = np.mgrid[-1:1:5j, -1:1:5j]
    rays = camera.world_rays(pose, middle + half * np.column_stack([u.ravel(), v.ravel()]))
    eye = pose.center
    place = eye[:2] - (eye[2] / rays[:, 2])[:, None] * rays[:, :2]
    return np.linalg.lstsq(_quadratic(u.ravel(), v.ravel()), place, rcond=None)[0]


def _quadratic(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.column_stack([np.ones(u.size), u, v, u * u, u * v, v * v])


def _draw(print_: Print, flat: np.ndarray, half: int, shift: np.ndarray) -> np.ndarray:
    """The pattern with box pixels and a slight blur, moved by ``shift``, one pixel wider than the window."""
    count = (2 * half + 1 + 2) * _FINE  # a pixel more on each side, for the gradients
    step = (np.arange(count) + 0.5) / _FINE - half - 1.5
    u, v = np.meshgrid(step, step)
    place = _quadratic((u.ravel() - shift[0]) / half, (v.ravel() - shift[1]) / half) @ flat
    tone = print_.tone_at(place).reshape(count, count)
    size = count // _FINE
    tone = cv2.GaussianBlur(tone, (0, 0), 0.5 * _FINE, borderType=cv2.BORDER_REPLICATE)
    return cv2.resize(tone, (size, size), interpolation=cv2.INTER_AREA)


def _solve(drawn: np.ndarray, known: np.ndarray, patch: _Patch, half: int) -> tuple[np.ndarray, float] | None:
    """One linear step: gain, offset, their slopes, blur and shift, with Tukey's weights."""
    pattern = drawn[1:-1, 1:-1].ravel()
    right = (drawn[1:-1, 2:] - drawn[1:-1, :-2]).ravel() / 2
    down = (drawn[2:, 1:-1] - drawn[:-2, 1:-1]).ravel() / 2
    bend = (drawn[1:-1, 2:] + drawn[1:-1, :-2] + drawn[2:, 1:-1] + drawn[:-2, 1:-1]).ravel() - 4 * pattern
    u, v = patch.u / half, patch.v / half
    design = np.column_stack([pattern, np.ones(u.size), u, v, pattern * u, pattern * v, bend, right, down])
    chosen = known & patch.usable
    if chosen.sum() < _FEWEST_KNOWN * known.sum():
        return None
    design, level = design[chosen], patch.level[chosen]
    weight = np.ones(len(level))
    for _ in range(4):
        weighted = design.T * weight
        normal = weighted @ design + 1e-9 * np.eye(9)
        values = np.linalg.solve(normal, weighted @ level)
        residual = level - design @ values
        spread = max(1.4826 * float(np.median(np.abs(residual))), 1e-9)
        weight = (
            np.clip(1 - (residual / (_TUKEY * max(spread, _EDGE_ERROR * abs(values[0])))) ** 2, 0, None) ** 2
        )
    gain = values[0]
    inlier = weight > 0.1
    scatter = float(np.sqrt((weight * residual**2).sum() / max(weight.sum() - 9, 1)))
    if gain <= 0 or inlier.mean() < _FEWEST_INLIERS or scatter > _WORST_FIT * gain:
        return None
    error = _CORRELATED * scatter * np.sqrt(np.diag(np.linalg.inv(normal))[7:]) / gain
    return -values[7:] / gain, float(np.hypot(*error) / np.sqrt(2))


def refined_corners(
    print_: Print,
    camera: Camera,
    pose: Pose,
    level: np.ndarray,
    usable: np.ndarray,
    every: np.ndarray,
    square: float,
    corners: Corners,
    *,
    bare: bool = False,
) -> Corners:
    """All corners of the board (``every`` (n, 3), by number) that can be registered in this photo.

    If fewer than two thirds of those found before come through, the old ones are returned.
    """
    found, pixels, sigma = register(
        print_, camera, pose, level, usable, np.arange(len(every)), every, square, bare=bare
    )
    kept = np.flatnonzero(found)
    if len(kept) < max(6, 2 * len(corners) // 3):
        return corners
    return Corners(kept, every[kept], pixels[kept], sigma[kept], corners.marker_ids, corners.marker_pixels)
