"""Markers that are printed beside their places, told by how they pull the corners."""

import numpy as np

from photogonio.calib.adjust.intrinsics import quick_camera
from photogonio.calib.detect.first_look import FirstLook, Photos
from photogonio.calib.detect.photo_reader import look, look_closer
from photogonio.calib.first_camera import placed
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
