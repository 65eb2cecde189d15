"""A printable board with places for the sample, two mirror balls and a white patch: its layout, and its
manifest.

All lengths in millimetres; the origin is the lower-left corner of the printed pattern, y up the page.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from photogonio.capture.errors import InputError
from photogonio.capture.photoset import CharucoBoard, GridBoard, PrintedBoard

PAPERS = {"a4": (297.0, 210.0), "a3": (420.0, 297.0), "letter": (279.4, 215.9)}  # landscape
KINDS = ("charuco", "aruco-grid")
DICTIONARIES = ("DICT_5X5_250", "DICT_5X5_1000")  # the first that has enough markers
EDGE = 10.0  # most printers leave this much of the paper blank
FOOT = 16.0  # for the ruler and a line of text
# of the strip of greys: device grey, mm below the pattern and high; the ruler stays clear
GREYS = (0.85, 0.7, 0.55, 0.42, 0.3, 0.2)
STRIP_BELOW, STRIP_HEIGHT = 4.0, 8.0
MARKER_SHARE = 0.75  # of a square (charuco), or of the distance of two markers (aruco-grid)


@dataclass(frozen=True, slots=True)
class Target:
    """The board, and where on it things go."""

    paper: str
    page: tuple[float, float]  # width, height
    corner: tuple[float, float]  # of the pattern's origin from the page's lower-left corner
    board: PrintedBoard
    size: tuple[float, float]  # of the pattern
    sample: tuple[float, float]  # centre
    balls: tuple[tuple[float, float], tuple[float, float]]  # centres
    patch: np.ndarray  # (4, 2) corners of the white patch
    greys: tuple[
        tuple[float, np.ndarray], ...
    ]  # of the strip: grey as it is asked of the printer, and corners (4, 2)


def make_target(
    *, paper: str = "a4", kind: str = "charuco", square: float = 20.0, dictionary: str | None = None
) -> Target:
    """As many squares (or markers, ``square`` apart) as the paper takes, centred above the ruler.

    Raises InputError for an unknown paper, kind or dictionary, or squares that do not suit them.
    """
    if paper not in PAPERS:
        raise InputError("--paper", f"expected one of {', '.join(PAPERS)}, found {paper!r}")
    if kind not in KINDS:
        raise InputError("--kind", f"expected one of {', '.join(KINDS)}, found {kind!r}")
    if not 0.0 < square < np.inf:
        raise InputError("--square", f"expected a length above 0, found {square:g}")
    width, height = PAPERS[paper]
    marker = round(MARKER_SHARE * square, 3)
    gap = square - marker if kind == "aruco-grid" else 0.0  # after the last marker none is needed
    columns = int((width - 2 * EDGE + gap) // square)
    rows = int((height - 2 * EDGE - FOOT + gap) // square)
    if columns < 5 or rows < 4:
        raise InputError("--square", f"{square:g} mm leaves {columns} x {rows} squares, fewer than 5 x 4")
    needed = columns * rows // (2 if kind == "charuco" else 1)
    if dictionary is None and needed > (most := markers_of(DICTIONARIES[-1])):
        raise InputError("--square", f"{square:g} mm takes {needed} markers, more than the {most} there are")
    name = settle_dictionary(dictionary, needed)
    board: PrintedBoard
    if kind == "charuco":
        board = CharucoBoard(name, (columns, rows), square, marker)
    else:
        board = GridBoard(name, (columns, rows), marker, gap)
    size = (columns * square - gap, rows * square - gap)
    corner = ((width - size[0]) / 2, (height - FOOT - size[1]) / 2 + FOOT)
    free = free_cells(board)
    cell = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * (square - gap)
    middles = free * square + (square - gap) / 2
    places = ((0, 0), size, (size[0], 0), (size[0] / 2, size[1] / 2))
    low, high, right, middle = (nearest(middles, place) for place in places)
    return Target(
        paper,
        (width, height),
        corner,
        board,
        size,
        sample=tuple(middles[middle].tolist()),
        balls=(tuple(middles[low].tolist()), tuple(middles[high].tolist())),
        patch=free[right] * square + cell,
        greys=grey_strip(size[0]),
    )


def grey_strip(width: float) -> tuple[tuple[float, np.ndarray], ...]:
    """Greys in a row below the pattern of that ``width``, from light to dark."""
    side = width / len(GREYS)
    low, high = -STRIP_BELOW - STRIP_HEIGHT, -STRIP_BELOW
    found = []
    for k, grey in enumerate(GREYS):
        left, right = k * side, (k + 1) * side
        found.append((grey, np.array([(left, low), (right, low), (right, high), (left, high)])))
    return tuple(found)


def settle_dictionary(name: str | None, needed: int) -> str:
    """A dictionary of at least ``needed`` markers: the named one, or the first of DICTIONARIES."""
    for candidate in DICTIONARIES if name is None else (name,):
        if not candidate.startswith("DICT_") or not hasattr(cv2.aruco, candidate):
            raise InputError("--dictionary", f"OpenCV has no {candidate!r}")
        size = markers_of(candidate)
        if size >= needed:
            return candidate
    raise InputError("--dictionary", f"{candidate} has {size} markers, the board needs {needed}")


def markers_of(name: str) -> int:
    """How many markers a dictionary of OpenCV has."""
    return len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name)).bytesList)


def free_cells(board: PrintedBoard) -> np.ndarray:
    """Columns and rows (n, 2), from the lower left, of cells that a ball or the patch may cover.

    Black squares of a ChArUco board, which hold no marker; any cell of a grid.
    """
    columns, rows = board.markers if isinstance(board, GridBoard) else board.squares
    cells = np.array([(x, y) for y in range(rows) for x in range(columns)])
    if isinstance(board, GridBoard):
        return cells
    middles = marker_corners(board)[1].mean(axis=1)
    marked = set(map(tuple, np.floor(middles / board.square_length).astype(int).tolist()))
    return np.array([cell for cell in cells.tolist() if tuple(cell) not in marked])


def nearest(points: np.ndarray, place: tuple[float, float]) -> int:
    return int(np.argmin(np.linalg.norm(points - place, axis=1)))


def marker_corners(board: PrintedBoard) -> tuple[np.ndarray, np.ndarray]:
    """Ids (n,) and corners (n, 4, 2), clockwise from the top left as printed, y up the page."""
    marks = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    made: cv2.aruco.Board
    if isinstance(board, CharucoBoard):
        made = cv2.aruco.CharucoBoard(board.squares, board.square_length, board.marker_length, marks)
        height = board.squares[1] * board.square_length
    else:
        made = cv2.aruco.GridBoard(board.markers, board.marker_length, board.marker_separation, marks)
        height = board.markers[1] * (board.marker_length + board.marker_separation) - board.marker_separation
    corners = np.array(made.getObjPoints(), float)[..., :2]
    corners[..., 1] = height - corners[..., 1]  # OpenCV's y goes down the page
    return np.ravel(made.getIds()), corners


def black_rectangles(target: Target) -> np.ndarray:
    """All ink of the pattern as rectangles (n, 4) x, y, width, height: squares and black cells of markers.

    A marker's black cells of one row that touch are one rectangle. Markers of a grid under a ball or the
    patch are left out: their place is white.
    """
    board = target.board
    boxes = []
    if isinstance(board, CharucoBoard):
        step = board.square_length
        boxes += [(x * step, y * step, step, step) for x, y in free_cells(board)]
    marks = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    side = marks.markerSize + 2
    cell = board.marker_length / side
    covered = [target.sample, *target.balls, tuple(target.patch.mean(axis=0))]
    for number, corners in zip(*marker_corners(board), strict=True):
        if any(np.abs(corners.mean(axis=0) - place).max() < board.marker_length / 2 for place in covered):
            continue
        black = cv2.aruco.generateImageMarker(marks, int(number), side) == 0
        left, top = corners[0]
        for row in range(side):
            edges = np.flatnonzero(np.diff(np.concatenate([[0], black[row].astype(int), [0]])))
            for start, end in edges.reshape(-1, 2):
                boxes.append((left + start * cell, top - (row + 1) * cell, (end - start) * cell, cell))
    return np.array(boxes)
