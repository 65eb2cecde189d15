"""A photo at a glance: how bright, how sharp, where the board is; at a fraction of what calibration takes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.calib.detect.corners import placed_corners, searched_corners
from photogonio.calib.detect.gray import detection_image, fine_about, halved, without_fireflies
from photogonio.calib.geometry.board import Corners
from photogonio.calib.identify.layout import Markers, seen_markers
from photogonio.calib.identify.sharpness import Sharpness, placed_quads, sharpness
from photogonio.capture.photoset import Board

SMALL = 1_300_000  # pixels of the picture in which markers are looked for first
LEAST_SIDE = 16.0  # pixels of a marker in it, on the mean: smaller ones are looked for in a larger picture
WHITE = 98.0  # percentile that tells how bright a photo is
JUDGED = 400_000  # pixels, about, that tell it
ABOUT = 16  # pixels about a corner that placing it takes
FEWEST = 8  # corners that are enough


@dataclass(frozen=True, slots=True)
class QuickLook:
    """What one photo shows by itself."""

    size: tuple[int, int]  # width, height
    white: float  # its bright parts, over white level
    clipped: float  # share of pixels that are saturated
    small: np.ndarray  # (h, w) float32, gray of the photo made smaller
    full: np.ndarray  # (h, w) bool, pixels of it that hold saturated ones
    step: int  # by which it is smaller
    markers: Markers | None = None
    corners: Corners | None = None
    sharp: Sharpness | None = None

    @property
    def clear(self) -> bool:
        """Whether the board is found well enough to tell where the camera was."""
        return self.corners is not None and len(self.corners) >= FEWEST


def quick_look(level: np.ndarray, usable: np.ndarray, board: Board | None) -> QuickLook:
    """Of gray (h, w), 1 at white level, and pixels that are not saturated; without a board its markers are looked
    for."""
    pictures = [level]
    while pictures[-1].size > SMALL:
        pictures.append(halved(pictures[-1]))
    height, width = level.shape
    stride = max(1, int(np.sqrt(level.size / JUDGED)))
    white = float(np.percentile(level[::stride, ::stride], WHITE))
    step = 2 ** (len(pictures) - 1)
    found = QuickLook(
        (width, height), white, float(1.0 - usable.mean()), pictures[-1], _any(~usable, step), step
    )
    markers, corners = (None, None)
    for power in range(len(pictures) - 1, -1, -1):
        tone = detection_image(without_fireflies(pictures[power]))
        if board is None:
            markers, enough = _markers(tone, 2**power)
        else:
            corners, enough = _corners(board, tone, level, 2**power)
        if enough:
            break
    if markers is not None:
        markers = Markers(markers.family, markers.ids, placed_quads(level, markers.quads))
    quads = corners.marker_pixels if corners is not None else markers.quads if markers is not None else None
    sharp = None if quads is None else sharpness(level, quads)
    return QuickLook(
        found.size, found.white, found.clipped, found.small, found.full, step, markers, corners, sharp
    )


def _markers(tone: np.ndarray, step: int) -> tuple[Markers | None, bool]:
    found = seen_markers(tone)
    if found is None:
        return None, False
    enough = _side(found.quads) >= LEAST_SIDE
    return Markers(found.family, found.ids, enlarged(found.quads, step)), enough


def _corners(board: Board, tone: np.ndarray, level: np.ndarray, step: int) -> tuple[Corners, bool]:
    found = searched_corners(board, tone, thorough=step == 1)
    enough = len(found) >= FEWEST and _side(found.marker_pixels) >= LEAST_SIDE
    corners = Corners(
        found.ids,
        found.points,
        enlarged(found.pixels, step),
        found.sigma,
        found.marker_ids,
        enlarged(found.marker_pixels, step),
    )
    if (enough or step == 1) and len(corners):
        corners = placed_corners(board, corners, *fine_about(level, corners.pixels, ABOUT))
    return corners, enough


def enlarged(pixels: np.ndarray, step: int) -> np.ndarray:
    """Places in a picture made smaller ``step`` times as places in the picture itself."""
    return step * pixels + 0.5 * (step - 1)


def _side(quads: np.ndarray) -> float:
    if not len(quads):
        return 0.0
    return float(np.linalg.norm(np.roll(quads, 1, axis=1) - quads, axis=2).mean())


def _any(mask: np.ndarray, step: int) -> np.ndarray:
    """Blocks of ``step`` by ``step`` pixels any of which is set."""
    height, width = (n // step * step for n in mask.shape)
    blocks = mask[:height, :width].reshape(height // step, step, width // step, step)
    return np.logical_or.reduce(blocks, axis=(1, 3))
