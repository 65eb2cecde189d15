"""Mirror balls that stand elsewhere, or contradict the paper, are told by name."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.adjust.state import State
from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.diagnose.registry import Stage, asked_at
from photogonio.calib.shading.model import Ball
from tests.drawn.calibrations import Drawn


@pytest.fixture(scope="module")
def sound() -> tuple[Drawn, State]:
    """A set-up that settles without complaint, which a test may ask about otherwise."""
    drawn = Drawn(12)
    return drawn, drawn.settled()


@pytest.mark.parametrize(("times", "said"), [(1.2, False), (8.5, True)])
def test_mirror_balls_and_paper_that_contradict_each_other_are_told(sound, times, said):
    drawn, state = sound
    drawn.remarks.diagnoses.clear()
    other = replace(state, settled_or_none=replace(state.settled, highlight_scale=times))
    ask(other, asked_at(Stage.PLACES))
    assert drawn.told("balls-and-paper-contradict") == said


def test_a_mirror_ball_that_stands_elsewhere_is_named():
    drawn = Drawn(11)
    first = drawn.world.balls[0]
    drawn.world = replace(
        drawn.world, balls=(Ball(first.center + np.array([0, 3.0, 0]), first.radius), drawn.world.balls[1])
    )
    drawn.settled()
    assert drawn.said("mirror ball 1 (at 10, 10, 8)")
    assert not drawn.said("mirror ball 2")


def unseen(state, kept=0, center=None):
    """The same with the first ball's highlight left in ``kept`` photos, the manifest's ball at ``center`` if given."""
    seen, others = [], []
    for one in state.observations:
        shows = any(h.ball == 0 for h in one.highlights) and len(seen) >= kept
        (others if shows or not any(h.ball == 0 for h in one.highlights) else seen).append(one)
    blind = [replace(one, highlights=[h for h in one.highlights if h.ball != 0]) for one in others]
    first, *rest = state.photoset.mirror_balls
    photoset = replace(state.photoset, mirror_balls=(replace(first, center=center or first.center), *rest))
    return replace(state, observations=seen + blind, photoset=photoset)


def test_a_mirror_ball_in_which_no_photo_shows_a_lamp_or_that_lies_outside_all_is_named(sound):
    """One photo's highlight is enough to have seen it."""
    drawn, state = sound
    told = []
    for other in (unseen(state), unseen(state, kept=1), unseen(state, center=(2000.0, 1500.0, 8.0))):
        drawn.remarks.diagnoses.clear()
        ask(other, asked_at(Stage.PLACES))
        told.append([one.message for one in drawn.remarks.diagnoses if one.code == "mirror-ball-unseen"])
    assert [len(one) for one in told] == [1, 0, 1]
    assert told[0][0].startswith("mirror ball 1 (at 10, 10, 8) shows no lamp in any of the ")
    assert told[2][0].startswith("mirror ball 1 (at 2000, 1500, 8) lies outside every photo")
