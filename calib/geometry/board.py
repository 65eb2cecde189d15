"""The printed board: where its corners are in the world, and where they are in a photo.

Corners have one number each: OpenCV's ChArUco id, or four times a marker's place in the board plus 0 to 3 (clockwise
from the top left). OpenCV's board frame has y down the page and z into it; it is turned to ours here and nowhere else.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from photogonio.capture.errors import InputError
from photogonio.capture.photoset import (
    MANIFEST,
    Board,
    CharucoBoard,
    GridBoard,
    LooseMarkers,
    PhotoSet,
    PrintedBoard,
)

FEWEST_CORNERS = 6  # that tell where the camera was
# by names of units: one millimetre in them
_OF_MILLIMETRE = (
    dict.fromkeys(("mm", "millimetre", "millimetres", "millimeter", "millimeters"), 1.0)
    | dict.fromkeys(("cm", "centimetre", "centimetres", "centimeter", "centimeters"), 0.1)
    | dict.fromkeys(("m", "metre", "metres", "meter", "meters"), 0.001)
    | dict.fromkeys(("um", "\u00b5m", "\u03bcm", "micron", "microns", "micrometre", "micrometres"), 1000.0)
    | dict.fromkeys(("in", "inch", "inches", '"'), 1.0 / 25.4)
    | dict.fromkeys(("ft", "foot", "feet", "'"), 1.0 / 304.8)
)
_PAGE = 300.0  # millimetres: the diagonal of a print on a page, about


@dataclass(frozen=True, slots=True)
class Corners:
    """The board's corners found in one photo."""

    ids: np.ndarray  # (n,) int
    points: np.ndarray  # (n, 3) world
    pixels: np.ndarray  # (n, 2)
    sigma: np.ndarray  # (n,) expected standard error of each coordinate, pixels
    marker_ids: np.ndarray  # (m,) every marker seen, of this board or not
    marker_pixels: np.ndarray  # (m, 4, 2)

    def __len__(self) -> int:
        return len(self.ids)

    def keep(self, mask: np.ndarray) -> Corners:
        return Corners(
            self.ids[mask],
            self.points[mask],
            self.pixels[mask],
            self.sigma[mask],
            self.marker_ids,
            self.marker_pixels,
        )


def dictionary(name: str) -> cv2.aruco.Dictionary:
    """OpenCV's predefined dictionary of this name; InputError if there is none."""
    number = getattr(cv2.aruco, name, None)
    if not name.startswith("DICT_") or not isinstance(number, int):
        raise InputError(f"{MANIFEST}: board.dictionary", f"no OpenCV dictionary is called {name!r}")
    return cv2.aruco.getPredefinedDictionary(number)


def board_size(board: Board) -> np.ndarray:
    """Width and height of the printed pattern, (2,) length units; that of the corners' box for loose markers."""
    if isinstance(board, CharucoBoard):
        return np.array(board.squares, float) * board.square_length
    if isinstance(board, GridBoard):
        count = np.array(board.markers, float)
        return count * board.marker_length + (count - 1) * board.marker_separation
    corners = np.concatenate([np.asarray(c, float) for _, c in board.marker_corners])
    return corners[:, :2].max(0)


def millimetre(photoset: PhotoSet) -> float:
    """One millimetre in the set's unit of length. Where its name says nothing, the board is taken to fill a page; 1
    where there is none."""
    known = _OF_MILLIMETRE.get(photoset.length_unit.strip().lower().rstrip("."))
    if known is not None or photoset.board is None:
        return known or 1.0
    return float(np.hypot(*board_size(photoset.board))) / _PAGE


def opencv_board(board: Board) -> cv2.aruco.Board:
    """The board as OpenCV knows it (in its own frame; loose markers in ours)."""
    marks = dictionary(board.dictionary)
    try:
        if isinstance(board, CharucoBoard):
            return _opencv_charuco(board, marks)
        if isinstance(board, GridBoard):
            ids = board.first_id + np.arange(board.markers[0] * board.markers[1], dtype=np.int32)
            return cv2.aruco.GridBoard(
                board.markers, board.marker_length, board.marker_separation, marks, ids
            )
        corners = [np.asarray(c, np.float32).reshape(4, 3) for _, c in board.marker_corners]
        ids = np.array([k for k, _ in board.marker_corners], np.int32)
        return cv2.aruco.Board(corners, marks, ids)
    except cv2.error as error:
        raise InputError(f"{MANIFEST}: board", f"OpenCV refuses this board ({error.err})") from error


def _opencv_charuco(board: CharucoBoard, marks: cv2.aruco.Dictionary) -> cv2.aruco.CharucoBoard:
    columns, rows = board.squares
    ids = board.first_id + np.arange(columns * rows // 2 + (columns * rows) % 2)
    ids = ids[: np.size(cv2.aruco.CharucoBoard((columns, rows), 2.0, 1.0, marks).getIds())]
    made = cv2.aruco.CharucoBoard(
        (columns, rows), board.square_length, board.marker_length, marks, ids.astype(np.int32)
    )
    made.setLegacyPattern(board.legacy_pattern)
    return made


def board_points(board: Board) -> np.ndarray:
    """World places of all corners by number, (n, 3)."""
    made = opencv_board(board)
    if isinstance(made, cv2.aruco.CharucoBoard):
        return _to_world(board, np.asarray(made.getChessboardCorners()))
    points = np.concatenate([np.asarray(p, float).reshape(4, 3) for p in made.getObjPoints()])
    return points if isinstance(board, LooseMarkers) else _to_world(board, points)


def marker_middles(board: PrintedBoard) -> tuple[np.ndarray, np.ndarray]:
    """Ids (n,) of a printed board's markers, and world places (n, 3) of their middles."""
    made = opencv_board(board)
    quads = np.array([np.asarray(p, float).reshape(4, 3) for p in made.getObjPoints()])
    return np.asarray(made.getIds()).ravel().astype(int), _to_world(board, quads.mean(axis=1))


def _to_world(board: Board, points: np.ndarray) -> np.ndarray:
    x, y, z = np.asarray(points, float).reshape(-1, 3).T
    return np.column_stack([x, board_size(board)[1] - y, -z])
