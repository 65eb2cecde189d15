"""Lamps so far away that no paper tells how far: their directions are told by shadows all the same."""

from dataclasses import replace

import numpy as np

from benchmarks.coverage import deviations
from photogonio.calib.adjust.alternate import _by_highlights, _rays, _Round, _shade
from photogonio.calib.adjust.lamps import block_name
from tests.drawn.calibrations import Drawn
from tests.drawn.setups import (
    MIDDLE,
)

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


def test_no_lamp_settles_beside_where_its_mirror_balls_show_it():
    # this seed's first lamp would settle 40 mm off: there the shadows count as dirt, and the fit is good
    off = [d.z for d in deviations(53, paper=True) if d.what == "light"]
    assert np.abs(off).max() < 5.0  # standard errors, of 24 numbers


def test_a_lamp_that_was_thrown_under_the_board_comes_back():
    """What contradicts itself may throw it there in a round, as two lamps under one name do: nothing is lit from there,
    and nothing would tell the way back."""
    drawn = Drawn(3)
    state = drawn.settled(paper=True)
    found, observations = state.settled, state.copied()
    true = {s.view.name: s.shading[:3].copy() for s in observations}
    values = dict(found.values)
    for name in found.lamps:
        values[block_name(name)] = values[block_name(name)] * [1.0, 1.0, -0.1]
    now = _Round(state, observations, found.lamps, values, found.scene)
    _shade(now, found.scene, 3, {})
    fits = now.fits
    assert fits
    for name, fit in fits.items():
        assert np.linalg.norm(fit.place - true[name]) < 0.05 * np.linalg.norm(true[name])


def test_highlights_that_were_dropped_still_show_a_lamp():
    """A lamp that went astray drops the right highlights of its photo, and has nothing else to lead it back."""
    drawn = Drawn(13)
    state = drawn.settled(paper=True)
    found, observations = state.settled, state.copied()
    now = _Round(state, observations, found.lamps, found.values, found.scene)
    first = {s.view.name: tuple(s.highlights) for s in observations}
    none, name = dict.fromkeys(first, ()), observations[2].view.name
    now.sights = _rays(now, none)
    kept = _by_highlights(now)
    observations[2].highlights = []
    now.sights = _rays(now, first)
    shown = _by_highlights(now)
    assert len(kept) == len(observations)
    np.testing.assert_array_equal([shown[k] for k in kept], list(kept.values()))
    now.sights = _rays(now, none)
    assert name not in _by_highlights(now)
