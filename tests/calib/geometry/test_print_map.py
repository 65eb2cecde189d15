"""The print as a map: loose markers drawn where they are said to be agree with the boards that OpenCV draws whole."""

import numpy as np
import pytest

from photogonio.calib.geometry.board import opencv_board
from photogonio.calib.geometry.print_map import draw_print, square_pitch
from photogonio.capture.photoset import Board, GridBoard, LooseMarkers

GRID = GridBoard("DICT_5X5_250", markers=(4, 3), marker_length=14.0, marker_separation=4.0)
CELL = 2.0  # 14 over 5 + 2


def as_loose(board: Board, turn: np.ndarray | None = None) -> Board:
    """The grid's markers as loose ones, turned about the origin by ``turn`` (2, 2)."""
    made = opencv_board(board)
    height = made.getRightBottomCorner()[1]
    corners = []
    for k, quad in zip(made.getIds().ravel(), made.getObjPoints(), strict=True):
        flat = np.column_stack([quad[:, 0], height - quad[:, 1]]).astype(float)
        flat = flat if turn is None else flat @ turn.T
        corners.append((int(k), np.column_stack([flat, np.zeros(4)])))
    return LooseMarkers(board.dictionary, marker_corners=tuple(corners))


def middles() -> np.ndarray:
    """Middles (n, 2) of all cells of all markers of the grid."""
    x, y = (np.arange(n)[:, None] * 18.0 + CELL * (np.arange(7) + 0.5) for n in (4, 3))
    return np.stack(np.meshgrid(x.ravel(), y.ravel()), -1).reshape(-1, 2)


@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_loose_markers_have_the_tones_of_the_same_markers_in_a_grid(angle):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    loose, whole = draw_print(as_loose(GRID, turn)), draw_print(GRID)
    places = middles()
    turned = places @ turn.T
    inside = (turned > CELL).all(1)  # turned out of the first quadrant nothing is drawn
    white, clear = loose.at(turned[inside])
    expected, _ = whole.at(places[inside])
    assert inside.sum() > 400 and 0.2 < expected.mean() < 0.6
    np.testing.assert_array_equal(white, expected)
    assert clear.min() > 0.8 * CELL / 2  # the distance transform's 5 x 5 metric, and whole pixels
    np.testing.assert_allclose(loose.tone_at(turned[inside]), expected, atol=1e-6)


def test_around_loose_markers_nothing_is_known():
    loose = draw_print(as_loose(GRID))
    gap = np.array([[16.0, 7.0], [7.0, 16.0], [34.0, 30.0]])
    white, clear = loose.at(gap)
    assert not white.any() and (clear == 0).all()
    rim = np.array([[0.25 * CELL, 0.25 * CELL]])  # black all around: the nearest edge is the marker's own
    assert loose.at(rim)[1] == pytest.approx(0.25 * CELL, abs=0.1 * CELL)


def test_markers_off_the_board_are_not_read():
    raised = tuple((k, c + np.array([0.0, 0.0, 5.0])) for k, c in as_loose(GRID).marker_corners)
    assert draw_print(LooseMarkers(GRID.dictionary, marker_corners=raised)) is None


def test_markers_before_the_origin_are_not_read_and_do_no_harm():
    before = tuple((k, c - np.array([0.0, 200.0, 0.0])) for k, c in as_loose(GRID).marker_corners)
    assert draw_print(LooseMarkers(GRID.dictionary, marker_corners=before)) is None


def test_what_errs_together_is_as_large_as_a_marker():
    assert square_pitch(as_loose(GRID)) == pytest.approx(14.0)
    assert square_pitch(GRID) == pytest.approx(18.0)
