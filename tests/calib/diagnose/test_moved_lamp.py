"""A lamp that was carried about under one id is as many lights as it had places; one that stood still stays one."""

from dataclasses import replace

import numpy as np
import pytest
from photogonio.calib.detect.photo_reader import Reader
from photogonio.calib.diagnose.moved_lamp import tell_shared_apart

from tests.calib.test_warnings import Drawn
from tests.drawn.setups import observe


def under_one_name(lamps: list[int], *, paper: bool):
    """Lights that a drawn set's photos end up with, all of one name at first, the lamp in these of the drawn places."""
    drawn = Drawn(3, fixed=True)
    places = tuple(drawn.world.lamps[k] for k in lamps)
    drawn.world = replace(drawn.world, lamps=places)
    camera, _, _, observations = drawn.camera()
    for k, observation in enumerate(observations):
        observe(drawn.world, observation, k, 0.0, drawn.rng, paper=paper)
        observation.light = "lamp"
    tell_shared_apart(
        drawn.photoset, Reader(drawn.photoset, lambda _, view: None), camera, observations, drawn.remarks
    )
    return [s.light for s in observations], drawn


@pytest.mark.parametrize("paper", [False, True])
def test_each_place_of_a_lamp_becomes_a_light(paper):
    places = [0, 1, 2, 0, 1, 2]
    lights, drawn = under_one_name(places, paper=paper)
    alike = np.equal.outer(lights, lights)
    assert (alike == np.equal.outer(places, places)).all()
    assert drawn.said("in 3 places") and drawn.said("id of its own")


@pytest.mark.parametrize("paper", [False, True])
def test_a_lamp_that_stood_still_stays_one_light(paper):
    lights, drawn = under_one_name([1] * 6, paper=paper)
    assert lights == ["lamp"] * 6 and not drawn.said("id of its own")


def test_photos_without_balls_are_told_apart_by_their_paper():
    drawn = Drawn(3, fixed=True)
    camera, _, _, observations = drawn.camera()
    for k, observation in enumerate(observations):
        observe(drawn.world, observation, k, 0.0, drawn.rng, paper=True)
        observation.light, observation.highlights = "lamp", []
    tell_shared_apart(
        drawn.photoset, Reader(drawn.photoset, lambda _, view: None), camera, observations, drawn.remarks
    )
    assert len({s.light for s in observations}) == len(observations)
