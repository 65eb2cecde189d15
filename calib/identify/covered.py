"""Where something stands on the board: where a photo does not show the print that should be there."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from photogonio.calib.geometry.board import board_size
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.print_map import draw_print
from photogonio.capture.photoset import PrintedBoard

ACROSS = 200  # cells along the board's longer side
WINDOW = (
    0.16  # of the pitch of squares: standard deviation of the window in which print and photo are compared
)
STRUCTURE = 0.02  # variance of the print's tone in it, below which the window tells nothing
ALIKE = 0.72  # correlation of photo and print above which the print is seen
UNLIKE = 0.5  # correlation below which something else is in the window
FEWEST = 50  # cells in which the print is seen
LIT = 0.05  # of the brightest light: darker places tell nothing
OFF = 0.16  # of white: how far a cell may be from what the print would be
SHADOW = 0.14  # of the light around: darker white print may lie in a shadow
INK = 0.05  # black print over white
BORDER = 0.012  # of the board, that is left out along its edges


@dataclass(frozen=True, slots=True)
class Cover:
    """A photo laid over the board's plane: whether the print is hidden in each cell of a grid."""

    points: np.ndarray  # (n, 2) middles of the cells on the board
    shape: tuple[int, int]  # rows, columns of the grid
    step: float  # length units
    hidden: np.ndarray  # (n,) float, 1 hidden, 0 not, 0.5 unknown
    dark: np.ndarray  # (n,) bool, unknown since a shadow may lie there, or something black
    eye: np.ndarray  # (3,) of the camera
    light: np.ndarray  # (n,) what white paper has there, by the nearest print that is seen; 0 where none is

    @property
    def share(self) -> float:
        """Of the cells that tell, those that are hidden."""
        told = self.hidden != 0.5
        return float(self.hidden[told].mean()) if told.any() else 0.0


def cover_of(board: PrintedBoard, small: np.ndarray, camera: Camera, pose: Pose) -> Cover:
    """Of gray (h, w) float32 by a camera (of that picture) whose pose is known."""
    print_ = draw_print(board)
    assert print_ is not None
    size = board_size(board)
    step = float(size.max()) / ACROSS
    margin = BORDER * float(size.max())
    x = np.arange(margin + step / 2, size[0] - margin, step)
    y = np.arange(margin + step / 2, size[1] - margin, step)
    flat = np.stack(np.meshgrid(x, y), axis=-1)
    shape = flat.shape[:2]
    points = flat.reshape(-1, 2)
    pixels = camera.project(pose, np.column_stack([points, np.zeros(len(points))])).astype(np.float32)
    width, height = camera.size
    inside = np.logical_and.reduce((pixels > 1) & (pixels < [width - 2, height - 2]), axis=1).reshape(shape)
    at = pixels.reshape(*shape, 2)
    level = cv2.remap(small, at[..., 0], at[..., 1], cv2.INTER_AREA, borderValue=0.0)
    tone = cv2.GaussianBlur(print_.tone_at(points).reshape(shape), (0, 0), 0.5)
    expected = INK + (1 - INK) * tone
    hidden, dark, light = _hidden(level, expected, inside, WINDOW * board.pitch / step)
    return Cover(points, (shape[0], shape[1]), step, hidden.ravel(), dark.ravel(), pose.center, light.ravel())


def _hidden(
    level: np.ndarray, expected: np.ndarray, inside: np.ndarray, sigma: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(h, w) 1 where the photo's ``level`` is not the ``expected`` print, 0 where it is surely seen, else 0.5; where
    white print is so dark that it may lie in a shadow, which tells nothing, or be something black; light of white."""

    def mean(values: np.ndarray) -> np.ndarray:
        return cv2.GaussianBlur(values.astype(np.float32), (0, 0), float(sigma))

    of_print, of_photo = mean(expected), mean(level)
    spread = mean(expected**2) - of_print**2
    varied = np.maximum(mean(level**2) - of_photo**2, 1e-12)
    together = mean(expected * level) - of_print * of_photo
    likeness = together / np.sqrt(np.maximum(spread, 1e-9) * varied)
    light = of_photo / of_print  # as if the print were there
    bright = float(np.percentile(light[inside], 98)) if inside.any() else 0.0
    telling = inside & (spread > STRUCTURE) & (light > LIT * bright)
    seen = telling & (likeness > ALIKE)
    if seen.sum() < FEWEST:
        return np.full(level.shape, 0.5), np.zeros(level.shape, bool), np.zeros(level.shape)
    reach = 2 * round(1.5 * sigma) + 1  # in windows beside what hides the print its light is not the print's
    beside = (
        cv2.dilate((telling & (likeness < UNLIKE)).astype(np.uint8), np.ones((reach, reach), np.uint8)) > 0
    )
    clear = seen & ~beside
    lit = _spread_from(light, clear if clear.sum() >= FEWEST else seen)
    off = np.abs(level - lit * expected) > OFF * lit
    hidden = np.where(off, 1.0, np.where(seen, 0.0, 0.5))
    # a cell alone says little: noise, and edges of print that lie a little aside
    hidden = cv2.medianBlur((hidden * 2).astype(np.uint8), 5) / 2.0
    dark = (level < SHADOW * lit) & off
    unknown = ~inside | (lit <= LIT * bright)
    hidden[unknown | dark] = 0.5
    return hidden, dark & ~unknown, lit


def _spread_from(light: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Light (h, w) where the print is ``seen``, elsewhere that of the nearest such place, smoothed."""
    _, labels = cv2.distanceTransformWithLabels(
        (~seen).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    values = np.zeros(int(labels.max()) + 1, np.float32)
    values[labels[seen]] = light[seen]
    return cv2.GaussianBlur(values[labels], (0, 0), 2.0)
