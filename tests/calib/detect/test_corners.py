"""The board's corners to a fraction of a pixel, above all not off on one side."""

import itertools

import numpy as np
import pytest

from photogonio.calib.detect.corners import corners_of_half, find_corners
from photogonio.calib.detect.gray import detection_image, halved
from photogonio.calib.geometry.board import board_points, opencv_board
from photogonio.capture.photoset import CharucoBoard
from tests.drawn.board_photos import NOISE, POSES, misses
from tests.drawn.boards import BOARD, CAMERA, draw, views_of


@pytest.mark.parametrize("stage", ["first", "closer"])
def test_corners_have_no_bias_and_little_scatter(stage, request):
    miss = misses(request.getfixturevalue(stage))
    assert len(miss) > 0.9 * len(POSES) * len(board_points(BOARD))
    assert np.abs(miss.mean(0)).max() < 0.02, miss.mean(0)
    assert np.sqrt((miss**2).sum(1).mean()) < 0.2


def test_markers_that_are_small_in_half_the_size_are_not_looked_for_there(first):
    image = detection_image(halved(draw(CAMERA, POSES[0], NOISE, 0).astype(np.float32)))
    assert corners_of_half(BOARD, image) is None


def test_a_picture_shifted_by_whole_pixels_shifts_its_corners(reader):
    level = reader(views_of(reader)[0]).value[..., 0]
    gray = (np.sqrt(np.clip(level, 0, 1)) * 255).astype(np.uint8)
    whole = find_corners(BOARD, gray, level)
    part = find_corners(BOARD, gray[9:, 14:].copy(), level[9:, 14:].copy())
    _, here, there = np.intersect1d(whole.ids, part.ids, return_indices=True)
    assert len(here) > 25
    # each stops within a hundredth of a pixel of where it converges
    np.testing.assert_allclose(part.pixels[there] + [14, 9], whole.pixels[here], atol=0.02)


def test_an_empty_picture_holds_no_corners():
    blank = np.full((120, 160), 90, np.uint8)
    assert len(find_corners(BOARD, blank, blank.astype(np.float32) / 255)) == 0


def test_every_corner_has_one_number(closer):
    for a, b in itertools.pairwise(np.sort(one.corners.ids) for one in closer):
        assert len(np.unique(a)) == len(a)
        assert len(np.unique(b)) == len(b)


def test_corners_with_one_marker_left_are_found_where_there_are_few_others():
    """Markers of every other row are hidden: no corner has both of its own."""
    board = CharucoBoard("DICT_5X5_250", squares=(9, 7), square_length=20.0, marker_length=15.0)
    side = 60
    image = np.pad(
        opencv_board(board).generateImage((9 * side, 7 * side), marginSize=0), 40, constant_values=255
    )
    for row in range(7):
        for column in range(9):
            if row % 2 and (row + column) % 2:  # the white squares there
                y, x = 40 + row * side + 5, 40 + column * side + 5
                image[y : y + side - 10, x : x + side - 10] = 128
    found = find_corners(board, image, (image / 255.0).astype(np.float32))
    assert len(found) >= 20
    true = np.column_stack([found.points[:, 0], 140.0 - found.points[:, 1]]) * side / 20.0 + 39.5
    # what is painted over is no more than 5 pixels from a corner: the refinement's window stays inside of that
    assert np.abs(found.pixels - true).max() < 0.5
