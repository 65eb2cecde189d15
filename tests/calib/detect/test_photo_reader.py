"""One look at each photo, and a closer one."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.adjust.intrinsics import quick_camera
from photogonio.calib.detect import photo_reader as looking
from photogonio.calib.detect.corners import corners_of_half
from photogonio.calib.detect.gray import detection_image, halved
from photogonio.calib.detect.photo_reader import look, look_closer
from photogonio.calib.detect.subpixel import Around
from photogonio.calib.geometry.board import board_points, board_size, opencv_board
from photogonio.calib.geometry.camera import Camera
from tests.drawn.board_photos import MIDDLE, NOISE, POSES, misses
from tests.drawn.boards import BOARD, CAMERA, SIZE, draw, looking_at, quiet, views_of


def test_the_whole_print_places_corners_better_than_their_saddle_points(first, closer):
    assert (misses(closer) ** 2).mean() < (misses(first) ** 2).mean()


@pytest.mark.parametrize("most", [0, 1_000_000, 40_000_000])
def test_what_is_kept_of_photos_is_bounded_however_many_corners_a_board_has(reader, monkeypatch, most):
    monkeypatch.setattr(looking, "_MOST_BYTES", most)
    kept = [s.around.level.nbytes for s in look(reader, views_of(reader), quiet, "") if s.around is not None]
    assert sum(kept) <= most
    assert len(kept) == min(most // (4 * 49**2 * len(board_points(BOARD))), len(POSES))


@pytest.mark.parametrize("known", ["nothing", "another place"])
def test_corners_are_the_same_where_a_photo_is_read_again(known, reader, first, closer):
    off = np.full((len(board_points(BOARD)), 2), 200.0)
    around = [Around.of(*reader.level(s.view), off) if known == "another place" else None for s in first]
    again = [replace(s, around=one) for s, one in zip(first, around, strict=True)]
    camera = quick_camera([s.corners for s in first], SIZE)
    for one, other in zip(look_closer(reader, camera, again, quiet), closer, strict=True):
        np.testing.assert_array_equal(one.corners.ids, other.corners.ids)
        np.testing.assert_array_equal(one.corners.pixels, other.corners.pixels)


def test_markers_in_a_large_photo_are_found_in_one_of_half_the_size(monkeypatch):
    """As surely, and in the same places: what half the size is off by, saddle points at full size take away."""
    half = np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])  # pixels' middles are whole numbers
    matrix = np.diag([2.0, 2.0, 1.0]) @ (CAMERA.matrix + half) - half
    camera = Camera(matrix, CAMERA.distortion, (2 * SIZE[0], 2 * SIZE[1]))
    level = draw(camera, looking_at(MIDDLE + np.array([5.0, 3, 150]), MIDDLE, 0.2), NOISE, 1).astype(
        np.float32
    )
    assert corners_of_half(BOARD, detection_image(halved(level))) is not None
    whole = looking._corners(BOARD, level)
    monkeypatch.setattr(looking, "_LARGE", 0)
    found = looking._corners(BOARD, level)
    np.testing.assert_array_equal(found.ids, whole.ids)
    np.testing.assert_allclose(found.pixels, whole.pixels, atol=0.02)
    assert sorted(found.marker_ids) == sorted(whole.marker_ids)


def test_a_large_photo_in_which_few_corners_have_both_markers_loses_none(monkeypatch):
    """Every other marker is hidden, as a large sample hides some: corners have but one to tell of them."""
    half = np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
    camera = Camera(
        np.diag([2.0, 2.0, 1.0]) @ (CAMERA.matrix + half) - half,
        CAMERA.distortion,
        (2 * SIZE[0], 2 * SIZE[1]),
    )
    pose = looking_at(MIDDLE + np.array([5.0, 3, 150]), MIDDLE, 0.2)
    level = draw(camera, pose, NOISE, 1).astype(np.float32)
    for k, marker in enumerate(opencv_board(BOARD).getObjPoints()):
        if k % 2:
            flat = np.asarray(marker, float).reshape(4, 3).mean(0) * [1, -1, 0] + [0, board_size(BOARD)[1], 0]
            x, y = np.round(camera.project(pose, flat[None])[0]).astype(int)
            level[max(y - 25, 0) : y + 25, max(x - 25, 0) : x + 25] = 0.8
    whole = looking._corners(BOARD, level)
    monkeypatch.setattr(looking, "_LARGE", 0)
    assert len(whole) > 20
    np.testing.assert_array_equal(looking._corners(BOARD, level).ids, whole.ids)
