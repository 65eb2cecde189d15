"""How far one adjustment may move a lamp, and what is known of it then."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from photogonio.calib.adjust.bearing import Bearing
from photogonio.calib.adjust.bundle import Adjusted, Values
from photogonio.calib.adjust.lamps import Lamp, block_name

_REACH, _TURN = 0.5, 0.05  # of a lamp's distance, by which one round may change it, and move it across


def within_reach(
    starts: Sequence[Values], after: Values, lamps: dict[str, Lamp], middle: np.ndarray
) -> Values:
    """Places of lamps that moved by more than shadows hold for, as seen from the ``middle`` (3,) of what they light:
    they turn and come nearer, or go away, by as much as is safe. Of lamps far away little tells the distance, and a
    step may lead through the middle: it says that the lamp is nearer, and not where. They start from the nearest of
    ``starts``: where the round before left them, or where shading put them since.
    """
    moved = {}
    for name, lamp in lamps.items():
        block = block_name(name)
        if lamp.kind != "point" or lamp.fixed:
            continue
        new = after[block] - middle
        old = max(
            (s[block] - middle for s in starts if block in s), key=lambda one: one @ new / np.linalg.norm(one)
        )
        far, reach = float(np.linalg.norm(old)), float(np.linalg.norm(new))
        if old @ new <= 0:
            new, reach = old, 0.0
        turn = new / np.linalg.norm(new) - old / far
        aside = float(np.linalg.norm(turn))
        if abs(reach - far) > _REACH * far or aside > _TURN:
            toward = old / far + turn * min(1.0, _TURN / max(aside, 1e-300))
            reach = float(np.clip(reach, (1 - _REACH) * far, (1 + _REACH) * far))
            moved[block] = middle + reach * toward / np.linalg.norm(toward)
    return moved


def as_moved(done: Adjusted, moved: Values, middle: np.ndarray) -> Adjusted:
    """With lamps ``moved`` elsewhere, and their covariance as it is seen from the ``middle`` (3,): of a lamp that stays
    nearer its place is surer, not its direction."""
    covariance = dict(done.covariance)
    for block, place in moved.items():
        slope = Bearing(middle, place).by_place(done.values[block])
        covariance[block] = slope @ covariance[block] @ slope.T
    return replace(done, values=done.values | moved, covariance=covariance)
