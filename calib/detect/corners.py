"""The board's corners and markers, found in a photo."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from photogonio.calib.geometry.board import Corners, board_points, dictionary, opencv_board
from photogonio.capture.photoset import Board, CharucoBoard, GridBoard

_FEW_CORNERS = 10  # of a chessboard: fewer, and those are taken too that have but one of their two markers
_ENOUGH_MARKERS = 2  # a homography from fewer is not trusted for the search window
_PLAIN = 32.0  # pixels of all sides of markers in a smaller picture, in which others are then found as well


def find_corners(board: Board, image: np.ndarray, fine: np.ndarray) -> Corners:
    """Corners of ``board`` in one photo.

    ``image`` (h, w) uint8 is searched for markers; ``fine`` (h, w) float32, linear in light, places the corners to a
    fraction of a pixel. Few or no corners is not an error here.
    """
    return placed_corners(board, searched_corners(board, image), fine)


def searched_corners(board: Board, image: np.ndarray, *, thorough: bool = True) -> Corners:
    """The same to a pixel, as the search for markers leaves them; ``thorough``: where they are few, all that any marker
    tells."""
    made = opencv_board(board)
    if isinstance(made, cv2.aruco.CharucoBoard):
        found, ids, shown, marks = _find_charuco(made, image, thorough)
    else:
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        detector = cv2.aruco.ArucoDetector(dictionary(board.dictionary), parameters)
        shown, marks, rejected = detector.detectMarkers(image)
        if marks is not None and len(marks) >= _ENOUGH_MARKERS:
            shown, marks, _, _ = detector.refineDetectedMarkers(image, made, shown, marks, rejected)
        found, ids = _of_board(made, shown, marks)
    points = board_points(board)[ids]
    quads = np.array([np.asarray(q, float).reshape(4, 2) for q in shown]).reshape(-1, 4, 2)
    marks = np.zeros(0, int) if marks is None else np.asarray(marks).reshape(-1).astype(int)
    return Corners(ids, points, found, np.full(len(ids), 0.5), marks, quads)


def corners_of_half(board: Board, image: np.ndarray) -> Corners | None:
    """The corners to a pixel or two from a picture of half the size (h, w); None if it may not show all."""
    if not isinstance(board, CharucoBoard):  # of others, what is not found is not looked for again
        return None
    found = searched_corners(board, image, thorough=False)
    sides = np.linalg.norm(found.marker_pixels - np.roll(found.marker_pixels, 1, axis=1), axis=2)
    if len(found) < _FEW_CORNERS or sides.min() < _PLAIN:  # few: the whole photo tells more of single markers
        return None
    doubled, quads = (2 * part + 0.5 for part in (found.pixels, found.marker_pixels))
    return replace(found, pixels=doubled, marker_pixels=quads)


def placed_corners(
    board: Board, corners: Corners, fine: np.ndarray, offset: np.ndarray | float = 0.0
) -> Corners:
    """Corners to a fraction of a pixel, of those from a search; ``fine`` (h, w) float32 is linear in light, and shows
    each of them by ``offset`` (n, 2) pixels nearer its first pixel than the photo does."""
    pixels, sigma = _refine(board, fine, corners.points, corners.pixels, offset)
    return replace(corners, pixels=pixels, sigma=sigma)


# corners (n, 2), their ids (n,), markers' corners as OpenCV gives them, and the markers' ids
_Found = tuple[np.ndarray, np.ndarray, Sequence[np.ndarray], np.ndarray | None]


def _find_charuco(made: cv2.aruco.CharucoBoard, image: np.ndarray, thorough: bool) -> _Found:
    found = _detected(made, image, 2)
    if len(found[1]) >= _FEW_CORNERS or found[3] is None or not thorough:
        return found
    more = _detected(made, image, 1)  # what hides much of the board leaves few corners both their markers
    return more if len(more[1]) > len(found[1]) else found


def _detected(made: cv2.aruco.CharucoBoard, image: np.ndarray, markers: int) -> _Found:
    settings = cv2.aruco.CharucoParameters()
    settings.tryRefineMarkers, settings.minMarkers = True, markers
    detector = cv2.aruco.CharucoDetector(made, settings)
    found, ids, quads, marks = detector.detectBoard(image)
    if ids is None or found is None:
        return np.zeros((0, 2)), np.zeros(0, int), quads if quads is not None else (), marks
    return np.asarray(found, float).reshape(-1, 2), np.asarray(ids).reshape(-1).astype(int), quads, marks


def _of_board(
    made: cv2.aruco.Board, quads: Sequence[np.ndarray], marks: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray]:
    if marks is None or len(marks) == 0:
        return np.zeros((0, 2)), np.zeros(0, int)
    place = {int(k): n for n, k in enumerate(np.asarray(made.getIds()).reshape(-1))}
    pixels, ids = [], []
    for quad, mark in zip(quads, np.asarray(marks).reshape(-1), strict=True):
        if int(mark) in place:
            pixels.append(np.asarray(quad, float).reshape(4, 2))
            ids.append(4 * place[int(mark)] + np.arange(4))
    if not pixels:
        return np.zeros((0, 2)), np.zeros(0, int)
    return np.concatenate(pixels), np.concatenate(ids)


def _refine(
    board: Board, fine: np.ndarray, points: np.ndarray, found: np.ndarray, offset: np.ndarray | float
) -> tuple[np.ndarray, np.ndarray]:
    """Sub-pixel places with a window that stays clear of the markers' edges, and their expected error."""
    if len(found) < 4:
        return found, np.full(len(found), 0.5)
    margin = _clear_margin(board) * _smallest_scale(points[:, :2], found)
    half = np.clip(np.floor(0.8 * margin), 2, 9).astype(int)
    pixels, offset = found.copy(), np.broadcast_to(offset, found.shape)
    for window in np.unique(half):
        chosen = half == window
        start = np.ascontiguousarray(found[chosen] - offset[chosen], np.float32).reshape(-1, 1, 2)
        stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-3)
        moved = cv2.cornerSubPix(fine, start.copy(), (int(window),) * 2, (-1, -1), stop).reshape(-1, 2)
        moved = moved + offset[chosen]
        far = np.hypot(*(moved - found[chosen]).T) > 1.5
        pixels[chosen] = np.where(far[:, None], found[chosen], moved)
    return pixels, 0.15 / np.sqrt(half)


