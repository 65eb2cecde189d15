"""Where a lamp's fit starts: one photo's print against what was told of it."""

import numpy as np
import pytest

from photogonio.calib.response.start_place import likely_place
from tests.calib.response.phones import CURVES, photos

SOME = photos(CURVES["contrasty"], count=4, channels=1, seed=3)[
    1::2
]  # by torches, each told some per cent off


@pytest.mark.parametrize("one", SOME, ids=lambda one: one.light)
def test_a_lamp_told_astray_is_sought_again(one):
    middle = one.points.mean(axis=0) * [1, 1, 0]
    true = one.place - middle  # but for its distance
    opposite = middle + true * [-1, -1, 1]
    found = likely_place(one, opposite) - middle
    apart = np.arccos(found @ true / np.linalg.norm(found) / np.linalg.norm(true))
    assert np.degrees(apart) < 10  # a curve that bends light unlike a power turns it by some degrees
    assert np.linalg.norm(found) == pytest.approx(np.linalg.norm(true), rel=0.5)


def test_one_told_rightly_stays():
    one = photos(CURVES["srgb"], count=2, channels=1, seed=3, noise=0.5)[1]
    assert likely_place(one, one.place) is one.place
