"""The board's print as a map: where it is white, where black, and how far the next edge is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from photogonio.calib.geometry.board import board_size, dictionary, opencv_board
from photogonio.capture.photoset import Board, CharucoBoard, LooseMarkers, PrintedBoard

_SQUARE_PIXELS = range(140, 420)  # of the drawn pattern; one is chosen that rounds no edge
_SHARP = 0.1  # pixels of the drawing: a standard deviation that changes nothing
_CELL_PIXELS = 16  # of a loose marker's cell in the drawing
_MOST_PIXELS = 4000  # of the drawing's longer side


@dataclass(frozen=True, slots=True, eq=False)
class Print:
    """The pattern as a map: tone and distance to the nearest edge of it. Each is equal to itself alone."""

    white: np.ndarray  # (h, w) bool
    tone: np.ndarray  # (h, w) float32, 1 where white, 0.5 where not known
    clear: (
        np.ndarray
    )  # (h, w) length units to the nearest change of tone, the pattern's border or what is not known
    scale: float  # pixels per length unit
    bare: np.ndarray  # (h, w) bool, clear of the markers

    def at(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tone (n,) and clearance (n,) at board points (n, 2); clearance 0 outside."""
        height, width = self.white.shape
        x = np.floor(points[:, 0] * self.scale).astype(int)
        y = np.floor(height - points[:, 1] * self.scale).astype(int)
        inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
        x, y = np.clip(x, 0, width - 1), np.clip(y, 0, height - 1)
        return self.white[y, x], np.where(inside, self.clear[y, x], 0.0)

    def tone_at(self, points: np.ndarray) -> np.ndarray:
        """Tone between 0 (black) and 1 at board points (n, 2), float32, interpolated; 0.5 outside."""
        height = self.white.shape[0]
        x = (points[:, 0] * self.scale - 0.5).astype(np.float32)
        y = (height - points[:, 1] * self.scale - 0.5).astype(np.float32)
        border = cv2.BORDER_CONSTANT
        return cv2.remap(self.tone, x, y, cv2.INTER_LINEAR, borderMode=border, borderValue=0.5).ravel()

    def on_print(self, points: np.ndarray) -> np.ndarray:
        """Whether board points (n, 2) lie within the pattern, (n,) bool."""
        height, width = self.white.shape
        return np.all((points >= 0) & (points * self.scale <= [width, height]), axis=1)


@lru_cache(maxsize=4)
def softened(drawn: Print, across: float, along: float) -> np.ndarray:
    """The tone (h, w) float32 under normal distributions of those standard deviations along x and y, length units."""
    wide, high = max(across * drawn.scale, _SHARP), max(along * drawn.scale, _SHARP)
    return cv2.GaussianBlur(drawn.tone, (0, 0), wide, sigmaY=high, borderType=cv2.BORDER_REPLICATE)


def draw_print(board: Board) -> Print | None:
    """The pattern of a flat board. Around loose markers nothing is known; None if none of them lies
    on the board, right of and above its origin."""
    if isinstance(board, LooseMarkers):
        flat = [(k, np.asarray(c, float).reshape(4, 3)) for k, c in board.marker_corners]
        flat = [(k, c) for k, c in flat if not c[:, 2].any() and (c[:, :2].max(0) > 0).all()]
        return _draw_loose(board.dictionary, tuple((k, c.tobytes()) for k, c in flat)) if flat else None
    return _draw(board)


@lru_cache(maxsize=4)
def _draw(board: PrintedBoard) -> Print:
    size = board_size(board)
    scale = _even_scale(board)
    shape = np.round(size * scale).astype(int)
    picture = opencv_board(board).generateImage((int(shape[0]), int(shape[1])), marginSize=0, borderBits=1)
    white = picture > 127
    return Print(
        white,
        white.astype(np.float32),
        _clearance((white, ~white), scale),
        float(scale),
        _beside_markers(board, scale, white.shape),
    )


