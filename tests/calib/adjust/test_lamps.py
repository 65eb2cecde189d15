"""First guesses of lamps, and those of which little is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.adjust.alternate import settle
from photogonio.calib.adjust.lamps import (
    Lamp,
    as_distant,
    expected_pixel,
    middle_of,
    place_in_world,
    sight_rays,
    start_lamp,
    start_lamps,
)
from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.diagnose.registry import Stage, asked_at
from photogonio.capture.photoset import LightEntry, PhotoSet, Plane, Sphere
from tests.drawn.boards import quiet
from tests.drawn.calibrations import Drawn
from tests.drawn.mirror_balls import BALLS, CAMERA, LAMP, POSE, highlight, unit
from tests.drawn.setups import BOARD, MIDDLE


def test_a_lamp_seen_in_one_ball_only():
    drawn = Drawn(12)
    state = drawn.watched()
    state.observations[2].highlights = state.observations[2].highlights[:1]
    state = settle(state)
    ask(state, asked_at(Stage.PLACES))
    found = state.settled
    assert drawn.said("seen in one mirror ball only, so put as far away as the other lights: s2")
    # its distance is as unknown as is said
    covariance = found.covariance["light s2"]
    off = found.values["light s2"] - drawn.world.lamps[2]
    assert off @ np.linalg.solve(covariance, off) < 16
    assert np.sqrt(np.linalg.eigvalsh(covariance)[-1]) > 50


SET = PhotoSet(Path("."), "a", "mm", Sphere(np.array([0.0, 0, 9]), 9.0), "auto", (), mirror_balls=BALLS)


def seen(*balls: int, lamp: np.ndarray = LAMP, name: str = "one") -> SimpleNamespace:
    """A photo in which some of the balls show the lamp, and no paper."""
    view = SimpleNamespace(light=name, name=name)
    spots = [highlight(k, lamp) for k in balls]
    return SimpleNamespace(
        pose=POSE,
        highlights=spots,
        has_paper=False,
        reading=None,
        corners=None,
        probe=False,
        view=view,
        light=name,
    )


def started(entry: LightEntry | None, *observations: SimpleNamespace) -> Lamp | None:
    return start_lamp(SET, CAMERA, "one", entry, list(observations), None)


def test_two_balls_place_a_lamp_and_one_tells_its_direction():
    near = started(None, seen(0, 1))
    np.testing.assert_allclose(near.block, LAMP, atol=1e-5)
    assert (near.kind, near.source, near.one_ray) == ("point", "mirror balls", False)
    lonely = started(None, seen(0))
    assert lonely.kind == "directional" and lonely.one_ray and started(None, seen()) is None


def test_what_the_manifest_states_is_fixed():
    point = started(LightEntry("one", position=np.array([1.0, 2, 3])), seen(0, 1))
    assert point.fixed and point.source == "given" and point.block.tolist() == [1, 2, 3]
    flash = started(LightEntry("one", position=np.ones(3), attached_to="camera"), seen(0, 1))
    assert flash.fixed and flash.source == "camera" and flash.attached
    sun = started(LightEntry("one", direction=np.array([0.0, 3, 4])), seen(0, 1))
    assert sun.kind == "directional" and sun.block.tolist() == [0, 0.6, 0.8]


def test_a_lamp_on_the_camera_is_a_place_before_it():
    entry = LightEntry("one", attached_to="camera")
    lamp = started(entry, seen(0, 1))
    np.testing.assert_allclose(lamp.block, POSE.apply(LAMP), atol=1e-5)
    np.testing.assert_allclose(place_in_world(lamp, lamp.block, POSE), LAMP, atol=1e-5)


@pytest.mark.parametrize("kind", ["point", "directional"])
def test_a_highlight_belongs_where_the_lamp_is_mirrored(kind):
    values = {f"ball {k}": np.append(b.center, b.radius) for k, b in enumerate(BALLS)}
    place = LAMP if kind == "point" else 7.0 * unit(LAMP)
    values["light one"] = place
    lamp = Lamp("one", None, kind, place, "probe")
    found = expected_pixel(CAMERA, seen(), lamp, values, 1)
    true = highlight(1, LAMP if kind == "point" else 1e9 * unit(LAMP)).pixel
    np.testing.assert_allclose(found, true, atol=1e-4)


def test_rays_of_a_photo_are_those_of_its_highlights():
    rays = sight_rays(SET, CAMERA, seen(1, 0))
    assert [r.ball for r in rays] == [1, 0]
    for ray in rays:
        assert np.linalg.norm(np.cross(LAMP - ray.origin, ray.direction)) < 1e-6


def test_a_lamp_of_one_ray_stands_as_far_as_the_others_do():
    """Unless the manifest says that it is distant."""
    groups = {"a": [seen(0, 1, name="a")], "b": [seen(0, lamp=LAMP + 40.0, name="b")]}
    found = start_lamps(SET, CAMERA, groups, None, quiet)
    ray = sight_rays(SET, CAMERA, groups["b"][0])[0]
    reach = np.linalg.norm(LAMP - SET.sample.center)
    assert found["b"].kind == "point" and found["b"].one_ray
    np.testing.assert_allclose(found["b"].block, ray.origin + reach * ray.direction, rtol=1e-6)
    stated = replace(SET, lights=(LightEntry("b", kind="directional"), LightEntry("a")))
    assert start_lamps(stated, CAMERA, groups, None, quiet)["b"].kind == "directional"


def test_the_middle_is_the_boards_or_the_samples():
    np.testing.assert_array_equal(middle_of(replace(SET, board=BOARD)), MIDDLE)
    np.testing.assert_array_equal(middle_of(SET), [0, 0, 9])
    sheet = Plane(np.array([[0.0, 0], [6, 0], [0, 3]]), 2.0)
    np.testing.assert_allclose(middle_of(replace(SET, sample=sheet)), [2, 1, 2])


def test_a_lamp_that_settled_far_away_is_a_direction():
    """With the error of where it stands across the ray alone; near ones, given ones and those of a told kind stay."""
    drawn = Drawn(12)
    middle, toward = middle_of(drawn.photoset), unit(np.array([0.3, -0.2, 0.9]))
    lamp = Lamp("one", None, "point", middle, "board")
    far = middle + 20_000.0 * toward
    covariance = 30.0**2 * np.eye(3) + 5000.0**2 * np.outer(toward, toward)
    distant, direction, error = as_distant(drawn.photoset, lamp, far, covariance)
    assert distant == replace(lamp, kind="directional")
    np.testing.assert_allclose(direction, toward, atol=1e-12)
    np.testing.assert_allclose(
        error, (30.0 / 20_000.0) ** 2 * (np.eye(3) - np.outer(toward, toward)), atol=1e-12
    )
    near = middle + 900.0 * toward
    assert as_distant(drawn.photoset, lamp, near, covariance) is None
    for kind, place in (("directional", near), ("point", far)):
        told = replace(lamp, entry=LightEntry("one", kind=kind))
        assert (as_distant(drawn.photoset, told, place, covariance) is None) == (kind == "point")
    assert as_distant(drawn.photoset, replace(lamp, fixed=True), far, covariance) is None
    assert as_distant(replace(drawn.photoset, board=None), lamp, far, covariance) is None
