"""Corners placed by the whole print around them: the known pattern, drawn as the camera would see it, is laid over
the photo. All edges of a neighbourhood take part, many more than a saddle point has, so that aliasing and noise
average out; light that changes over the patch, blur and a little occlusion are fitted or left out along the way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.detect.subpixel_kernel import FINE, find_shifts
from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.camera import Camera, Pose, project_with_scale
from photogonio.calib.geometry.print_map import Print, softened

_SOFT = 0.5  # of the spacing of the samples
_ALIKE = 0.1  # softnesses whose logarithms differ by less are one
_REACH = 0.62  # of a square: the window's half width
_LARGEST = 14  # pixels of half window; larger ones are not needed
_SMALLEST = 6
_NEAREST = 4  # pixels between a corner and the picture's edge
_ASTRAY = 10  # pixels by which a corner may be off the place about which a photo was kept
KEPT_BYTES = 4 * (2 * (_LARGEST + _ASTRAY) + 1) ** 2  # of a photo for each corner


@dataclass(frozen=True, slots=True)
class Around:
    """A photo close to the board's corners, all that placing them takes."""

    size: tuple[int, int]  # of the photo, width and height
    first: np.ndarray  # (n, 2) int column and row of each window's first pixel
    level: np.ndarray  # (n, s, s) float32, linear; NaN where it may not be used and beyond the photo

    @classmethod
    def of(cls, level: np.ndarray, usable: np.ndarray, places: np.ndarray) -> Around:
        """The pixels of a photo (h, w) about ``places`` (n, 2), the corners' as far as they are known."""
        height, width = level.shape
        reach = _LARGEST + _ASTRAY
        first = np.round(np.clip(places, -1e6, 1e6)).astype(int) - reach
        step = np.arange(2 * reach + 1)
        y, x = first[:, 1, None, None] + step[:, None], first[:, 0, None, None] + step
        there = np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)
        kept = (y >= 0) & (y < height) & (x >= 0) & (x < width) & usable[there]
        return cls((width, height), first, np.where(kept, level[there], np.float32(np.nan)))

    def without(self, mask: np.ndarray) -> Around:
        """Not to be used where ``mask`` (h, w) is set."""
        height, width = mask.shape
        step = np.arange(self.level.shape[1])
        y = np.clip(self.first[:, 1, None, None] + step[:, None], 0, height - 1)
        x = np.clip(self.first[:, 0, None, None] + step, 0, width - 1)
        return replace(self, level=np.where(mask[y, x], np.float32(np.nan), self.level))

    def holds(self, pixels: np.ndarray) -> bool:
        """Whether all corners that lie in the picture at ``pixels`` (n, 2) have their windows here."""
        off = np.abs(np.round(pixels) - self.first - self.level.shape[1] // 2).max(1)
        return bool((off <= _ASTRAY)[_inside(pixels, self.size)].all())


def _inside(pixels: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    middle = np.round(pixels)
    return np.all((middle > _NEAREST) & (middle < np.array(size) - _NEAREST), axis=1)


@dataclass(frozen=True, slots=True)
class Template:
    """The print that a photo is laid over."""

    print: Print
    square: float  # side of the board's squares
    bare: bool = False  # without the markers: the edges of the squares alone place a corner


def register(
    template: Template, camera: Camera, pose: Pose, around: Around, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Which of ``points`` (n, 3) on the board are seen clearly (n,) bool, where (n, 2), and how surely (n,).

    ``around`` is the photo about each of them.
    """
    pixels, scale = project_with_scale(camera, pose, points)
    chosen = np.flatnonzero(_inside(pixels, around.size))
    sigma = np.full(len(points), np.inf)
    if len(chosen):
        half = np.clip(_REACH * template.square * scale[chosen], _SMALLEST, _LARGEST).astype(int)
        middle = np.round(pixels[chosen]).astype(int)
        flat, shift, sure = (
            _to_board(camera, pose, middle, half),
            np.empty((len(half), 2)),
            np.empty(len(half)),
        )
        level, middle = around.level[chosen], middle - around.first[chosen]
        print_, bare = template.print, template.bare
        tone = softened(print_, *_softness(flat, half))
        find_shifts(tone, print_.bare, bare, print_.scale, flat, level, middle, half, shift, sure)
        pixels[chosen] += np.where(np.isfinite(sure)[:, None], shift, 0.0)
        sigma[chosen] = sure
    return np.isfinite(sigma), pixels, sigma


def _softness(flat: np.ndarray, half: np.ndarray) -> tuple[float, float]:
    """Standard deviations along board x and y, length units, that the print is softened by before it is sampled, so
    that edges along rows of samples are no steps: a share of the samples' spacing there, in even steps of its
    logarithm.

    Samples of an edge that is softened by half their spacing add up to the same wherever it lies between them, but for
    twice exp(-2 pi^2 / 4), a hundredth of the step's width.
    """
    slope = np.abs(flat[:, :, 1:3]).max(2) / half[:, None]  # board lengths a pixel
    spacing = np.maximum(np.median(slope, axis=0), 1e-12) / FINE
    across, along = _SOFT * np.exp(np.round(np.log(spacing) / _ALIKE) * _ALIKE)
    return float(across), float(along)


def _to_board(camera: Camera, pose: Pose, middle: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Quadratic maps (n, 2, 6) from pixel offsets over ``half`` (n,) to board x, y around ``middle`` (n, 2)."""
    v, u = (part.ravel() for part in np.mgrid[-1:1:5j, -1:1:5j])
    around = middle[:, None] + half[:, None, None] * np.column_stack([u, v])
    rays, eye = camera.world_rays(pose, around.reshape(-1, 2)), pose.center
    place = (eye[:2] - (eye[2] / rays[:, 2])[:, None] * rays[:, :2]).reshape(len(half), -1, 2)
    design = np.column_stack([np.ones(u.size), u, v, u * u, u * v, v * v])
    return np.ascontiguousarray(np.einsum("qk,nkx->nxq", np.linalg.pinv(design), place))


def refined_corners(
    template: Template, camera: Camera, pose: Pose, around: Around, every: np.ndarray, corners: Corners
) -> Corners:
    """All corners of the board (``every`` (n, 3), by number) that can be registered in this photo.

    If fewer than two thirds of those found before come through, the old ones are returned.
    """
    found, pixels, sigma = register(template, camera, pose, around, every)
    kept = np.flatnonzero(found)
    if len(kept) < max(6, 2 * len(corners) // 3):
        return corners
    return Corners(kept, every[kept], pixels[kept], sigma[kept], corners.marker_ids, corners.marker_pixels)
