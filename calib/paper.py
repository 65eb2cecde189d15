"""The board's print as a photometric target: places of even white or black, clear of every edge."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from calib.board import board_size, dictionary, opencv_board
from calib.camera import Camera, Pose
from capture.photoset import Board, MirrorBall, Plane, Sphere, WhitePatch
from capture.radiance import RadianceImage

_SQUARE_PIXELS = range(140, 420)  # of the drawn pattern; one is chosen that rounds no edge
_CLEAR_WHITE = 2.3  # pixels of the photo between a sample and the next printed edge
_CLEAR_BLACK = 3.3  # the same for black print, which little stray white lights up


@dataclass(frozen=True, slots=True)
class PaperSamples:
    """Radiance of the paper at places of one tone, in one photo."""

    points: np.ndarray  # (n, 3) world
    white: np.ndarray  # (n,) bool; else black print
    value: np.ndarray  # (n, c) radiance
    variance: np.ndarray  # (n, c)
    square: np.ndarray  # (n,) int, the square of the board a sample lies in: errors within one go together

    def __len__(self) -> int:
        return len(self.points)

    def keep(self, mask: np.ndarray) -> PaperSamples:
        return PaperSamples(
            self.points[mask], self.white[mask], self.value[mask], self.variance[mask], self.square[mask]
        )


@dataclass(frozen=True, slots=True)
class Print:
    """The pattern as a map: tone and distance to the nearest edge of it."""

    white: np.ndarray  # (h, w) bool
    tone: np.ndarray  # (h, w) float32, 1 where white
    clear: np.ndarray  # (h, w) length units to the nearest change of tone or the pattern's border
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
        return ((points >= 0) & (points * self.scale <= [width, height])).all(1)

    def beside_markers(self, points: np.ndarray) -> np.ndarray:
        """Whether board points (n, 2) lie within the pattern and clear of every marker, (n,) bool."""
        height, width = self.white.shape
        x = np.clip((points[:, 0] * self.scale).astype(int), 0, width - 1)
        y = np.clip((height - points[:, 1] * self.scale).astype(int), 0, height - 1)
        return self.on_print(points) & self.bare[y, x]


def draw_print(board: Board) -> Print | None:
    """The pattern of a flat board; None for loose markers, whose surroundings are unknown."""
    if board.kind == "markers":
        return None
    key = (board.kind, board.dictionary, board.squares, board.square_length, board.markers)
    return _draw(key, board.marker_length, board.marker_separation, board.first_id, board.legacy_pattern)


@lru_cache(maxsize=4)
def _draw(key: tuple, length: float, separation: float | None, first: int, legacy: bool) -> Print:
    kind, marks, squares, square, markers = key
    board = Board(
        kind,
        marks,
        squares=squares,
        square_length=square,
        markers=markers,
        marker_length=length,
        marker_separation=separation,
        first_id=first,
        legacy_pattern=legacy,
    )
    size = board_size(board)
    scale = _even_scale(board)
    shape = np.round(size * scale).astype(int)
    picture = opencv_board(board).generateImage((int(shape[0]), int(shape[1])), marginSize=0, borderBits=1)
    white = picture > 127
    clear = [
        cv2.distanceTransform(np.pad(m.astype(np.uint8), 1), cv2.DIST_L2, 5)[1:-1, 1:-1]
        for m in (white, ~white)
    ]
    clearance = np.where(white, clear[0], clear[1]) / scale
    return Print(
        white, white.astype(np.float32), clearance, float(scale), _beside_markers(board, scale, white.shape)
    )


def _beside_markers(board: Board, scale: float, shape: tuple[int, ...]) -> np.ndarray:
    """Pixels (h, w) bool of the drawn pattern that lie clear of the markers by a third of the gap around them."""
    bare = np.ones(shape, np.uint8)
    for corners in opencv_board(board).getObjPoints():
        fill_from = np.asarray(corners, float).reshape(4, 3)[:, :2] * scale
        low, high = np.floor(fill_from.min(0)).astype(int), np.ceil(fill_from.max(0)).astype(int)
        bare[max(low[1], 0) : high[1], max(low[0], 0) : high[0]] = 0
    gap = board.square_length - board.marker_length if board.kind == "charuco" else board.marker_separation
    wide = 2 * max(1, round(gap * scale / 6)) + 1
    return cv2.erode(bare, np.ones((wide, wide), np.uint8), borderValue=1) > 0


def _even_scale(board: Board) -> float:
    """Pixels per length at which squares, markers and their cells are whole numbers of pixels, as nearly as can be.

    OpenCV draws with whole pixels: a careless scale would move edges by half a pixel of the drawing.
    """
    cells = dictionary(board.dictionary).markerSize + 2
    square = _square(board)
    whole = np.array(_SQUARE_PIXELS, float)
    marker = whole * board.marker_length / square
    gap = (whole - marker) / (2 if board.kind == "charuco" else 1)
    off = sum(np.abs(v - np.round(v)) for v in (marker / cells, gap))
    return float(whole[np.argmin(off + 1e-6 * whole)]) / square


def sample_paper(
    board: Board,
    near: Callable[[np.ndarray], RadianceImage | None],
    camera: Camera,
    pose: Pose,
    *,
    step: float,
    sample: Sphere | Plane,
    balls: tuple[MirrorBall, ...],
    patches: tuple[WhitePatch, ...],
) -> PaperSamples | None:
    """Radiance on a grid of pitch ``step`` over the board, where the print is even and nothing stands before it.

    ``near`` reads the four pixels right of and below each of some pixels, as :meth:`calib.looking.Reader.near` does.
    """
    print_ = draw_print(board)
    if print_ is None:
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
        & (clear * scale > np.where(white, _CLEAR_WHITE, _CLEAR_BLACK))
        & ~covered(points, pose, sample, balls, patches, size.max() / 100)
    )
    points, pixels, white = points[usable], pixels[usable], white[usable]
    corners = np.floor(pixels).astype(int)
    read = near(corners)
    if read is None:
        return None
    value, variance, lit = _between(read, pixels - corners)
    across = int(np.ceil(size[0] / _square(board)))
    square = (points[:, 0] // _square(board)).astype(int) + across * (points[:, 1] // _square(board)).astype(
        int
    )
    return PaperSamples(points, white, value, variance, square).keep(lit)


def _square(board: Board) -> float:
    if board.kind == "charuco":
        return float(board.square_length)
    return float(board.marker_length + board.marker_separation)


def project_with_scale(camera: Camera, pose: Pose, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (n, 2) of board points and pixels per length in the most foreshortened direction (n,)."""
    step = 1e-3 * float(np.ptp(points[:, :2], axis=0).max())
    pixels = camera.project(pose, points)
    right = (camera.project(pose, points + np.array([step, 0, 0])) - pixels) / step
    up = (camera.project(pose, points + np.array([0, step, 0])) - pixels) / step
    total = (right**2).sum(1) + (up**2).sum(1)
    area = right[:, 0] * up[:, 1] - right[:, 1] * up[:, 0]
    least = total / 2 - np.sqrt(np.maximum(total**2 / 4 - area**2, 0.0))
    return pixels, np.sqrt(np.maximum(least, 0.0))


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


def behind_ball(points: np.ndarray, eye: np.ndarray, center: np.ndarray, radius: float) -> np.ndarray:
    """Whether a ball stands on the straight line between ``eye`` and each point, (n,) bool."""
    ray = points - eye
    along = np.clip((ray @ (center - eye)) / (ray**2).sum(1), 0.0, 1.0)
    return ((eye + along[:, None] * ray - center) ** 2).sum(1) < radius**2


def _behind_sheet(
    points: np.ndarray, eye: np.ndarray, outline: np.ndarray, height: float, margin: float
) -> np.ndarray:
    reach = height / eye[2]
    flat = points[:, :2] + reach * (eye[:2] - points[:, :2])
    polygon = outline.astype(np.float32).reshape(-1, 1, 2)
    signed = np.array([cv2.pointPolygonTest(polygon, (float(u), float(v)), True) for u, v in flat])
    return signed > -margin
