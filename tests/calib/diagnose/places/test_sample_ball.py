"""A sample ball beside the manifest's centre is found where it stands, and not believed where nobody can mistake it."""

from dataclasses import replace

import numpy as np

from photogonio.calib.diagnose.places.sample_ball import SampleBall
from tests.drawn.calibrations import Drawn
from tests.drawn.setups import SAMPLE


def test_a_sample_ball_that_stands_elsewhere():
    drawn = Drawn(10)
    away = replace(drawn.world.sample, center=SAMPLE.center + np.array([1.2, 0, 0]))
    drawn.world = replace(drawn.world, sample=away)
    state = drawn.settled()
    found = state.settled
    assert drawn.told("sample-moved")
    np.testing.assert_allclose(found.values["sample"][:2], away.center[:2], atol=0.15)
    departure = SampleBall()
    moved = departure.remedy(state, departure.evidence(state)).photoset.sample
    np.testing.assert_array_equal(moved.center, found.values["sample"][:3])
    assert moved.radius == found.values["sample"][3]


def test_a_sample_ball_that_cannot_stand_there():
    drawn = Drawn(10)
    drawn.world = replace(
        drawn.world, sample=replace(drawn.world.sample, center=SAMPLE.center + np.array([5.0, 0, 0]))
    )
    state, departure = drawn.settled(), SampleBall()
    assert departure.remedy(state, departure.evidence(state)).photoset is state.photoset
    assert drawn.told("sample-not-believed")
