"""Mirror balls that stand elsewhere, or contradict the paper, are told by name."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.diagnose.registry import Stage, asked_at
from photogonio.calib.shading.model import Ball
from tests.drawn.calibrations import Drawn


@pytest.mark.parametrize(("times", "said"), [(1.2, False), (8.5, True)])
def test_mirror_balls_and_paper_that_contradict_each_other_are_told(times, said):
    drawn = Drawn(12)
    state = drawn.settled()
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