@lru_cache(maxsize=4)
def _draw_loose(marks: str, flat: tuple[tuple[int, bytes], ...]) -> Print:
    """Each marker drawn where its corners (world, clockwise from the top left) are."""
    kind = dictionary(marks)
    cells = kind.markerSize + 2
    corners = np.array([np.frombuffer(c).reshape(4, 3)[:, :2] for _, c in flat])
    size = corners.reshape(-1, 2).max(0)
    scale = min(_CELL_PIXELS * cells / _least_side(corners), _MOST_PIXELS / float(size.max()))
    shape = np.ceil(size * scale).astype(int)
    tone = np.full(shape[::-1], 0.5, np.float32)
    for (number, _), where in zip(flat, corners, strict=True):
        drawn = cv2.aruco.generateImageMarker(kind, number, _CELL_PIXELS * cells, borderBits=1)
        side = drawn.shape[0] - 0.5  # of the picture's edge, pixel centres being whole
        own = np.array([[-0.5, -0.5], [side, -0.5], [side, side], [-0.5, side]], np.float32)
        there = np.column_stack([where[:, 0] * scale - 0.5, shape[1] - where[:, 1] * scale - 0.5])
        warp = cv2.getPerspectiveTransform(own, there.astype(np.float32))
        cv2.warpPerspective(
            (drawn > 127).astype(np.float32), warp, tuple(map(int, shape)), tone, cv2.INTER_NEAREST,
            cv2.BORDER_TRANSPARENT,
        )  # fmt: skip
    white, black = tone > 0.75, tone < 0.25
    return Print(white, tone, _clearance((white, black), scale), float(scale), np.zeros(tone.shape, bool))


def _clearance(tones: tuple[np.ndarray, ...], scale: float) -> np.ndarray:
    """Length units (h, w) from each pixel to the nearest that is not of its tone; 0 in none of ``tones`` (h, w)."""
    clear = np.zeros(tones[0].shape, np.float32)
    for tone in tones:
        apart = cv2.distanceTransform(np.pad(tone.astype(np.uint8), 1), cv2.DIST_L2, 5)[1:-1, 1:-1]
        clear[tone] = apart[tone] / scale
    return clear


def _beside_markers(board: PrintedBoard, scale: float, shape: tuple[int, ...]) -> np.ndarray:
    """Pixels (h, w) bool of the drawn pattern that lie clear of the markers by a third of the gap around them."""
    bare = np.ones(shape, np.uint8)
    for corners in opencv_board(board).getObjPoints():
        fill_from = np.asarray(corners, float).reshape(4, 3)[:, :2] * scale
        low, high = np.floor(fill_from.min(0)).astype(int), np.ceil(fill_from.max(0)).astype(int)
        bare[max(low[1], 0) : high[1], max(low[0], 0) : high[0]] = 0
    wide = 2 * max(1, round(board.gap * scale / 6)) + 1
    return cv2.erode(bare, np.ones((wide, wide), np.uint8), borderValue=1) > 0


def _even_scale(board: PrintedBoard) -> float:
    """Pixels per length at which squares, markers and their cells are whole numbers of pixels, as nearly as can be.

    OpenCV draws with whole pixels: a careless scale would move edges by half a pixel of the drawing.
    """
    cells = dictionary(board.dictionary).markerSize + 2
    square = square_pitch(board)
    whole = np.array(_SQUARE_PIXELS, float)
    marker = whole * board.marker_length / square
    gap = (whole - marker) / (2 if isinstance(board, CharucoBoard) else 1)
    off = sum(np.abs(v - np.round(v)) for v in (marker / cells, gap))
    return float(whole[np.argmin(off + 1e-6 * whole)]) / square


def square_pitch(board: Board) -> float:
    """Side of the areas of the print whose errors go together, length units."""
    if isinstance(board, LooseMarkers):
        return _least_side(np.array([np.asarray(c, float).reshape(4, 3) for _, c in board.marker_corners]))
    return board.pitch


def _least_side(corners: np.ndarray) -> float:
    """Of markers' (k, 4, d) upper sides the shortest."""
    return float(np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1).min())
