"""Lamps that do not shine alike to all sides."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.adjust.alternate import settle
from photogonio.calib.adjust.terms import BEAM_HELD
from photogonio.calib.diagnose.lights.lamp_beam import NARROWEST, LampBeam
from photogonio.calib.diagnose.procedure import tell_lights
from photogonio.capture.diagnosis import Diagnosis
from tests.drawn.calibrations import Drawn


@pytest.mark.parametrize("power", [0.0, 1.0])
def test_lamps_that_do_not_shine_alike_to_all_sides_are_told(power):
    """A panel's light goes with the cosine beside its axis: the board's edges, some 15 degrees off, are 3 % darker.
    Falloff alone would have it stand a tenth nearer; the ball's shadow knows better."""
    drawn = Drawn(3, views=4)
    state = drawn.watched(paper=True)
    for observation in state.observations:
        k = int(observation.view.name[1:])
        axis = drawn.world.sample.center - drawn.world.lamps[k]
        ray = observation.reading.samples.points - drawn.world.lamps[k]
        cosine = ray @ axis / np.linalg.norm(axis) / np.linalg.norm(ray, axis=1)
        observation.reading = replace(observation.reading, level=observation.reading.level * cosine**power)
    state = settle(state)
    (beam,) = LampBeam().evidence(state)
    assert state.settled.scene.narrow == 0.0
    assert beam.told == (power > 0)
    assert beam.amount == pytest.approx(power, abs=4 * beam.error + 0.1 * power)
    if beam.told:
        state = settle(LampBeam().remedy(state, [beam]))
        assert state.settled.scene.narrow == pytest.approx(power, abs=4 * beam.error)
    tell_lights(replace(state, found={beam.code: replace(beam, allowed=beam.told)}), [LampBeam()])
    assert drawn.told("lamp-beam") == (power > 0)


def settled_at(power: float, error: float) -> SimpleNamespace:
    """Where it comes to rest, held about 0 to BEAM_HELD, of photos that alone have ``power`` to ``error``."""
    information = error**-2.0 + BEAM_HELD**-2.0
    values, covariance = np.zeros(5), np.eye(5)
    values[2], covariance[2, 2] = power * error**-2.0 / information, 1 / information
    rest = SimpleNamespace(values={"lamp": values}, covariance={"lamp": covariance}, shading={"a": None})
    return SimpleNamespace(settled=rest)


@pytest.mark.parametrize(
    ("power", "error", "told"),
    [(0.21, 0.03, True), (0.19, 0.03, False), (0.49, 0.1, False), (0.51, 0.1, True)],
)
def test_what_photos_say_comes_back_from_where_it_was_held(power, error, told):
    (beam,) = LampBeam().evidence(settled_at(power, error))
    assert beam.amount == pytest.approx(power) and beam.error == pytest.approx(error)
    assert beam.told == told


def test_where_no_photo_tells_nothing_is_said():
    nothing = settled_at(0.0, 1.0)
    nothing.settled.covariance["lamp"][2, 2] = BEAM_HELD**2  # as surely as it was held, and no more
    assert LampBeam().evidence(nothing) == []
    nothing.settled.shading = {}
    assert LampBeam().evidence(nothing) == []


def test_once_allowed_for_it_is_what_settled():
    (beam,) = LampBeam().evidence(settled_at(0.5, 0.05))
    state = settled_at(0.5, 0.05)
    assert LampBeam().as_settled(state, beam) is beam
    now = LampBeam().as_settled(state, replace(beam, allowed=True))
    assert now.amount == state.settled.values["lamp"][2] and now.error == pytest.approx(
        np.sqrt(state.settled.covariance["lamp"][2, 2])
    )
    assert "0.50" in LampBeam().message(beam, allowed=True) and LampBeam().message(beam, allowed=False) == ""


@pytest.fixture(scope="module")
def begun():
    return settle(Drawn(3, views=2).watched(paper=True))


@pytest.mark.parametrize(("found", "tried"), [(3.0, 3.0), (1.8e8, NARROWEST), (-1e6, -NARROWEST)])
def test_no_beam_is_tried_that_no_lamp_has(begun, found, tried):
    """Of lamps far away the board spans no angle, and one step from 0 leads anywhere."""
    beam = Diagnosis("lamp-beam", "", found, 0.1 * abs(found), 0.2, 5.0)
    assert LampBeam().remedy(begun, [beam]).narrow == tried
