"""Views of a set: photos by role, brackets joined; boards by their lengths."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from photogonio.capture.photoset import CharucoBoard, GridBoard, Photo, PhotoSet, Sphere
from photogonio.capture.target.layout import marker_corners

SPHERE = Sphere(np.zeros(3), 1.0)


def set_of(*photos: Photo) -> PhotoSet:
    return PhotoSet(Path("."), "a", "mm", SPHERE, "auto", photos)


def test_photos_of_a_bracket_are_one_view_where_its_first_stands():
    photos = [
        Photo("a", "sample"),
        Photo("b", "sample", "L1", bracket=2),
        Photo("c", "probe", "L2", bracket=2),
        Photo("d", "sample", bracket=1),
        Photo("e", "sample", "L1", bracket=2),
        Photo("f", "dark"),
    ]
    views = set_of(*photos).views("sample")
    assert [[photo.file for photo in view.photos] for view in views] == [["a"], ["b", "e"], ["d"]]
    assert [view.name for view in views] == ["a", "b", "d"] and [v.light for v in views] == [None, "L1", None]
    assert [v.name for v in set_of(*photos).views("probe")] == ["c"]  # another role's bracket is another


def test_every_photo_is_in_one_view_of_its_role_alone():
    rng = np.random.default_rng(1)
    roles = ("sample", "probe", "dark")
    photos = [
        Photo(f"{k}", str(rng.choice(roles)), bracket=int(rng.integers(4)) if rng.random() < 0.5 else None)
        for k in range(60)
    ]
    seen = [photo for role in roles for view in set_of(*photos).views(role) for photo in view.photos]
    assert sorted(seen, key=lambda one: int(one.file)) == photos


@pytest.mark.parametrize(
    "board",
    [CharucoBoard("DICT_4X4_50", (5, 4), 10.0, 7.0), GridBoard("DICT_4X4_50", (3, 2), 7.0, 3.5)],
)
def test_pitch_and_gap_are_those_of_the_printed_markers(board):
    """As OpenCV lays them out: neighbours in a row stand a pitch apart (two, where every other square has one)."""
    _, corners = marker_corners(board)
    middles = corners.mean(axis=1)
    row = np.sort(middles[np.isclose(middles[:, 1], middles[0, 1])][:, 0])
    apart = 2 if isinstance(board, CharucoBoard) else 1
    np.testing.assert_allclose(np.diff(row), apart * board.pitch, rtol=1e-6)
    assert board.pitch == pytest.approx(board.marker_length + board.gap)
