"""A quick look finds what a thorough one does."""

import numpy as np
import pytest

from photogonio.calib.geometry.pose import fit_pose
from photogonio.calib.identify.layout import find_board
from photogonio.calib.identify.quick_look import enlarged, quick_look
from tests.drawn.board_photos import NOISE, POSES
from tests.drawn.boards import BOARD, CAMERA, draw


@pytest.fixture(scope="module")
def level():
    return draw(CAMERA, POSES[0], NOISE, 0).astype(np.float32)


def test_the_board_is_where_it_was_drawn(level):
    seen = quick_look(level, np.ones(level.shape, bool), BOARD)
    fit = fit_pose(CAMERA, seen.corners)
    assert seen.clear and fit.rms < 0.3
    np.testing.assert_allclose(fit.pose.center, POSES[0].center, rtol=0.02, atol=2.0)


def test_a_board_that_nobody_told_is_found(level):
    seen = quick_look(level, np.ones(level.shape, bool), None)
    found = find_board([seen.markers]).board
    assert found.squares == BOARD.squares
    assert found.dictionary == "DICT_4X4_250"  # which begins with the markers of DICT_4X4_50


def test_clipped_pixels_are_counted(level):
    usable = np.ones(level.shape, bool)
    usable[:10] = False
    seen = quick_look(level, usable, BOARD)
    assert seen.clipped == pytest.approx(10 / level.shape[0])
    assert seen.full[0].all() and not seen.full[-1].any()


def test_places_in_a_smaller_picture_are_the_middles_of_its_blocks():
    np.testing.assert_allclose(enlarged(np.array([[0.0, 3.0]]), 4), [[1.5, 13.5]])
