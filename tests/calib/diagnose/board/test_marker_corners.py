"""Loose markers whose corners the manifest lists in another order than OpenCV's drawing has."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.detect.first_look import FirstLook, Photos
from photogonio.calib.detect.photo_reader import Reader, Seen
from photogonio.calib.diagnose.board.marker_corners import ORDERS, listed_order, order_warning, reordered
from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.diagnose.registry import Stage, looked_at
from photogonio.calib.geometry.board import Corners, board_points
from photogonio.calib.geometry.pose import fit_pose
from photogonio.calib.remarks import Remarks
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import LooseMarkers, PhotoSet
from tests.drawn.boards import CAMERA, SIZE, looking_at, reader_of, views_of

SIDE = 12.0
NOISE = 0.1  # pixels
FRAME = [(x, y) for x in range(5) for y in range(4) if x in (0, 4) or y in (0, 3)]
HALF_TURN = np.array([2, 3, 0, 1])


def board_at(middles: list[tuple[int, int]]) -> LooseMarkers:
    quad = SIDE / 2 * np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0.0]])
    corners = tuple(
        (k, quad + np.array([22.0 * x + 8, 22.0 * y + 8, 0.0])) for k, (x, y) in enumerate(middles)
    )
    return LooseMarkers("DICT_APRILTAG_36h11", marker_corners=corners)


def seen(true: LooseMarkers, listed: LooseMarkers, count: int = 4) -> list[Corners]:
    """Corners as the detector gives them: pixels of the print as it is, places as they are listed."""
    rng = np.random.default_rng(4)
    points, places = board_points(true), board_points(listed)
    ids = np.array([k for k, _ in true.marker_corners])
    views = []
    for k in range(count):
        turn = 2 * np.pi * k / count
        eye = np.append(points.mean(0)[:2] + 70 * np.array([np.cos(turn), np.sin(turn)]), 190.0)
        pixels = CAMERA.project(looking_at(eye, points.mean(0), 0.4 * k), points)
        pixels = pixels + NOISE * rng.normal(size=pixels.shape)
        numbers = np.arange(len(points))
        views.append(
            Corners(numbers, places, pixels, np.full(len(points), 0.1), ids, pixels.reshape(-1, 4, 2))
        )
    return views


def inverse(order: np.ndarray) -> np.ndarray:
    return np.argsort(order)


@pytest.mark.parametrize("order", ORDERS.tolist())
def test_any_order_that_all_are_listed_in_is_found(order):
    true = board_at(FRAME)
    every = {k: np.array(order) for k, _ in true.marker_corners}
    listed = reordered(true, every)
    found = listed_order(listed, seen(true, listed))
    if order == [0, 1, 2, 3]:
        assert found == {}
    else:
        assert set(found) == set(every)
        np.testing.assert_array_equal(board_points(reordered(listed, found)), board_points(true))


def test_single_markers_in_another_order_are_found_by_number():
    true = board_at(FRAME)
    wrong = {2: HALF_TURN, 7: np.array([0, 3, 2, 1])}
    listed = reordered(true, wrong)
    found = listed_order(listed, seen(true, listed))
    assert sorted(found) == [2, 7]
    np.testing.assert_array_equal(board_points(reordered(listed, found)), board_points(true))
    assert "markers 2, 7" in order_warning(listed, found)


@pytest.mark.parametrize(
    "middles", [[(0, 0), (3, 0)], [(0, 0), (2, 0), (4, 0), (6, 0)], [(0, 0), (3, 1), (1, 3)]]
)
def test_few_markers_and_markers_in_a_row_tell_it_too(middles):
    true = board_at(middles)
    listed = reordered(true, {k: HALF_TURN for k, _ in true.marker_corners})
    found = listed_order(listed, seen(true, listed))
    np.testing.assert_array_equal(board_points(reordered(listed, found)), board_points(true))
    assert listed_order(true, seen(true, true)) == {}


def photos_of(board: LooseMarkers, views: list[Corners]) -> tuple[Reader, Photos]:
    reader = reader_of(board, {f"{k}.png": None for k in range(len(views))})
    return reader, Photos([], [], [Seen(v, c, SIZE) for v, c in zip(views_of(reader), views, strict=True)])


def as_printed(
    photoset: PhotoSet, reader: Reader, photos: Photos, remarks: Remarks
) -> tuple[PhotoSet, Photos]:
    """The set, and the corners of its photos, once its board has been looked at."""
    look = ask(FirstLook(photoset, reader, photos, remarks), looked_at(Stage.LOOK))
    return look.photoset, look.photos


def test_a_board_in_page_order_is_put_right_and_told():
    """As the frame of AprilTags that their makers publish: half a turn from OpenCV's drawing."""
    true = board_at(FRAME)
    listed = reordered(true, {k: HALF_TURN for k, _ in true.marker_corners})
    reader, photos = photos_of(listed, seen(true, listed))
    remarks = Remarks()
    photoset, photos = as_printed(reader.photoset, reader, photos, remarks)
    assert reader.photoset is photoset
    np.testing.assert_array_equal(board_points(photoset.board), board_points(true))
    for one in photos.boards:
        assert fit_pose(CAMERA, one.corners).rms < 4 * NOISE
    assert "half a turn" in remarks.warnings[0] and "board.marker" in remarks.warnings[0]
    again = Remarks()
    as_printed(photoset, reader, photos, again)
    assert not again.warnings


def test_places_with_y_down_the_page_are_refused_by_name():
    true = board_at(FRAME)
    flipped = tuple((k, c * [1, -1, 1] + [0, 100, 0]) for k, c in true.marker_corners)
    listed = replace(true, marker_corners=flipped)
    reader, photos = photos_of(listed, seen(true, listed))
    with pytest.raises(InputError, match=r"board.marker: .*mirror image"):
        as_printed(reader.photoset, reader, photos, Remarks())
