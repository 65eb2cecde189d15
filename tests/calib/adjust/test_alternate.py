"""Lamps so far away that no paper tells how far: their directions are told by shadows all the same."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.coverage import deviations
from photogonio.calib.adjust.alternate import _by_highlights, _rays, _Round, _shade
from photogonio.calib.adjust.bundle import Adjusted
from photogonio.calib.adjust.lamp_steps import as_moved, within_reach
from photogonio.calib.adjust.lamps import Lamp, block_name
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


def test_a_step_beyond_a_lamps_distance_is_cut_short():
    """Along the ray and across it; what is near enough, and lamps that are fixed, stay as they are."""
    start = np.array([0.0, 0.0, 1000.0])
    steps = {
        "light a": np.array([10.0, 0.0, -5000.0]),  # through the middle
        "light b": np.array([800.0, 0.0, 0.0]),
        "light c": np.array([20.0, 30.0, 200.0]),
        "light d": np.array([900.0, 0.0, -950.0]),
        "light e": np.array([1.0, 0.0, 5000.0]),
    }
    lamps = {n: Lamp(n, None, "point", MIDDLE + start, "board", fixed=n == "d") for n in "abcde"}
    before = {name: MIDDLE + start for name in steps}
    after = {name: MIDDLE + start + step for name, step in steps.items()}
    moved = {n: place - MIDDLE for n, place in within_reach([before], after, lamps, MIDDLE).items()}
    assert set(moved) == {"light a", "light b", "light e"}
    np.testing.assert_allclose(moved["light a"], [0.0, 0.0, 500.0])
    assert np.hypot(*moved["light b"][:2]) / moved["light b"][2] == pytest.approx(0.05, rel=0.5)
    assert np.linalg.norm(moved["light b"]) == pytest.approx(np.hypot(800.0, 1000.0))
    np.testing.assert_allclose(moved["light e"], [0.25, 0.0, 1500.0], atol=0.01)


def test_a_step_is_counted_from_where_shading_has_a_lamp_too():
    """A first guess may be far off; the shadows that lead it home hold there, not where it came from."""
    lamps = {n: Lamp(n, None, "point", MIDDLE, "board") for n in "ab"}
    guess, place = np.array([600.0, 0.0, 1000.0]), np.array([10.0, 0.0, 1000.0])
    shaded, after = (
        {"light a": MIDDLE + place},
        {n: MIDDLE + place + [5.0, 0.0, 0.0] for n in ("light a", "light b")},
    )
    before = {"light a": MIDDLE + guess, "light b": MIDDLE + guess}
    assert set(within_reach([before, shaded], after, lamps, MIDDLE)) == {"light b"}


def test_a_lamp_that_is_kept_nearer_keeps_the_error_of_its_direction():
    up = np.array([0.0, 0.0, 1.0])
    far, near = MIDDLE + 1e6 * up, MIDDLE + 1e4 * up
    covariance = np.diag([2e4, 1e4, 1e6]) ** 2
    found = Adjusted({"light a": far}, {"light a": covariance}, [], 0.0)
    kept = as_moved(found, {"light a": near}, MIDDLE).covariance["light a"]
    np.testing.assert_allclose(
        np.sqrt(np.diag(kept)), [200.0, 100.0, 100.0], rtol=1e-9
    )  # of inverse distance


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
