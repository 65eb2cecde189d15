"""A board that the manifest has wrong: what is said names the key, and what the photos show."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from photogonio.calib.detect.photo_reader import look
from photogonio.calib.diagnose.board.wrong_board import board_fault
from photogonio.calib.geometry.board import opencv_board
from photogonio.capture.photoset import Board, CharucoBoard, GridBoard, LooseMarkers
from tests.drawn.board_photos import POSES
from tests.drawn.boards import BLACK, BOARD, CAMERA, WHITE, draw, quiet, radiance, reader_of, views_of

GRID = GridBoard("DICT_4X4_50", markers=(6, 4), marker_length=12.0, marker_separation=4.0)
_SCALE = 5  # pixels a length unit
_BORDER = 40


def fault(board: Board, level: np.ndarray) -> str | None:
    reader = reader_of(board, {"one.png": radiance(level, 0.004)})
    return board_fault(board, reader, look(reader, views_of(reader), quiet, ""))


@pytest.fixture(scope="module")
def charuco():
    return draw(CAMERA, POSES[0], 0.004, 0)


@pytest.fixture(scope="module")
def grid():
    marks = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    made = cv2.aruco.GridBoard(GRID.markers, GRID.marker_length, GRID.marker_separation, marks)
    seen = made.generateImage((92 * _SCALE, 60 * _SCALE), marginSize=0)
    framed = cv2.copyMakeBorder(seen, *(_BORDER,) * 4, cv2.BORDER_CONSTANT, value=255)
    return np.where(framed > 127, WHITE, BLACK).astype(np.float32)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"squares": (6, 8)}, "board.squares = [8, 6], not [6, 8]"),
        ({"squares": (8, 5)}, "board.squares = [8, 6], not [8, 5]"),
        ({"squares": (7, 5)}, "board.squares: 8 columns"),
        ({"first_id": 7}, "board.first_id = 0, not 7"),
        ({"dictionary": "DICT_5X5_50"}, "board.dictionary: the photos show markers of DICT_4X4_1000"),
        ({"dictionary": "DICT_4X4_100"}, None),  # holds the same markers
        ({"marker_length": 8.0}, None),  # corners do not depend on it
        ({}, None),
    ],
)
def test_a_charuco_board(charuco, wrong, said):
    found = fault(replace(BOARD, **wrong), charuco)
    assert found is None if said is None else said in found


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"markers": (4, 6)}, "board.markers = [6, 4], not [4, 6]"),
        ({"markers": (6, 3)}, "board.markers: 6 columns"),
        ({"first_id": 3}, "board.first_id = 0, not 3"),
        ({"marker_separation": 16.0}, "of their length apart, marker_separation and marker_length say 1.3"),
        ({}, None),
    ],
)
def test_a_grid(grid, wrong, said):
    found = fault(replace(GRID, **wrong), grid)
    assert found is None if said is None else said in found


def test_a_board_of_the_other_kind(charuco, grid):
    """Markers of both are the same; which lie where tells."""
    columns, _ = BOARD.squares
    as_grid = GridBoard(BOARD.dictionary, BOARD.squares, BOARD.marker_length, BOARD.gap)
    assert f'board.kind = "charuco" of {columns} columns' in fault(as_grid, charuco)
    as_chess = CharucoBoard(GRID.dictionary, (6, 8), GRID.pitch, GRID.marker_length)
    assert 'board.kind = "aruco-grid" of 6 columns' in fault(as_chess, grid)


@pytest.mark.parametrize("board", ["charuco", "grid"])
@pytest.mark.parametrize(
    ("change", "said"),
    [(lambda seen: seen[:, ::-1], "mirrored"), (lambda seen: WHITE + BLACK - seen, "white on black")],
)
def test_markers_that_are_mirrored_or_white_on_black(board, change, said, request):
    level = request.getfixturevalue(board)
    assert said in fault(BOARD if board == "charuco" else GRID, change(level))


def test_loose_markers_that_are_mirrored_or_others(grid):
    made = opencv_board(GRID)
    corners = tuple((k, np.asarray(c, float)) for k, c in zip(range(24), made.getObjPoints(), strict=True))
    loose = LooseMarkers(GRID.dictionary, marker_corners=corners)
    assert "mirrored" in fault(loose, grid[:, ::-1])
    assert "DICT_4X4" in fault(replace(loose, dictionary="DICT_6X6_50"), grid)
    assert "up the page" in fault(loose, grid)  # OpenCV's frame has y down it
    upright = tuple((k, c * [1, -1, 1] + [0, 60, 0]) for k, c in corners)
    assert fault(replace(loose, marker_corners=upright), grid) is None


@pytest.mark.parametrize("squares", [(8, 6), (9, 6), (7, 8)])
@pytest.mark.parametrize("legacy", [False, True])
def test_the_squares_of_old_boards_are_told(squares, legacy):
    """OpenCV before 4.6 began boards of an even number of rows with a white square; of an odd number of columns most
    markers lie as they do today, beside one column."""
    board = replace(BOARD, squares=squares, legacy_pattern=legacy)
    size = [int(side * board.square_length * _SCALE) for side in squares]
    seen = opencv_board(board).generateImage(size, marginSize=0)
    framed = cv2.copyMakeBorder(seen, *(_BORDER,) * 4, cv2.BORDER_CONSTANT, value=255)
    level = np.where(framed > 127, WHITE, BLACK).astype(np.float32)
    said = fault(replace(board, legacy_pattern=not legacy), level)
    assert f"board.legacy_pattern = {str(legacy).lower()}" in said
    assert fault(board, level) is None


def test_a_photo_of_something_else_says_nothing():
    assert fault(BOARD, np.full((360, 480), 0.3, np.float32)) is None


@pytest.mark.parametrize(("rows", "said"), [(6, None), (7, "is it [8, 6]?"), (8, "is it [8, 6]?")])
def test_rows_that_no_photo_of_the_bare_board_shows(rows, said):
    """They would stand below the print, in the picture; and places are counted from the last."""
    level = draw(CAMERA, POSES[0], 0.004, 0)
    small = np.pad(level[::2, ::2], ((20, 160), (80, 160)), mode="edge")
    reader = reader_of(
        replace(BOARD, squares=(8, rows)), {f"{k}.png": radiance(small, 0.004) for k in range(3)}
    )
    found = board_fault(reader.photoset.board, reader, look(reader, views_of(reader), quiet, ""))
    assert found is None if said is None else said in found


def loose(grid_board: GridBoard) -> list[tuple[int, np.ndarray]]:
    """The grid's markers one by one, y up the page."""
    made = opencv_board(grid_board)
    quads = [np.asarray(p, float).reshape(4, 3) * [1, -1, 1] + [0, 60, 0] for p in made.getObjPoints()]
    return list(zip(map(int, np.ravel(made.getIds())), quads, strict=True))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda k, c: (k, c), None),
        (lambda k, c: (k, c + np.array([0.3, -0.3, 0])), None),
        (lambda k, c: ({3: 20, 20: 3}.get(k, k), c), "markers 3, 20 lie elsewhere"),
        (lambda k, c: (k, c + np.array([9, 0, 0]) * (k == 7)), "marker 7 lies elsewhere"),
        (lambda k, c: (7 * k % 24, c), "elsewhere than given"),
        (lambda k, c: ((k + 1) % 24, c), "elsewhere than given"),
    ],
)
def test_loose_markers_that_lie_elsewhere(grid, change, said):
    board = LooseMarkers(GRID.dictionary, tuple(change(k, c) for k, c in loose(GRID)))
    found = fault(board, grid)
    assert found is None if said is None else said in found


def test_other_numbers_of_the_same_dictionary(grid):
    board = LooseMarkers(GRID.dictionary, tuple((k + 24, c) for k, c in loose(GRID)))
    assert "markers 0 to 23 of DICT_4X4_50" in fault(board, grid)
