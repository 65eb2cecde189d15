"""The result of a calibration, from one that has settled on the truth."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.outcome import setup_from
from photogonio.calib.setup_file import load_setup, save_setup
from photogonio.capture.photoset import Plane, Sphere
from tests.drawn.calibrations import at_rest


@pytest.fixture(scope="module")
def resting(drawn):
    return at_rest(*drawn)


@pytest.fixture(scope="module")
def setup(resting):
    return setup_from(resting)


def test_all_is_where_it_settled(setup, drawn):
    world, _ = drawn
    assert setup.camera is world.camera and setup.channels == ("Y",) and setup.scale == "absolute"
    assert isinstance(setup.sample, Sphere) and setup.sample.radius == world.sample.radius
    np.testing.assert_array_equal(setup.sample.center, world.sample.center)
    for found, true in zip(setup.mirror_balls, world.balls, strict=True):
        assert found.radius == true.radius and (found.center == true.center).all()
    for one, pose in zip(setup.boards, world.boards, strict=True):
        # both numbers of each corner count: noise times the root of two, of dozens of corners
        assert one.pose_rms == pytest.approx(np.sqrt(2) * world.corner_noise, rel=0.3)
        np.testing.assert_allclose(one.pose.center, pose.center, rtol=1e-9)
    assert [one.name for one in setup.boards] == [f"c{k}" for k in range(len(world.boards))]


def test_nothing_is_told_of_a_good_set_and_no_error_is_made_up(setup):
    # at rest nothing was looked at: no lamp in a ball either
    assert setup.left_out == ()
    assert {one.code for one in setup.diagnoses} <= {"patches-not-used", "mirror-ball-unseen"}
    assert setup.ambient is None and setup.falloff is None and setup.scale_error == 0.0
    assert setup.warnings == tuple(one.message for one in setup.diagnoses)


def test_what_was_found_can_be_saved(setup, tmp_path):
    save_setup(setup, tmp_path / "setup.json")
    again = load_setup(tmp_path / "setup.json")
    np.testing.assert_array_equal(again.views[2].strength, setup.views[2].strength)
    assert again.residuals.keys() == setup.residuals.keys() and again.diagnoses == setup.diagnoses


@pytest.mark.parametrize(("off", "believed"), [(2.9, True), (3.1, False)])
def test_a_sample_that_cannot_stand_there_is_where_the_manifest_has_it(drawn, off, believed):
    """Four times 3 % of its radius of 25 is as far as a ball is believed to stand beside its place."""
    state = at_rest(*drawn)
    told = state.photoset.sample
    block = np.append(told.center + np.array([off, 0, 0]), told.radius)
    settled = replace(state.settled, values=state.settled.values | {"sample": block})
    found = setup_from(replace(state, settled_or_none=settled))
    expected = block[:3] if believed else told.center
    np.testing.assert_array_equal(found.sample.center, expected)
    code = "sample-moved" if believed else "sample-not-believed"
    assert code in {one.code for one in found.diagnoses}


def test_a_flat_sample_without_edges_stays_where_it_is(drawn):
    state = at_rest(*drawn)
    sheet = Plane(np.array([[60.0, 50], [120, 50], [120, 90], [60, 90]]), 1.0)
    assert setup_from(replace(state, photoset=replace(state.photoset, sample=sheet))).sample is sheet
