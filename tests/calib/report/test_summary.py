"""What is told of a calibration: drawn set-ups, each with one fault."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.adjust.lamps import Lamp
from photogonio.calib.remarks import Remarks
from photogonio.calib.report.summary import _shared_lights, account
from photogonio.calib.shading.model import Ball
from tests.drawn.calibrations import Drawn
from tests.drawn.setups import (
    SAMPLE,
)


def test_a_good_set_is_not_complained_of():
    drawn = Drawn(3)
    drawn.settled()
    # the drawn photos of the board do leave the pictures' corners empty
    assert set(drawn.remarks.codes()) <= {"corners-in-middle"}
    assert drawn.remarks.left_out == []


@pytest.mark.parametrize(("times", "said"), [(1.2, False), (8.5, True)])
def test_mirror_balls_and_paper_that_contradict_each_other_are_told(times, said):
    drawn = Drawn(12)
    state = drawn.settled()
    drawn.remarks.diagnoses.clear()
    account(replace(state, settled_or_none=replace(state.settled, highlight_scale=times)))
    assert drawn.told("balls-and-paper-contradict") == said


def test_a_sample_ball_that_stands_elsewhere():
    drawn = Drawn(10)
    away = replace(drawn.world.sample, center=SAMPLE.center + np.array([1.2, 0, 0]))
    drawn.world = replace(drawn.world, sample=away)
    found = drawn.settled().settled
    assert drawn.told("sample-moved")
    np.testing.assert_allclose(found.values["sample"][:2], away.center[:2], atol=0.15)


def test_a_sample_ball_that_cannot_stand_there():
    drawn = Drawn(10)
    drawn.world = replace(
        drawn.world, sample=replace(drawn.world.sample, center=SAMPLE.center + np.array([5.0, 0, 0]))
    )
    drawn.settled()
    assert drawn.told("sample-not-believed")


def test_a_mirror_ball_that_stands_elsewhere_is_named():
    drawn = Drawn(11)
    first = drawn.world.balls[0]
    drawn.world = replace(
        drawn.world, balls=(Ball(first.center + np.array([0, 3.0, 0]), first.radius), drawn.world.balls[1])
    )
    drawn.settled()
    assert drawn.said("mirror ball 1 (at 10, 10, 8)")
    assert not drawn.said("mirror ball 2")


@pytest.mark.parametrize(
    ("apart", "error", "said"), [(0.0, 0.1, False), (15.0, 0.1, True), (15.0, 5.0, False)]
)
def test_one_light_in_two_places_is_told(apart, error, said):
    """If the photos' paper is sure of it: one that shows a corner of the board has directions off by degrees."""
    turn = np.radians(apart)
    places = [430.0 * np.array([np.sin(t), 0.1, np.cos(t)]) for t in (0.3, 0.3 + turn)]
    spread = np.eye(3) * (np.radians(error) * np.linalg.norm(places[0])) ** 2
    shading = {
        n: SimpleNamespace(place=p, covariance=lambda: spread) for n, p in zip("ab", places, strict=True)
    }
    observations = [SimpleNamespace(view=SimpleNamespace(name=name), light="one") for name in "ab"]
    settled = SimpleNamespace(lamps={"one": Lamp("one", None, "point", places[0], "board")}, shading=shading)
    remarks = Remarks()
    _shared_lights(settled, observations, remarks)
    assert ("lamp-in-several-places" in remarks.codes()) == said
