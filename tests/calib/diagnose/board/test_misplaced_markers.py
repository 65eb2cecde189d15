"""Markers that are printed beside their places, told by how they pull the corners."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.adjust.intrinsics import quick_camera
from photogonio.calib.detect.first_look import FirstLook, Photos
from photogonio.calib.detect.photo_reader import look, look_closer
from photogonio.calib.diagnose.board.misplaced_markers import misplaced_markers
from photogonio.calib.first_camera import placed
from photogonio.calib.geometry.board import Corners, board_points
from photogonio.calib.remarks import Remarks
from tests.drawn.board_photos import NOISE, POSES, misses
from tests.drawn.boards import BOARD, CAMERA, SIZE, draw, quiet, radiance, reader_of, views_of


def test_markers_printed_off_their_places_do_not_pull_the_corners():
    """A print of 20 pixels a square: markers that should begin after 2.5 of them begin after 2."""
    images = {f"{k}.png": radiance(draw(CAMERA, p, NOISE, k, scale=20), NOISE) for k, p in enumerate(POSES)}
    reader, remarks = reader_of(BOARD, images), Remarks()
    seen = look(reader, views_of(reader), quiet, "")
    start = quick_camera([s.corners for s in seen], SIZE)
    first = FirstLook(reader.photoset, reader, Photos(seen, [], []), remarks)
    closer = placed(first, start, quiet).samples
    assert remarks.codes() == ["markers-misplaced"]
    miss = misses(closer)
    assert np.abs(miss.mean(0)).max() < 0.01
    assert np.sqrt((miss**2).sum(1).mean()) < 0.05


def test_a_true_print_is_used_whole(reader, first):
    remarks = Remarks()
    seen = FirstLook(reader.photoset, reader, Photos(first, [], []), remarks)
    camera = quick_camera([s.corners for s in first], SIZE)
    found = placed(seen, camera, quiet).samples
    assert remarks.codes() == []
    for one, other in zip(found, look_closer(reader, camera, first, quiet), strict=True):
        np.testing.assert_array_equal(one.corners.pixels, other.corners.pixels)


def pairs(shift: float, noise: float, seed: int = 0) -> list[tuple[Corners, Corners]]:
    """Corners of four photos with the markers and without: pulled by ``shift`` of a square along x."""
    rng, points, found = np.random.default_rng(seed), board_points(BOARD), []
    for pose in POSES[:4]:
        moved = points + np.array([shift * BOARD.square_length, 0, 0])
        both = [
            CAMERA.project(pose, there) + noise * rng.normal(size=(len(points), 2))
            for there in (moved, points)
        ]
        ids, sigma = np.arange(len(points)), np.full(len(points), 0.1)
        found.append(
            tuple(Corners(ids, points, p, sigma, np.zeros(0, int), np.zeros((0, 4, 2))) for p in both)
        )
    return found


@pytest.mark.parametrize(("shift", "told"), [(0.0009, True), (0.0005, False)])
def test_a_pull_is_told_where_it_matters(shift, told):
    """Without noise; 0.0007 of a square is the least."""
    found = misplaced_markers(BOARD, pairs(shift, 0.0))
    assert found == (pytest.approx(shift, rel=0.05) if told else None)


def test_a_pull_that_noise_makes_is_not_told():
    """Of forty sets with a tenth of a pixel none; of those with a pull of ten times its error all."""
    assert [misplaced_markers(BOARD, pairs(0.0, 0.1, k)) for k in range(40)] == [None] * 40
    assert all(misplaced_markers(BOARD, pairs(0.01, 0.1, k)) is not None for k in range(10))


def test_too_few_corners_in_common_tell_nothing():
    few = [(one.keep(one.ids < 11), other) for one, other in pairs(0.01, 0.0)]
    assert misplaced_markers(BOARD, few) is None and misplaced_markers(BOARD, []) is None


@pytest.mark.parametrize(("pixels", "told"), [(0.08, False), (0.25, True)])
def test_a_camera_that_stands_still_shows_one_drawing_of_the_edges(pixels, told):
    """What pixels of four by four samples may do to whole rows, and twice that, in four photos from one place."""
    points = board_points(BOARD)
    found = []
    for k in range(4):
        noise = 0.01 * np.random.default_rng(k).normal(size=(2, len(points), 2))
        both = CAMERA.project(POSES[0], points) + noise + np.array([[[0.0, pixels]], [[0.0, 0.0]]])
        ids, sigma = np.arange(len(points)), np.full(len(points), 0.1)
        found.append(
            tuple(Corners(ids, points, p, sigma, np.zeros(0, int), np.zeros((0, 4, 2))) for p in both)
        )
    assert (misplaced_markers(BOARD, found) is not None) == told
    pose = [CAMERA.project(POSES[k], points) for k in range(4)]
    moving = [
        tuple(replace(one, pixels=one.pixels + pose[k] - pose[0]) for one in pair)
        for k, pair in enumerate(found)
    ]
    assert misplaced_markers(BOARD, moving) is not None
