"""The board's frame, and its corners in drawn and in real photos: above all that they are not off on one side."""

from pathlib import Path

import numpy as np
import pytest

from photogonio.calib.geometry.board import board_points, board_size, dictionary, millimetre
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import GridBoard, PhotoSet, Sphere
from tests.drawn.boards import BOARD


def quiet(label: str, done: int, total: int) -> None:
    pass


def test_x_runs_right_y_up_and_z_out_of_the_print():
    points = board_points(BOARD).reshape(5, 7, 3)  # OpenCV numbers them in rows from the top left
    right, down = points[:, 1:] - points[:, :-1], points[1:] - points[:-1]
    np.testing.assert_allclose(right, np.broadcast_to([12.0, 0, 0], right.shape), atol=1e-5)
    np.testing.assert_allclose(down, np.broadcast_to([0, -12.0, 0], down.shape), atol=1e-5)
    np.testing.assert_allclose(points[-1, 0], [12.0, 12.0, 0], atol=1e-5)  # origin: bottom left of the print


def test_markers_of_a_grid_stand_clockwise_from_their_top_left():
    board = GridBoard("DICT_4X4_50", markers=(3, 2), marker_length=5.0, marker_separation=1.0)
    np.testing.assert_allclose(board_size(board), [17.0, 11.0])
    points = board_points(board).reshape(6, 4, 3)
    np.testing.assert_allclose(points[0], [[0, 11, 0], [5, 11, 0], [5, 6, 0], [0, 6, 0]], atol=1e-5)
    np.testing.assert_allclose(points[5], [[12, 5, 0], [17, 5, 0], [17, 0, 0], [12, 0, 0]], atol=1e-5)


def test_an_unknown_dictionary_is_refused():
    with pytest.raises(InputError, match="DICT_NONE"):
        dictionary("DICT_NONE")


@pytest.mark.parametrize(
    ("unit", "expected"), [("mm", 1.0), ("cm", 0.1), ("Metres", 0.001), ("µm", 1000.0), ("in.", 1 / 25.4)]
)
def test_a_millimetre_is_known_in_every_usual_unit(unit, expected):
    assert millimetre(set_in(unit, BOARD)) == pytest.approx(expected)


def test_a_unit_of_which_nobody_has_heard_is_told_by_the_board():
    width, height = board_size(BOARD)
    assert millimetre(set_in("ell", BOARD)) == pytest.approx(np.hypot(width, height) / 300)
    assert millimetre(set_in("ell", None)) == 1.0


def set_in(unit, board):
    return PhotoSet(Path("."), "a", unit, Sphere(np.zeros(3), 1.0), "auto", (), board)
