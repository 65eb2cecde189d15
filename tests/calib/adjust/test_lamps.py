"""First guesses of lamps, and those of which little is known."""

from __future__ import annotations

import numpy as np

from photogonio.calib.adjust.alternate import settle
from photogonio.calib.diagnose.procedure import ask
from photogonio.calib.diagnose.registry import Stage, asked_at
from tests.drawn.calibrations import Drawn


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
