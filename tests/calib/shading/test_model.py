"""The board's light as modelled: scenes out of their values and back, and what a lamp makes of paper."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.geometry.visibility import direct
from photogonio.calib.shading.model import Ball, LitPaper, ShadingScene, lit, median_ratio
from photogonio.calib.shading.parameters import EVEN, LOCAL, THROWN, TILTS
from tests.drawn.setups import scene_of

RNG = np.random.default_rng(2)


def scene(sample: bool = True) -> ShadingScene:
    balls = tuple(Ball(RNG.normal(size=3), float(RNG.uniform(1, 9))) for _ in range(2))
    own = Ball(RNG.normal(size=3), 25.0) if sample else None
    return ShadingScene(balls, own, 4.0, 0.07, 0.2, narrow=0.3, aim=(1.0, 2.0, 3.0), falloff=(-0.1, 0.02))


@pytest.mark.parametrize("sample", [True, False])
def test_a_scene_comes_back_from_its_values(sample):
    one = scene(sample)
    shared = one.shared + 0.01 * RNG.normal(size=len(one.shared))
    moved = one.moved(shared)
    if not sample:
        shared[:4] = [0, 0, 0, 1]  # of a sample that is none
    np.testing.assert_allclose(moved.shared, shared, rtol=1e-14)
    np.testing.assert_allclose(one.moved(one.shared).table, one.table)
    assert moved.aim == one.aim and moved.blur == one.blur and len(one.table) == 2 + sample


def test_where_no_ball_stands_all_of_the_lamp_is_seen(drawn):
    world, (reading, *_) = drawn
    points, bare = reading.samples.points, replace(scene_of(world), polished=(), sample=None)
    assert (lit(points, world.lamps[0], bare) == 1.0).all()
    share = lit(points, world.lamps[0], scene_of(world))
    assert share.min() == 0.0 and share.max() == 1.0


def values_of(world, reading) -> np.ndarray:
    """A lamp of strength 2, nothing thrown, an even paper."""
    own = np.zeros(LOCAL)
    own[:3], own[3] = world.lamps[0], np.log(2.0)
    return np.concatenate([own, scene_of(world).shared])


def test_radiance_is_print_times_lamp_times_what_is_seen_of_it(drawn):
    world, (reading, *_) = drawn
    board, values = LitPaper.of(reading), values_of(world, reading)
    light = board.light(values, scene_of(world))
    tone = 2.0 * np.where(reading.samples.white, 1.0, scene_of(world).black)
    np.testing.assert_allclose(light.tone, tone, rtol=1e-12)
    np.testing.assert_allclose(light.bare, tone * direct(board.points, world.lamps[0]), rtol=1e-12)
    assert ((light.shaded >= 0) & (light.shaded <= light.bare)).all()
    np.testing.assert_allclose(light.radiance(values, np.zeros((len(tone), 3))), light.shaded, rtol=1e-12)


def test_dark_paper_shows_what_is_left_of_its_noise_where_codes_end_at_0(drawn):
    reading, draws = drawn[1][0], 4000
    samples = replace(reading.samples, variance=np.full_like(reading.samples.value, 0.04))
    whole = replace(reading, samples=replace(samples, value=samples.value - samples.value.min()))
    below = replace(reading, samples=replace(samples, value=samples.value - 1.1 * samples.value.min()))
    board, radiance = LitPaper.of(whole), np.linspace(0.0, 1.2, len(reading.level))
    assert not LitPaper.of(below).cut.any() and (board.cut == pytest.approx(0.2))
    cut = np.maximum(RNG.normal(radiance, 0.2, (draws, len(radiance))), 0.0)
    seen, slope = board.shown(radiance)
    assert np.abs((cut.mean(0) - seen) / cut.std(0)).max() < 5.0 / np.sqrt(draws)
    assert seen[0] == pytest.approx(0.2 / np.sqrt(2 * np.pi)) and seen[-1] == pytest.approx(1.2)
    step = (board.shown(radiance + 1e-6)[0] - board.shown(radiance - 1e-6)[0]) / 2e-6
    far = np.abs(radiance - 0.8) > 1e-5  # from there on nothing is cut off, to 1e-5 of the noise
    np.testing.assert_allclose(slope[far], step[far], atol=1e-4)


def test_a_lamp_of_any_strength_and_place_overflows_nothing(drawn):
    """A trial may go anywhere: it is to be beaten by others, and warnings are errors here."""
    world, (reading, *_) = drawn
    board, values = LitPaper.of(reading), values_of(world, reading)
    for values[2], values[3] in ((1e200, 1e4), (1e3, 1e4), (1e200, -1e4)):
        assert np.isfinite(board.light(values, scene_of(world)).even)


def test_what_is_added_is_in_proportion_to_its_amount(drawn):
    """Even light is so much of the direct light in the middle; what balls throw, and tilts, likewise."""
    world, (reading, *_) = drawn
    board, values = LitPaper.of(reading), values_of(world, reading)
    plain, thrown = board.light(values, scene_of(world)), RNG.uniform(0, 1e-6, (len(reading.level), 3))
    values[EVEN], values[THROWN] = 0.1, [0.2, 0.3, 0.4]
    light = board.light(values, scene_of(world))
    middle = np.median(plain.bare / plain.tone)
    assert light.even == pytest.approx(middle, rel=1e-12)
    expected = plain.shaded + plain.tone * (0.1 * middle + thrown @ [0.2, 0.3, 0.4])
    np.testing.assert_allclose(light.radiance(values, thrown), expected, rtol=1e-12)
    values[TILTS] = [0.01, -0.02]
    tilt = board.light(values, scene_of(world)).tilt
    np.testing.assert_allclose(tilt, 1 + [0.01, -0.02] @ board.across, rtol=1e-12)
    assert board.across.min() == -1.0 and board.across.max() == 1.0


def test_a_lens_takes_its_share_of_all_light(drawn):
    world, (reading, *_) = drawn
    board, values = LitPaper.of(reading), values_of(world, reading)
    scene, dim = scene_of(world), replace(scene_of(world), falloff=(-0.2, 0.05))
    dimmed = np.concatenate([values[:LOCAL], dim.shared])
    left = np.exp(-0.2 * board.aside + 0.05 * board.aside**2)
    one, other = board.light(values, scene), board.light(dimmed, dim)
    np.testing.assert_allclose(other.parts[:3], one.parts[:3] * left, rtol=1e-12)


def test_what_balls_throw_is_worked_out_once(drawn):
    world, (reading, *_) = drawn
    board = LitPaper.of(reading)
    assert board.thrown(scene_of(world)) is board.thrown(replace(scene_of(world), black=0.1))


@pytest.mark.parametrize("count", [1, 100, 10_001])
def test_a_ratios_median_is_told_by_a_part_of_many(count):
    above, below = RNG.lognormal(size=count) * 3.0, np.ones(count)
    error = 1.2533 * 1.0 / np.sqrt(min(count, 2000))
    assert abs(np.log(median_ratio(above, below) / np.median(above))) < 5 * error
