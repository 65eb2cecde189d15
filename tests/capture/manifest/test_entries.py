"""The manifest's tables: shapes, rotations and boards that can be, and the others."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from photogonio.capture.errors import InputError
from photogonio.capture.manifest import entries
from photogonio.capture.photoset import CharucoBoard, GridBoard, LightEntry

RNG = np.random.default_rng(0)


@pytest.mark.parametrize("corners", [3, 4, 7])
def test_an_outline_may_begin_anywhere_and_go_either_way_round(corners):
    turn = np.sort(RNG.uniform(0, 2 * np.pi, corners)) if corners > 3 else np.array([0.1, 2.0, 4.0])
    polygon = np.column_stack([30 + 9 * np.cos(turn), 5 * np.sin(turn)])
    for start in range(corners):
        for step in (1, -1):
            given = np.roll(polygon, start, axis=0)[::step]
            assert np.array_equal(entries.outline(given.tolist(), "outline"), given)


def test_what_is_no_convex_polygon_is_refused():
    around = [[0, 0], [2, 0], [2, 1], [0, 1]]
    inward = [[0, 0], [2, 0], [0.5, 0.4], [0, 2]]
    for wrong in (around[:2], around + around, [around[k] for k in (0, 2, 1, 3)], inward, [[0, 0]] * 3):
        with pytest.raises(InputError, match="outline: expected the corners of a convex polygon"):
            entries.outline(wrong, "outline")


def test_a_rotation_rounded_in_a_file_is_made_exact():
    """Four digits leave half of 1e-4 in each entry, a quarter of a milliradian in all of them at the most."""
    for rotation in Rotation.random(20, random_state=1).as_matrix():
        found = entries.rotation(np.round(rotation, 4).tolist(), "rotation")
        np.testing.assert_allclose(found @ found.T, np.eye(3), atol=1e-14)
        assert np.linalg.det(found) > 0 and np.linalg.norm(found - rotation) < 2 * 3 * 0.5e-4
        with pytest.raises(InputError, match="right-handed"):
            entries.rotation((rotation * [1, 1, -1]).tolist(), "rotation")
        with pytest.raises(InputError, match="rotation"):
            entries.rotation((1.001 * rotation).tolist(), "rotation")


@pytest.mark.parametrize("count", range(16))
def test_lenses_have_as_many_numbers_as_opencvs_models(count):
    numbers = [0.01] * count
    if count in (0, 4, 5, 8, 12, 14):
        assert len(entries.distortion(numbers, "distortion")) == count
        points = np.array([[[0.1, 0.2, 1.0]]])  # OpenCV takes what is let through
        cv2.projectPoints(points, np.zeros(3), np.zeros(3), np.eye(3), np.array(numbers) if count else None)
    else:
        with pytest.raises(InputError, match=rf"found {count}$"):
            entries.distortion(numbers, "distortion")


def board(kind: str, **given):
    return entries.build_board(
        {"kind": kind, "dictionary": "DICT_4X4_50", "marker_length": 7.0, **given}, "[board]"
    )


@pytest.mark.parametrize(
    ("kind", "given", "markers"),
    [
        ("charuco", {"squares": (5, 4), "square_length": 10.0}, 10),
        ("charuco", {"squares": (5, 5), "square_length": 10.0}, 12),
        ("aruco-grid", {"markers": (4, 3), "marker_separation": 2.0}, 12),
    ],
)
def test_a_board_may_take_a_dictionarys_last_marker_and_none_beyond(kind, given, markers):
    last = board(kind, **given, first_id=50 - markers)
    assert isinstance(last, CharucoBoard | GridBoard) and last.first_id == 50 - markers
    with pytest.raises(InputError, match=r"needs marker 50, but DICT_4X4_50 ends at 49"):
        board(kind, **given, first_id=51 - markers)


def test_keys_of_another_kind_and_missing_ones_are_named():
    with pytest.raises(
        InputError, match=r"\[board\]: the key 'markers' is required with kind = \"aruco-grid\""
    ):
        board("aruco-grid", marker_separation=2.0)
    with pytest.raises(InputError, match=r'\[board\] squares: does not apply with kind = "aruco-grid"'):
        board("aruco-grid", markers=(3, 3), marker_separation=2.0, squares=(3, 3))
    corners = np.array([[0, 7, 0], [7, 7, 0], [7, 0, 0], [0, 0, 0.0]])
    with pytest.raises(InputError, match="used twice"):
        entries.build_board(
            {"kind": "markers", "dictionary": "DICT_4X4_50", "marker": ((3, corners), (3, corners))},
            "[board]",
        )


def test_directions_of_lights_have_length_one():
    for direction in RNG.normal(size=(10, 3)):
        found = entries.build_light({"id": "a", "direction": direction}, "light[0]")
        assert isinstance(found, LightEntry)
        assert np.linalg.norm(found.direction) == pytest.approx(1.0, abs=1e-15)
        assert found.direction @ direction == pytest.approx(np.linalg.norm(direction), rel=1e-14)
    with pytest.raises(InputError, match=r"light\[0\]: give position"):
        both = {"id": "a", "direction": np.ones(3), "position": np.ones(3)}
        entries.build_light(both, "light[0]")


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"encoding": "gamma"}, "go together"),
        ({"gamma": 2.2}, "go together"),
        ({"read_noise_electrons": 5.0}, "needs gain_electrons"),
        ({"black_level": 0.1, "white_level": 0.1}, "white_level 0.1 is not above black_level 0.1"),
    ],
)
def test_radiometry_that_contradicts_itself_is_refused(values, said):
    with pytest.raises(InputError, match=rf"\[radiometry\]: .*{said}"):
        entries.build_radiometry(values, "[radiometry]")


@pytest.mark.parametrize(
    "corners",
    [
        np.zeros((4, 3)),
        np.ones((4, 3)),
        [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]],
        [[0, 0, 0], [9, 0, 0], [9, 1, 0], [0, 1, 0]],
    ],
)
def test_corners_of_a_marker_that_span_no_square_are_refused(corners):
    with pytest.raises(InputError, match="marker 3 span no square"):
        entries.build_board(
            {"kind": "markers", "dictionary": "DICT_4X4_50", "marker": ((3, np.array(corners, float)),)},
            "[board]",
        )
