"""Photos that do not show the sample are left out by name; a set of them is refused."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.adjust.state import State
from photogonio.calib.detect.observation import Observation
from photogonio.calib.diagnose.photos.outside_picture import SampleOutsidePicture, sample_in_picture
from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.geometry.camera import Pose
from photogonio.calib.remarks import Remarks
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import Photo, Plane, Sphere, View
from tests.drawn.boards import quiet
from tests.drawn.rooms import camera, overhead
from tests.drawn.setups import photoset_of

CAMERA, ABOVE = camera(160, 120, 400.0), overhead(400.0)  # a pixel a length in the plane z = 0


@pytest.mark.parametrize(("beyond", "shown"), [(-0.1, True), (0.1, False)])
def test_a_ball_is_shown_as_long_as_any_of_its_ends_is(beyond, shown):
    """Its end toward the picture is 10 lengths from its middle, all at one height; the picture ends at 79.5 + 0.5."""
    for side in (
        np.array([1.0, 0, 0]),
        np.array([-1.0, 0, 0]),
        np.array([0, 0.75, 0]),
        np.array([0, -0.75, 0]),
    ):
        ball = Sphere(80.0 * side + (10 + beyond) * side / np.linalg.norm(side), 10.0)
        assert sample_in_picture(CAMERA, ABOVE, ball) == shown


@pytest.mark.parametrize(("beyond", "shown"), [(-0.1, True), (0.1, False)])
def test_a_sheet_is_shown_as_long_as_a_corner_is(beyond, shown):
    sheet = np.array([[0.0, -5], [30, -5], [30, 5], [0, 5]]) + np.array([80 + beyond, 0])
    assert sample_in_picture(CAMERA, ABOVE, Plane(sheet)) == shown
    wide = np.array([[-900.0, -900], [900, -900], [900, 900], [-900, 900]])
    assert sample_in_picture(CAMERA, ABOVE, Plane(wide))  # whose corners are all outside


def test_what_is_behind_the_camera_is_not_shown():
    away = Pose(np.eye(3), np.array([0.0, 0, -50]))
    assert not sample_in_picture(CAMERA, away, Sphere(np.array([0.0, 0, 10]), 10.0))
    assert not sample_in_picture(CAMERA, away, Plane(np.array([[0.0, 0], [5, 0], [0, 5]])))


def state_of(drawn, off: tuple[int, ...], probes: tuple[int, ...] = ()) -> State:
    """Four photos, of which some show another part of the table."""
    world, _ = drawn
    observations = []
    for k, pose in enumerate(world.views):
        view = View((Photo(f"s{k}", "probe" if k in probes else "sample"),))
        aside = Pose(pose.rotation, pose.translation + np.array([5000.0, 0, 0])) if k in off else pose
        observations.append(Observation(view, "one", None, aside, f"pose {k}"))
    photoset = photoset_of(world, fixed=False)
    return State(photoset, None, world.camera, None, (), tuple(observations), Remarks(), quiet)


@pytest.mark.parametrize("off", [(), (2,), (0, 3)])
def test_they_are_left_out_by_name(drawn, off):
    state = state_of(drawn, off)
    after = ask(state, [SampleOutsidePicture()])
    assert [one.view.name for one in after.observations] == [f"s{k}" for k in range(4) if k not in off]
    assert [one.name for one in state.remarks.left_out] == [f"s{k}" for k in off]
    assert set(state.remarks.codes()) == ({"sample-outside-picture"} if off else set())


def test_probes_need_not_show_it_and_are_no_use_alone(drawn):
    assert len(ask(state_of(drawn, (1,), probes=(1,)), [SampleOutsidePicture()]).observations) == 4
    with pytest.raises(InputError, match=r"no sample photo can be used: s0: the sample lies outside"):
        ask(state_of(drawn, (0, 2, 3), probes=(1,)), [SampleOutsidePicture()])


@pytest.mark.parametrize(("factor", "hint"), [(1.0, False), (1000.0, True)])
def test_a_sample_told_in_another_unit_is_guessed(drawn, factor, hint):
    state = state_of(drawn, (0, 1, 2, 3))
    sample = replace(state.photoset.sample, center=factor * state.photoset.sample.center)
    state = replace(state, photoset=replace(state.photoset, sample=sample))
    with pytest.raises(InputError) as caught:
        ask(state, [SampleOutsidePicture()])
    assert ("all lengths must be in one unit" in str(caught.value)) == hint
    assert "photoset.toml" in str(caught.value)
