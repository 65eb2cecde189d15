"""Every view's lamp and its strength, from a calibration that has settled on the truth."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.adjust.lamps import Lamp
from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.diagnose.registry import Stage, asked_at
from photogonio.calib.views import light_of, views_of
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import LightEntry
from tests.drawn.calibrations import at_rest


@pytest.fixture(scope="module")
def resting(drawn):
    return at_rest(*drawn)


def test_strengths_are_those_of_the_lamps(resting, drawn):
    """Patch and paper are uneven by 0.2 % from view to view, and what balls throw on both is told to some per cent."""
    views, scale = views_of(resting)
    world, _ = drawn
    assert scale == "absolute" and [view.name for view in views] == [f"s{k}" for k in range(4)]
    for view, true in zip(views, world.strengths, strict=True):
        assert view.strength == pytest.approx(true, rel=0.01)
        assert 0 < view.strength_error[0] < 0.02 * true
        assert view.strength_source in ("white patch", "board")


def test_each_view_has_its_own_lamp_and_place(resting, drawn):
    world, _ = drawn
    for k, view in enumerate(views_of(resting)[0]):
        np.testing.assert_array_equal(view.light.place, world.lamps[k])
        np.testing.assert_array_equal(view.pose.center, world.views[k].center)
        assert view.light.radius == world.lamp_radius and view.light.kind == "point"
        assert len(view.marks.corners) == len(resting.observations[k].corners)
        assert np.abs(view.marks.corner_misses).max() < 6 * world.corner_noise


def test_photos_whose_lamp_was_not_found_are_left_out_by_name(drawn):
    state = at_rest(*drawn)
    del state.settled.lamps["s2"]
    views, _ = views_of(ask(state, asked_at(Stage.LAMP)))
    assert [view.name for view in views] == ["s0", "s1", "s3"]
    assert [one.name for one in state.remarks.left_out] == ["s2"]
    assert "seen in no mirror ball and on no paper" in state.remarks.left_out[0].reason


def test_a_photo_that_cannot_be_read_any_more_is_left_out_and_a_set_of_them_refused(drawn):
    def broken(names):
        state = at_rest(*drawn)
        read = state.reader._read

        def fails(photoset, view):
            if view.name in names:
                raise InputError(view.name, "is gone")
            return read(photoset, view)

        state.reader._read = fails
        return state

    one = broken({"s1"})
    assert [view.name for view in views_of(one)[0]] == ["s0", "s2", "s3"]
    assert one.remarks.codes() == ["unreadable-photo"]
    with pytest.raises(InputError, match=r"photoset\.toml: no sample photo can be used: s0: s0: is gone"):
        views_of(broken({"s0", "s1", "s2", "s3"}))


def of(lamp: Lamp, block, covariance, observation, **more):
    values, known = {f"light {lamp.name}": block}, {f"light {lamp.name}": covariance}
    settled = SimpleNamespace(lamps={lamp.name: lamp}, values=values, covariance=known, misses={}, scene=None)
    return light_of(SimpleNamespace(**(vars(settled) | more)), observation)


def test_a_flash_stands_where_the_camera_stood(resting):
    """Its place and its errors turn with the camera: sampled places scatter as is said."""
    one = replace(resting.observations[0], light="flash")
    spread, place = np.diag([1.0, 4.0, 9.0]), np.array([30.0, -40.0, 5.0])
    lamp = Lamp("flash", LightEntry("flash", attached_to="camera", radius=3.0), "point", place, "board")
    found = of(lamp, place, spread, one)
    np.testing.assert_allclose(one.pose.apply(found.place), place, atol=1e-9)
    assert found.radius == 3.0
    drawn = place + np.random.default_rng(0).normal(size=(20_000, 3)) * [1.0, 2.0, 3.0]
    sampled = np.cov(one.pose.inverse().apply(drawn).T)
    np.testing.assert_allclose(found.covariance, sampled, atol=5 * 9 * np.sqrt(2 / 20_000))


def test_a_directions_length_tells_nothing(resting):
    one = replace(resting.observations[0], light="sun")
    block, root = np.array([0.6, -1.2, 2.0]), np.random.default_rng(1).normal(size=(3, 3))
    found = of(Lamp("sun", None, "directional", block, "probe"), block, root @ root.T, one)
    assert np.linalg.norm(found.place) == pytest.approx(1.0)
    np.testing.assert_allclose(np.cross(found.place, block), 0.0, atol=1e-12)
    np.testing.assert_allclose(found.covariance @ found.place, 0.0, atol=1e-12)
    assert found.radius == 0.0 and np.isnan(found.residual)


def test_the_residual_is_the_rms_of_the_highlights_misses(resting):
    one = replace(resting.observations[0], light="a")
    lamp = Lamp("a", None, "point", np.ones(3), "mirror balls")
    found = of(lamp, np.ones(3), np.eye(3), one, misses={"a": np.array([[3.0, 0], [0, 4.0]])})
    assert found.residual == pytest.approx(np.sqrt(25 / 4))
