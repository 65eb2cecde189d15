"""A lamp that was carried about under one id is as many lights as it had places; one that stood still stays one."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.diagnose.photos.moved_lamp import MovedLamp
from photogonio.calib.diagnose.procedure import ask
from tests.drawn.calibrations import Drawn
from tests.drawn.setups import observe


def under_one_name(lamps: list[int], *, paper: bool):
    """Lights that a drawn set's photos end up with, all of one name at first, the lamp in these of the drawn places."""
    drawn = Drawn(3, fixed=True)
    places = tuple(drawn.world.lamps[k] for k in lamps)
    drawn.world = replace(drawn.world, lamps=places)
    state = drawn.camera()
    observations = state.observations
    for k, observation in enumerate(observations):
        observe(drawn.world, observation, k, 0.0, drawn.rng, paper=paper)
        observation.light = "lamp"
    observations = ask(state, [MovedLamp()]).observations
    return [s.light for s in observations], drawn


@pytest.mark.parametrize("paper", [False, True])
def test_each_place_of_a_lamp_becomes_a_light(paper):
    places = [0, 1, 2, 0, 1, 2]
    lights, drawn = under_one_name(places, paper=paper)
    alike = np.equal.outer(lights, lights)
    assert (alike == np.equal.outer(places, places)).all()
    assert drawn.said("in 3 places") and drawn.told("lamp-in-several-places")


@pytest.mark.parametrize("paper", [False, True])
def test_a_lamp_that_stood_still_stays_one_light(paper):
    lights, drawn = under_one_name([1] * 6, paper=paper)
    assert lights == ["lamp"] * 6 and not drawn.told("lamp-in-several-places")


def test_photos_without_balls_are_told_apart_by_their_paper():
    drawn = Drawn(3, fixed=True)
    state = drawn.camera()
    observations = state.observations
    for k, observation in enumerate(observations):
        observe(drawn.world, observation, k, 0.0, drawn.rng, paper=True)
        observation.light, observation.highlights = "lamp", []
    observations = ask(state, [MovedLamp()]).observations
    assert len({s.light for s in observations}) == len(observations)
