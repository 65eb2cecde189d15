"""Lamps that do not shine alike to all sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.adjust.alternate import settle
from photogonio.calib.diagnose.lights.lamp_beam import LampBeam
from photogonio.calib.diagnose.procedure import tell_lights
from tests.drawn.calibrations import Drawn


@pytest.mark.parametrize("power", [0.0, 1.0])
def test_lamps_that_do_not_shine_alike_to_all_sides_are_told(power):
    """A panel's light goes with the cosine beside its axis: the board's edges, some 15 degrees off, are 3 % darker.
    Falloff alone would have it stand a tenth nearer; the ball's shadow knows better."""
    drawn = Drawn(3)
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