def expected_places(points: np.ndarray, corners: Corners) -> np.ndarray:
    """Where corners ``points`` (n, 3) of a flat board are about, (n, 2) pixels: those found where they are, others by a
    homography, off as far as it is at the nearest that was found. Far outside where that cannot be told."""
    if len(corners) < 4:
        return np.full((len(points), 2), -1e6)
    matrix, _ = cv2.findHomography(corners.points[:, :2], corners.pixels)
    if matrix is None:
        return np.full((len(points), 2), -1e6)
    places, there = (_mapped(matrix, flat[:, :2]) for flat in (points, corners.points))
    away = ((points[:, None, :2] - corners.points[None, :, :2]) ** 2).sum(2)
    return places + (corners.pixels - there)[away.argmin(1)]


def _mapped(homography: np.ndarray, flat: np.ndarray) -> np.ndarray:
    lifted = np.column_stack([flat, np.ones(len(flat))]) @ homography.T
    return lifted[:, :2] / lifted[:, 2:]


def _clear_margin(board: Board) -> float:
    """How far around a corner the print holds nothing else, length units."""
    if isinstance(board, CharucoBoard):
        return board.gap / 2
    if isinstance(board, GridBoard):
        return min(board.marker_separation, board.marker_length / 7)
    sides = [np.linalg.norm(np.asarray(c)[1] - np.asarray(c)[0]) for _, c in board.marker_corners]
    return float(min(sides)) / 7


def _smallest_scale(flat: np.ndarray, pixels: np.ndarray) -> np.ndarray:
    """Pixels per length in the most foreshortened direction at each corner, (n,)."""
    homography, _ = cv2.findHomography(flat.reshape(-1, 1, 2), pixels.reshape(-1, 1, 2), cv2.RANSAC, 3.0)
    if homography is None:
        return np.full(len(flat), 1.0)
    lifted = np.column_stack([flat, np.ones(len(flat))]) @ homography.T
    top, w = lifted[:, :2], lifted[:, 2]
    jacobian = (homography[None, :2, :2] - (top / w[:, None])[:, :, None] * homography[2, :2]) / w[
        :, None, None
    ]
    return np.linalg.svd(jacobian, compute_uv=False)[:, 1]
