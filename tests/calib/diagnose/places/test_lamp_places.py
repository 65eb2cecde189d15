"""Lamps that stood in several places under one name, and photos whose lamp nobody found."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.adjust.lamps import Lamp
from photogonio.calib.diagnose.places.lamp_places import LampNotBelieved, apart, unsure
from tests.drawn.calibrations import Drawn


@pytest.mark.parametrize(
    ("angle", "error", "said"), [(0.0, 0.1, False), (15.0, 0.1, True), (15.0, 5.0, False)]
)
def test_one_light_in_two_places_is_told(angle, error, said):
    """If the photos' paper is sure of it: one that shows a corner of the board has directions off by degrees."""
    turn = np.radians(angle)
    places = [430.0 * np.array([np.sin(t), 0.1, np.cos(t)]) for t in (0.3, 0.3 + turn)]
    spread = np.eye(3) * (np.radians(error) * np.linalg.norm(places[0])) ** 2
    shading = {
        n: SimpleNamespace(place=p, covariance=lambda: spread) for n, p in zip("ab", places, strict=True)
    }
    observations = [SimpleNamespace(view=SimpleNamespace(name=name), light="one") for name in "ab"]
    settled = SimpleNamespace(lamps={"one": Lamp("one", None, "point", places[0], "board")}, shading=shading)
    assert [one.code for one in apart(settled, observations)] == ["lamp-in-several-places"] * said


def test_photos_of_a_lamp_that_is_not_found_are_left_out_and_the_others_kept():
    drawn = Drawn(12)
    state, departure = drawn.settled(), LampNotBelieved()
    assert departure.evidence(state) == []
    lamps = {name: lamp for name, lamp in state.settled.lamps.items() if name != "s2"}
    state = replace(state, settled_or_none=replace(state.settled, lamps=lamps))
    found = departure.evidence(state)
    assert [one.views for one in found] == [("s2",)]
    kept = departure.remedy(state, found).observations
    assert [s.view.name for s in kept] == [s.view.name for s in state.observations if s.view.name != "s2"]
    assert [one.name for one in drawn.remarks.left_out] == ["s2"] and drawn.told("lamp-not-believed")


@pytest.mark.parametrize(("unsure_ones", "left"), [(1, 1), (2, 0)])
def test_a_lamp_whose_direction_nothing_tells_is_not_used_on_a_flat_sample(unsure_ones, left):
    """How far away it is need not be known; and where most lamps are unsure there is nothing better to go by."""
    middle, place = np.array([90.0, 70.0, 0.0]), np.array([90.0, 470.0, 300.0])
    along = (place - middle) / 500.0
    far_or_near = np.outer(along, along) * 400.0**2 + np.eye(3) * (500.0 * np.radians(2.0)) ** 2
    aside = far_or_near + np.eye(3) * (500.0 * np.radians(10.0)) ** 2
    lamps = {name: Lamp(name, None, "point", place, "board") for name in "abc"}
    settled = SimpleNamespace(
        lamps=lamps,
        values={f"light {name}": place for name in lamps},
        covariance={f"light {n}": aside if k < unsure_ones else far_or_near for k, n in enumerate(lamps)},
    )
    found = unsure(settled, middle, "abc")
    assert list(found) == ["a"][:left] and all("10 degrees" in why for why in found.values())
