"""Boards of which nothing is told come out as they were drawn."""

import cv2
import numpy as np
import pytest

from photogonio.calib.geometry.board import opencv_board
from photogonio.calib.identify.layout import find_board, find_layout, seen_markers
from photogonio.capture.photoset import CharucoBoard, GridBoard
from photogonio.capture.target.layout import make_target

LONGER = 620  # pixels of the drawn pattern's longer side
BOARDS = [
    CharucoBoard("DICT_5X5_250", (9, 7), 20.0, 15.0),
    CharucoBoard("DICT_6X6_250", (5, 8), 20.0, 10.0, legacy_pattern=True),
    CharucoBoard("DICT_4X4_250", (8, 6), 20.0, 14.0, first_id=30),
    GridBoard("DICT_7X7_250", (6, 5), 14.0, 6.0),
]


def seen(board):
    """Markers of a photo of the board that looks at it askew."""
    columns, rows = board.squares if isinstance(board, CharucoBoard) else board.markers
    scale = LONGER / max(columns, rows)
    size = (round(columns * scale), round(rows * scale))
    flat = np.pad(opencv_board(board).generateImage(size, marginSize=0), 20, constant_values=255)
    height, width = flat.shape
    corners = np.float32([[0, 0], [width, 0], [width, height], [0, height]])
    there = corners * 0.8 + np.float32([[90, 60], [30, 100], [60, 40], [40, 80]])
    turn = cv2.getPerspectiveTransform(corners, there)
    return seen_markers(cv2.warpPerspective(flat, turn, (width + 60, height + 60), borderValue=255))


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: f"{board.kind}-{board.dictionary}")
def test_a_board_is_found_with_its_layout(board):
    assert find_board([seen(board)]).board == board


def test_a_sheet_of_ours_tells_its_size():
    board = make_target(paper="a4", square=25.0).board
    found = find_board([seen(board)])
    assert found.sheet == "a4" and found.board == board


def test_rows_that_a_photo_does_not_show_come_from_another():
    whole = seen(BOARDS[0])
    upper = whole.quads.mean(axis=1)[:, 1] < np.median(whole.quads.mean(axis=1)[:, 1])
    part = type(whole)(whole.family, whole.ids[upper], whole.quads[upper])
    assert find_board([part]).board.squares[1] < 7
    assert find_board([part, whole]).board == BOARDS[0]


def test_markers_in_no_order_are_no_board():
    found = seen(BOARDS[0])
    mixed = np.random.default_rng(3).permutation(found.ids)
    assert find_layout(type(found)(found.family, mixed, found.quads)) is None
