"""The board's frame, and its corners in drawn and in real photos: above all that they are not off on one side."""

import itertools
from dataclasses import replace

import cv2
import numpy as np
import pytest

from photogonio.calib.adjust.intrinsics import fit_camera, quick_camera
from photogonio.calib.detect import photo_reader as looking
from photogonio.calib.detect.corners import corners_of_half, find_corners
from photogonio.calib.detect.first_look import FirstLook, Photos
from photogonio.calib.detect.gray import detection_image, halved
from photogonio.calib.detect.photo_reader import look, look_closer
from photogonio.calib.detect.subpixel import Around
from photogonio.calib.first_camera import placed
from photogonio.calib.geometry.board import board_points, board_size, dictionary, opencv_board
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.geometry.pose import fit_pose
from photogonio.calib.remarks import Remarks
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import CharucoBoard, GridBoard
from tests.drawn.boards import BOARD, CAMERA, SIZE, draw, looking_at, radiance, reader_of, views_of
from tests.places import DATA

CHARUCO = DATA / "charuco-photos"
NOISE = 0.004
MIDDLE = np.append(board_size(BOARD) / 2, 0.0)
OFFSETS = ((5, 3, 185), (90, 20, 160), (-75, 40, 165), (20, 95, 160), (-15, -90, 165), (60, -60, 170))
POSES = [looking_at(MIDDLE + np.array(o, float), MIDDLE, 0.3 * k - 0.7) for k, o in enumerate(OFFSETS)]


def quiet(label: str, done: int, total: int) -> None:
    pass


@pytest.fixture(scope="module")
def reader():
    images = {f"{k}.png": radiance(draw(CAMERA, p, NOISE, k), NOISE) for k, p in enumerate(POSES)}
    return reader_of(BOARD, images)


@pytest.fixture(scope="module")
def first(reader):
    return look(reader, views_of(reader), quiet, "")


@pytest.fixture(scope="module")
def closer(reader, first):
    return look_closer(reader, quick_camera([s.corners for s in first], SIZE), first, quiet)


def misses(seen) -> np.ndarray:
    """Found less true pixel of every corner of all photos, (n, 2)."""
    pairs = zip(seen, POSES, strict=True)
    return np.concatenate([s.corners.pixels - CAMERA.project(p, s.corners.points) for s, p in pairs])


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


@pytest.mark.parametrize("stage", ["first", "closer"])
def test_corners_have_no_bias_and_little_scatter(stage, request):
    miss = misses(request.getfixturevalue(stage))
    assert len(miss) > 0.9 * len(POSES) * len(board_points(BOARD))
    assert np.abs(miss.mean(0)).max() < 0.02, miss.mean(0)
    assert np.sqrt((miss**2).sum(1).mean()) < 0.2


def test_the_whole_print_places_corners_better_than_their_saddle_points(first, closer):
    assert (misses(closer) ** 2).mean() < (misses(first) ** 2).mean()


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


def test_markers_that_are_small_in_half_the_size_are_not_looked_for_there(first):
    image = detection_image(halved(draw(CAMERA, POSES[0], NOISE, 0).astype(np.float32)))
    assert corners_of_half(BOARD, image) is None


def test_a_true_print_is_used_whole(reader, first):
    remarks = Remarks()
    seen = FirstLook(reader.photoset, reader, Photos(first, [], []), remarks)
    camera = quick_camera([s.corners for s in first], SIZE)
    found = placed(seen, camera, quiet).samples
    assert remarks.codes() == []
    for one, other in zip(found, look_closer(reader, camera, first, quiet), strict=True):
        np.testing.assert_array_equal(one.corners.pixels, other.corners.pixels)


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


def test_the_pose_is_found_again_within_its_error(closer):
    for one, pose in zip(closer, POSES, strict=True):
        fit = fit_pose(CAMERA, one.corners)
        assert fit is not None and fit.pose.center[2] > 0
        np.testing.assert_allclose(fit.pose.center, pose.center, atol=0.002 * np.linalg.norm(pose.center))


def test_camera_comes_back_from_drawn_photos(closer):
    fit = fit_camera([s.corners for s in closer], SIZE)
    assert fit is not None
    assert fit.rms < 0.2
    focal = fit.camera.matrix[[0, 1], [0, 1]]
    true = CAMERA.matrix[[0, 1], [0, 1]]
    assert (np.abs(focal - true) < 4 * fit.standard_errors[:2]).all()
    assert (fit.standard_errors[:2] < 0.001 * true).all()


@pytest.mark.skipif(not CHARUCO.is_dir(), reason="the shared real photos are absent")
def test_real_photos_give_the_published_camera():
    board = CharucoBoard("DICT_6X6_250", squares=(5, 7), square_length=0.04, marker_length=0.02)
    images = {}
    for path in sorted(CHARUCO.glob("*.jpg")):
        coded = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) / 255.0
        linear = np.where(coded > 0.04045, ((coded + 0.055) / 1.055) ** 2.4, coded / 12.92)
        images[path.name] = radiance(linear, 0.01)
    reader = reader_of(board, images)
    seen = look(reader, views_of(reader), quiet, "")
    size = seen[0].size
    closer = look_closer(reader, quick_camera([s.corners for s in seen], size), seen, quiet)
    fit = fit_camera([s.corners for s in closer], size)
    published = cv2.FileStorage(str(CHARUCO / "reference.yml"), cv2.FILE_STORAGE_READ)
    focal = published.getNode("camera_matrix").mat()[[0, 1], [0, 1]]
    assert fit is not None
    assert fit.rms <= min(0.2, published.getNode("avg_reprojection_error").real())
    off = (fit.camera.matrix[[0, 1], [0, 1]] - focal) / fit.standard_errors[:2]
    assert np.abs(off).max() <= 3.0, (fit.camera.matrix, fit.standard_errors)
    assert (fit.standard_errors[:2] < 0.1 * focal).all()  # four photos alike tell it to about 4 %


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
