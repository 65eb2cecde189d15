"""What a person should look at of a flat sample's place is told."""

import numpy as np
import pytest

from photogonio.calib.adjust.flat_sample import PlaneMove, lying
from photogonio.calib.diagnose.places.flat_sample import numbers, told
from tests.drawn.flat_samples import CAMERA, MOVE, PLANE, seen


@pytest.fixture(scope="module")
def move() -> PlaneMove:
    found = lying(CAMERA, seen(MOVE), PLANE, False)
    assert found is not None
    return found


def test_a_tilt_is_told(move):
    assert "flat-sample-tilted" in [one.code for one in told(move, "mm")]
    np.testing.assert_allclose(numbers(move)["tilt"], move.values[4:6])


def test_an_outline_of_the_wrong_size_is_told(move):
    said = [one.message for one in told(move, "mm") if one.code == "flat-sample-size"]
    assert len(said) == 1 and "-4." in said[0] and "+3." in said[0]
