"""A flat sample found by its edges in drawn photos: where it lies, how it is tilted, and how sure that is."""

import cv2
import numpy as np
import pytest

from photogonio.calib.adjust.flat_sample import PlaneMove, lying, moved_points, place_plane
from photogonio.calib.detect.edges import plane_edges
from photogonio.calib.detect.gray import GrayPart
from photogonio.calib.geometry.camera import Camera
from photogonio.calib.geometry.print_map import draw_print
from photogonio.calib.remarks import Remarks
from photogonio.calib.report.summary import account_plane
from photogonio.capture.photoset import PhotoSet, Plane
from tests.calib.radiometry.test_scale import SET
from tests.drawn.boards import BOARD, looking_at

SIZE = (480, 360)
CAMERA = Camera(
    np.array([[700.0, 0, 240.0], [0, 700.0, 181.0], [0, 0, 1]]), np.array([-0.1, 0.05, 0, 0, 0.0]), SIZE
)
PLANE = Plane(np.array([[-35.0, -28], [35, -28], [35, 28], [-35, 28]]), 2.0)
EYES = ((10, -20, 230), (120, 30, 180), (-110, 60, 190), (20, 130, 170), (-30, -140, 160), (90, -90, 190))
POSES = [looking_at(np.array(e, float), np.array([0.0, 0, 2]), 0.2 * k) for k, e in enumerate(EYES)]
FINE = 8
MOVE = np.array([0.4, -0.3, 0.006, 0.5, 0.012, -0.008, -0.04, 0.03])


def photo(pose, values: np.ndarray, noise: float, seed: int) -> np.ndarray:
    """A pale sheet, moved by ``values``, on dark ground, each pixel its covered share."""
    turn = np.linspace(0, 1, 60, endpoint=False)[:, None]
    flat = np.concatenate(
        [a + turn * (b - a) for a, b in zip(PLANE.outline, np.roll(PLANE.outline, -1, axis=0), strict=True)]
    )
    rim = moved_points(np.column_stack([flat, np.full(len(flat), PLANE.height)]), PLANE, values)
    pixels = (CAMERA.project(pose, rim) + 0.5) * FINE - 0.5
    mask = np.zeros((SIZE[1] * FINE, SIZE[0] * FINE), np.uint8)
    cv2.fillPoly(mask, [np.round(pixels * 16).astype(np.int32).reshape(-1, 1, 2)], 255, shift=4)
    level = cv2.resize(mask, SIZE, interpolation=cv2.INTER_AREA).astype(np.float32) / 255 * 0.5 + 0.1
    blurred = cv2.GaussianBlur(level, (0, 0), 0.5)
    return blurred + noise * np.random.default_rng(seed).normal(size=blurred.shape).astype(np.float32)


def seen(values: np.ndarray, poses=POSES):
    usable = np.ones(SIZE[::-1], bool)
    found = [
        (p, plane_edges(GrayPart(photo(p, values, 0.004, k), usable), CAMERA, p, PLANE, 8.0))
        for k, p in enumerate(poses)
    ]
    assert all(e is not None for _, e in found)
    return found


@pytest.fixture(scope="module")
def move() -> PlaneMove:
    found = lying(CAMERA, seen(MOVE), PLANE, False)
    assert found is not None
    return found


def test_place_and_tilt_come_back(move):
    np.testing.assert_allclose(move.values[[0, 1, 3]], MOVE[[0, 1, 3]], atol=0.05)  # mm
    np.testing.assert_allclose(move.values[[2, 4, 5]], MOVE[[2, 4, 5]], atol=0.002)  # radians
    np.testing.assert_allclose(move.values[6:], MOVE[6:], atol=0.003)  # 0.1 mm at the edges
    assert (np.abs(move.values - MOVE) < 4 * move.errors).all()


def test_what_is_sure_is_applied_but_the_tilt(move):
    plane = move.applied(PLANE)
    assert plane.height == pytest.approx(PLANE.height + 0.5, abs=0.1)
    np.testing.assert_allclose(plane.outline.mean(0), [0.4, -0.3], atol=0.05)
    # turned by 0.006, which makes its box 0.4 mm larger
    np.testing.assert_allclose(np.ptp(plane.outline, axis=0), [70 * 0.96 + 0.34, 56 * 1.03 + 0.42], atol=0.25)


def test_a_tilt_is_told(move):
    remarks = Remarks()
    account_plane(SET, move, remarks)
    assert "flat-sample-tilted" in remarks.codes()
    np.testing.assert_allclose(remarks.residuals["sample"]["tilt"], move.values[4:6])


def test_an_outline_of_the_wrong_size_is_told(move):
    remarks = Remarks()
    account_plane(SET, move, remarks)
    assert "flat-sample-size" in remarks.codes() and any("-4." in w and "+3." in w for w in remarks.warnings)


def test_a_true_manifest_is_left_alone():
    found = lying(CAMERA, seen(np.zeros(8)), PLANE, False)
    assert found is not None
    plane, remarks = found.applied(PLANE), Remarks()
    np.testing.assert_array_equal(plane.outline, PLANE.outline)
    assert plane.height == PLANE.height
    account_plane(SET, found, remarks)
    assert remarks.codes() == []


def test_one_photo_does_not_tell_height_from_place():
    found = lying(CAMERA, seen(MOVE, POSES[:1]), PLANE, True)
    assert found is not None
    assert found.errors[3] > 0.25  # mm: as much as the manifest leaves open, half of it
    assert found.applied(PLANE).height == PLANE.height


def test_what_cannot_be_is_not_believed():
    wild = PlaneMove(np.array([9.0, 0, 0, 0, 0, 0, 0, 0]), np.full(8, 0.01), 35.0)
    remarks = Remarks()
    account_plane(SET, wild, remarks)
    assert "flat-sample-not-believed" in remarks.codes()
    assert wild.applied(PLANE) is PLANE


def test_no_edges_no_move():
    assert place_plane(CAMERA, [], [], PLANE) is None
    usable, dark = np.ones(SIZE[::-1], bool), np.full(SIZE[::-1], 0.1, np.float32)
    assert plane_edges(GrayPart(dark, usable), CAMERA, POSES[0], PLANE, 8.0) is None
    remarks = Remarks()
    account_plane(SET, None, remarks)
    assert remarks.residuals == {}
    assert isinstance(SET, PhotoSet)


def test_edges_of_the_print_are_not_taken_for_the_samples():
    """Points are kept only where the ground behind is one tone as far as an edge is looked for."""
    print_, usable, pose = draw_print(BOARD), np.ones(SIZE[::-1], bool), POSES[0]
    level = photo(pose, np.zeros(8), 0.004, 0)
    free = plane_edges(GrayPart(level, usable), CAMERA, pose, PLANE, 3.0)
    held = plane_edges(GrayPart(level, usable), CAMERA, pose, PLANE, 3.0, print_)
    assert free is not None and held is not None
    over = print_.on_print(free.places[:, :2])
    assert over.any() and len(held) < len(free)
    inner = held.places[
        (held.places[:, :2] > 3.0).all(1), :2
    ]  # not where a slanted ray passes the print's border
    _, apart = print_.at(inner)
    # seen from above, 2 mm over the board: about three pixels a millimetre
    assert (apart * 3.2 > 4.0).all()
