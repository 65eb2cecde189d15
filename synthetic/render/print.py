"""The printed board as exact geometry: which of its points are ink, without a raster in between.

The layout comes from OpenCV's board objects; it is turned to the world frame here, apart from calib's way.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from photogonio.capture.errors import InputError
from photogonio.capture.jit import borrowing
from photogonio.capture.photoset import Board, CharucoBoard, GridBoard, LooseMarkers

PER_BIN = 6  # markers that may touch one bin of the lookup


class PrintedPage(NamedTuple):
    """A printed page in the plane z = 0, lengths in true units."""

    extent: np.ndarray  # (4,) x0, y0, x1, y1 of the paper
    squares: (
        np.ndarray
    )  # (4,) columns, rows, length, 1 if the top left square is white; 0 columns: no chessboard
    origin: np.ndarray  # (m, 2) top left corner of each marker
    right: np.ndarray  # (m, 2) along its top edge over the edge's squared length: the dot product is 0 to 1
    down: np.ndarray  # (m, 2) along its left edge likewise
    bits: np.ndarray  # (m, k, k) uint8, 1 is white, border included
    bins: np.ndarray  # (rows, columns, PER_BIN) int32 markers near a place, -1: none
    bin_size: float


def print_of(board: Board | None, *, scale: float = 1.0) -> PrintedPage:
    """The page of a board, enlarged by ``scale`` about the origin; empty for None. Raises InputError."""
    if board is None:
        return make_print(np.zeros(4), np.zeros(4), np.zeros((0, 4, 2)), np.zeros((0, 3, 3), np.uint8))
    marks = dictionary(board.dictionary)
    squares = np.zeros(4)
    if isinstance(board, CharucoBoard):
        corners, ids, size = charuco_layout(board, marks)
        squares[:3] = *board.squares, board.square_length * scale
        squares[3] = float(board.legacy_pattern and board.squares[1] % 2 == 0)
        margin = 0.0
    elif isinstance(board, GridBoard):
        corners, ids, size = grid_layout(board, marks)
        margin = board.marker_separation
    else:
        corners, ids = loose_layout(board)
        size, margin = (
            corners.reshape(-1, 2).max(0),
            0.25 * float(np.linalg.norm(corners[0, 1] - corners[0, 0])),
        )
    extent = scale * np.array([-margin, -margin, size[0] + margin, size[1] + margin])
    side, most = marks.markerSize + 2, len(marks.bytesList)
    if np.min(ids) < 0 or np.max(ids) >= most:
        raise InputError("board", f"needs the marker {np.max(ids)}; {board.dictionary} has 0 to {most - 1}")
    bits = np.stack([cv2.aruco.generateImageMarker(marks, int(i), side) // 255 for i in ids])
    return make_print(extent, squares, scale * corners, bits)


def dictionary(name: str) -> cv2.aruco.Dictionary:
    number = getattr(cv2.aruco, name, None)
    if not name.startswith("DICT_") or number is None:
        raise InputError("board: dictionary", f"no OpenCV dictionary is called {name!r}")
    return cv2.aruco.getPredefinedDictionary(number)


def charuco_layout(
    board: CharucoBoard, marks: cv2.aruco.Dictionary
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners (m, 4, 2) clockwise from the top left, ids (m,), size of the page (2,)."""
    made = cv2.aruco.CharucoBoard(board.squares, board.square_length, board.marker_length, marks)
    made.setLegacyPattern(board.legacy_pattern)
    size = np.array(board.squares, float) * board.square_length
    return upright(made, size), np.ravel(made.getIds()) + board.first_id, size


def grid_layout(board: GridBoard, marks: cv2.aruco.Dictionary) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    made = cv2.aruco.GridBoard(board.markers, board.marker_length, board.marker_separation, marks)
    count = np.array(board.markers, float)
    size = count * board.marker_length + (count - 1) * board.marker_separation
    return upright(made, size), np.ravel(made.getIds()) + board.first_id, size


def loose_layout(board: LooseMarkers) -> tuple[np.ndarray, np.ndarray]:
    corners = np.stack([np.asarray(c, float) for _, c in board.marker_corners])
    if np.any(corners[..., 2] != 0):
        raise InputError("board: marker", "a rendered board is flat: every marker's z must be 0")
    return corners[..., :2], np.array([i for i, _ in board.marker_corners])


def upright(made: cv2.aruco.Board, size: np.ndarray) -> np.ndarray:
    """OpenCV's marker corners (y down the page) with y up the page."""
    corners = np.stack([np.asarray(p, float).reshape(4, 3)[:, :2] for p in made.getObjPoints()])
    return corners * [1.0, -1.0] + [0.0, size[1]]


def make_print(extent: np.ndarray, squares: np.ndarray, corners: np.ndarray, bits: np.ndarray) -> PrintedPage:
    right, down = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    side = float(np.linalg.norm(right, axis=1).mean()) if len(right) else 1.0
    return PrintedPage(
        extent=np.asarray(extent, float),
        squares=np.asarray(squares, float),
        origin=np.ascontiguousarray(corners[:, 0]),
        right=right / np.sum(right**2, axis=1, keepdims=True),
        down=down / np.sum(down**2, axis=1, keepdims=True),
        bits=np.ascontiguousarray(bits, np.uint8),
        bins=bin_markers(extent, corners, side),
        bin_size=side,
    )


def bin_markers(extent: np.ndarray, corners: np.ndarray, side: float) -> np.ndarray:
    columns, rows = (np.ceil((extent[2:] - extent[:2]) / side).astype(int) + 1).tolist()
    bins = np.full((rows, columns, PER_BIN), -1, np.int32)
    for k, quad in enumerate(corners):
        low, high = np.floor((np.stack([quad.min(0), quad.max(0)]) - extent[:2]) / side).astype(int)
        for row in range(low[1], high[1] + 1):
            for column in range(low[0], high[0] + 1):
                bins[row, column, np.argmin(bins[row, column])] = k  # first free place
    return bins


@borrowing
def paper_at(page: PrintedPage, x: float, y: float) -> int:
    """1 on white paper, 0 on ink, -1 beyond the page."""
    extent, squares = page.extent, page.squares
    if x < extent[0] or y < extent[1] or x > extent[2] or y > extent[3]:
        return -1
    row = int((y - extent[1]) / page.bin_size)
    column = int((x - extent[0]) / page.bin_size)
    for n in range(PER_BIN):
        k = page.bins[row, column, n]
        if k < 0:
            break
        dx, dy = x - page.origin[k, 0], y - page.origin[k, 1]
        u = dx * page.right[k, 0] + dy * page.right[k, 1]
        v = dx * page.down[k, 0] + dy * page.down[k, 1]
        if 0.0 <= u < 1.0 and 0.0 <= v < 1.0:
            side = page.bits.shape[1]
            return int(page.bits[k, int(v * side), int(u * side)])
    if squares[0] > 0:
        column = int(x / squares[2])
        row = int(squares[1]) - 1 - int(y / squares[2])  # from the top
        return (column + row + int(squares[3])) % 2
    return 1
