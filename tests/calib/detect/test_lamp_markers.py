"""A lamp's place by markers that are fixed to it, drawn by projecting their corners."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from photogonio.calib.detect.lamp_markers import marked_place
from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.camera import Pose
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import LightEntry
from tests.drawn.mirror_balls import CAMERA, POSE

LAMP, SIDE = np.array([30.0, 40.0, 60.0]), 24.0
HALF = SIDE / 2 * np.array([[-1.0, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])
TURN = Pose(
    Rotation.from_euler("xyz", [0.4, -0.3, 0.8]).as_matrix(), LAMP
)  # from the lamp's frame to the world
BESIDE = np.array(
    [[-20.0, 5, 0], [20, 5, 0]]
)  # two markers' middles in that frame, on both sides of the lamp


def seen(quads: dict[int, np.ndarray], noise: float = 0.0, seed: int = 0) -> Corners:
    """Markers whose corners (4, 3) are given in the lamp's frame."""
    rng, empty = np.random.default_rng(seed), np.zeros(0)
    pixels = np.array([CAMERA.project(POSE, TURN.apply(quad)) for quad in quads.values()])
    pixels = pixels + noise * rng.normal(size=pixels.shape)
    return Corners(
        empty.astype(int), np.zeros((0, 3)), np.zeros((0, 2)), empty, np.array(list(quads)), pixels
    )


def entry(*ids: int, **markers: object) -> LightEntry:
    return LightEntry("lamp", marker_ids=ids, markers=markers)


FRAME = {7: HALF + BESIDE[0], 9: HALF + BESIDE[1]}


@pytest.mark.parametrize("ids", [(7, 9), (7,), (9,)])
def test_with_corners_in_the_lamps_frame_any_one_marker_tells(ids):
    corners = seen({k: FRAME[k] for k in ids})
    lamp = entry(7, 9, corners=[FRAME[7].tolist(), FRAME[9].tolist()])
    found = marked_place(CAMERA, POSE, corners, lamp, None)
    # OpenCV undistorts to about 1e-3 pixels
    np.testing.assert_allclose(found.place, LAMP, atol=0.05)


@pytest.mark.parametrize("length", [SIDE, None])
def test_without_them_the_lamp_is_amid_all_its_markers(length):
    """The side is the entry's, or the board's markers'."""
    around = {7: HALF - np.array([20.0, 0, 0]), 9: HALF + np.array([20.0, 0, 0])}
    lamp = entry(7, 9, **({} if length is None else {"length": length}))
    found = marked_place(CAMERA, POSE, seen(around), lamp, SIDE)
    np.testing.assert_allclose(found.place, LAMP, atol=0.05)
    assert marked_place(CAMERA, POSE, seen({7: around[7]}), lamp, SIDE) is None  # one of two tells no middle


def test_other_markers_do_not_matter_and_none_tell_nothing():
    lamp = entry(7, corners=[FRAME[7].tolist()])
    alone = marked_place(CAMERA, POSE, seen({7: FRAME[7]}), lamp, None)
    both = marked_place(CAMERA, POSE, seen({3: FRAME[9], 7: FRAME[7]}), lamp, None)
    np.testing.assert_array_equal(alone.place, both.place)
    assert marked_place(CAMERA, POSE, seen({3: FRAME[9]}), lamp, None) is None
    assert marked_place(CAMERA, POSE, None, lamp, None) is None


def test_the_stated_error_bounds_that_of_many_trials():
    """Of the worst direction, for corners good to 0.2 pixels: no more than 20 % short of it, and not twice it."""
    lamp = entry(7, 9, corners=[FRAME[7].tolist(), FRAME[9].tolist()])
    found = [marked_place(CAMERA, POSE, seen(FRAME, 0.2, k), lamp, None) for k in range(150)]
    spread = np.cov(np.array([one.place for one in found]).T)
    worst = np.sqrt(np.linalg.eigvalsh(spread)[-1])
    stated = np.median([one.sigma for one in found])
    assert 0.8 * worst < stated < 2 * worst


@pytest.mark.parametrize(
    ("markers", "said"),
    [
        (
            {"corners": [[[0, 0, 0]] * 4]},
            "markers.corners: expected four corners of three numbers for each id",
        ),
        ({"length": "long"}, "markers: expected length"),
        ({"length": -1.0}, "markers: expected length"),
        ({}, "markers: expected length"),
    ],
)
def test_markers_that_are_not_described_are_refused_by_the_lamps_name(markers, said):
    with pytest.raises(InputError, match=rf'photoset\.toml: light "lamp" {said}'):
        marked_place(CAMERA, POSE, seen(FRAME), entry(7, 9, **markers), None)
