"""Lamps so far away that no paper tells how far: their directions are told by shadows all the same."""

from dataclasses import replace

import numpy as np

from photogonio.calib.adjust.alternate import _within_reach
from photogonio.calib.adjust.lamps import Lamp
from tests.calib.test_warnings import Drawn
from tests.drawn.setups import MIDDLE

FAR = 5e4  # mm
WIDTH = 4e-3  # radius of the sun over its distance, about
BEST, WORST = 0.2, 2.5  # degrees: of the middle photo, and of the worst; highlights tell 1 to 2


def test_directions_of_suns_are_found():
    """With one mirror ball, whose highlights say neither how far nor, to a degree, where."""
    drawn = Drawn(7, views=4)
    world = drawn.world
    toward = world.lamps - MIDDLE
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    strengths = world.strengths * FAR**2 / np.sum((world.lamps - MIDDLE) ** 2, axis=1)
    drawn.world = replace(world, lamps=MIDDLE + FAR * toward, strengths=strengths, lamp_radius=WIDTH * FAR)
    found = drawn.settled(balls=(0,), paper=True).settled
    off = []
    for k in range(len(toward)):
        lamp = found.lamps[sorted(found.lamps)[k]]
        block = found.values[f"light {lamp.name}"]
        own = block if lamp.kind == "directional" else block - MIDDLE
        own = own / np.linalg.norm(own)
        off.append(np.degrees(np.arctan2(np.linalg.norm(np.cross(own, toward[k])), own @ toward[k])))
    assert np.median(off) < BEST
    assert max(off) < WORST


def test_a_step_beyond_a_lamps_distance_is_cut_short():
    """Along the ray and across it; what is near enough, and lamps that are fixed, stay as they are."""
    before = {f"light {n}": np.array([0.0, 0.0, 1000.0]) for n in "abcd"}
    after = {
        "light a": np.array([10.0, 0.0, -4000.0]),
        "light b": np.array([800.0, 0.0, 1000.0]),
        "light c": np.array([20.0, 30.0, 1200.0]),
        "light d": np.array([900.0, 0.0, 50.0]),
    }
    lamps = {n: Lamp(n, None, "point", before["light a"], "board", fixed=n == "d") for n in "abcd"}
    moved = _within_reach(before, after, lamps)
    assert set(moved) == {"light a", "light b"}
    np.testing.assert_allclose(moved["light a"], [10.0, 0.0, 500.0])
    np.testing.assert_allclose(moved["light b"], [50.0, 0.0, 1000.0])
