"""Where a flat sample lies by its edges in drawn photos, how it is tilted, and how sure that is."""

import numpy as np
import pytest

from photogonio.calib.adjust.flat_sample import PlaneMove, flat_move, lying, place_plane
from photogonio.calib.detect.edges import plane_edges
from photogonio.calib.detect.gray import GrayPart
from photogonio.calib.diagnose.places.flat_sample import told
from tests.drawn.flat_samples import CAMERA, MOVE, PLANE, POSES, SIZE, seen
from tests.drawn.patches import SET


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


def test_a_true_manifest_is_left_alone():
    found = lying(CAMERA, seen(np.zeros(8)), PLANE, False)
    assert found is not None
    plane = found.applied(PLANE)
    np.testing.assert_array_equal(plane.outline, PLANE.outline)
    assert plane.height == PLANE.height
    assert told(found, "mm") == []


def test_one_photo_does_not_tell_height_from_place():
    found = lying(CAMERA, seen(MOVE, POSES[:1]), PLANE, True)
    assert found is not None
    assert found.errors[3] > 0.25  # mm: as much as the manifest leaves open, half of it
    assert found.applied(PLANE).height == PLANE.height


def test_what_cannot_be_is_not_believed():
    wild = PlaneMove(np.array([9.0, 0, 0, 0, 0, 0, 0, 0]), np.full(8, 0.01), 35.0)
    assert [one.code for one in told(wild, "mm")] == ["flat-sample-not-believed"]
    assert wild.applied(PLANE) is PLANE


def test_no_edges_no_move():
    assert place_plane(CAMERA, [], [], PLANE) is None
    usable, dark = np.ones(SIZE[::-1], bool), np.full(SIZE[::-1], 0.1, np.float32)
    assert plane_edges(GrayPart(dark, usable), CAMERA, POSES[0], PLANE, 8.0) is None
    assert flat_move(SET, CAMERA, []) is None
