"""First guesses of a lamp: by the print's black and white, by rays, by falloff and shadows."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.detect.mirror_rays import MirroredRay
from photogonio.calib.shading.initial import (
    black_over_white,
    first_fit,
    misfit,
    ray_places,
    sky_places,
    square_ratios,
    thinned,
    white_level,
)
from tests.drawn.setups import BLACK, MIDDLE, PAPER, scene_of

DIAGONAL = float(2 * np.linalg.norm(MIDDLE))


def test_black_over_white_is_the_prints_whatever_the_lamp(drawn):
    """Noise of 1 %, light a little uneven within a square: medians of some twenty squares a photo."""
    _, readings = drawn
    assert black_over_white(readings) == pytest.approx(BLACK / PAPER, rel=0.01)
    dim = [replace(one, level=1e-3 * one.level) for one in readings]
    assert black_over_white(dim) == pytest.approx(black_over_white(readings), rel=1e-12)
    white = readings[0].samples.white
    bare = replace(
        readings[0],
        samples=readings[0].samples.keep(white),
        level=readings[0].level[white],
        noise=readings[0].noise[white],
    )
    assert black_over_white([bare]) == 0.05  # a usual print's, where none is seen


def test_squares_that_a_shadows_edge_crosses_say_nothing(drawn):
    _, (reading, *_) = drawn
    ratios, errors, places = square_ratios(reading)
    assert len(ratios) == len(errors) == len(places) > 10
    here = reading.samples.square == reading.samples.square[0]
    lit = here & (reading.samples.points[:, 0] > np.median(reading.samples.points[here, 0]))
    shaded = replace(reading, level=np.where(lit, 0.3, 1.0) * reading.level)
    assert len(square_ratios(shaded)[0]) == len(ratios) - 1


def test_errors_of_the_ratios_are_those_of_noise(drawn):
    """Of many squares, in their stated errors, beside what is the squares' own."""
    _, (reading, *_) = drawn
    _, errors, _ = square_ratios(reading)
    noisy = replace(
        reading,
        level=reading.level
        + np.sqrt(24 * reading.noise) * np.random.default_rng(1).normal(size=len(reading.level)),
        noise=25 * reading.noise,
    )
    _, wider, _ = square_ratios(noisy)
    assert np.median(wider) / np.median(errors) == pytest.approx(5.0, rel=0.15)


@pytest.mark.parametrize("count", [50, 700, 10**6])
def test_samples_are_thinned_evenly(drawn, count):
    _, (reading, *_) = drawn
    found = thinned(reading, count)
    whole = len(reading.level)
    assert min(count, whole) <= len(found.level) < 2 * min(count, whole) + 1
    assert len(found.samples) == len(found.level) == len(found.noise)
    assert white_level(found) == pytest.approx(white_level(reading), rel=0.2)


def test_places_stand_around_above_the_board():
    places = np.array(sky_places(MIDDLE, DIAGONAL))
    assert (places[:, 2] > 0).all()
    away = np.linalg.norm(places - MIDDLE, axis=1) / DIAGONAL
    assert sorted(set(np.round(away, 9))) == [1.3, 2.0, 3.2, 90.0]
    toward = (places - MIDDLE)[:, :2].sum(axis=0)
    np.testing.assert_allclose(
        toward, 0.0, atol=1e-9 * np.abs(places).max()
    )  # to no side more than to another


def test_two_rays_tell_where_they_meet():
    lamp = np.array([200.0, 90.0, 400.0])
    rays = []
    for k, origin in enumerate(([10.0, 10, 8], [170.0, 130, 8])):
        toward = lamp - origin
        rays.append(MirroredRay(k, np.array(origin), toward / np.linalg.norm(toward), 1e-3))
    places = ray_places(rays, DIAGONAL)
    assert min(np.linalg.norm(p - lamp) for p in places) < 1e-6
    assert len(ray_places(rays[:1], DIAGONAL)) == (len(places) - 1) / 2
    down = replace(rays[0], direction=-rays[0].direction)
    assert ray_places([down], DIAGONAL) == []  # nothing is lit from under the board
    assert ray_places([], DIAGONAL) == []


def test_falloff_and_shadows_agree_best_with_the_lamp_that_was_there(drawn):
    world, readings = drawn
    for k, reading in enumerate(readings):
        scene, lamp = scene_of(world), world.lamps[k]
        aside = np.cross(lamp - MIDDLE, [0, 0, 1.0])
        aside *= 0.15 * np.linalg.norm(lamp - MIDDLE) / np.linalg.norm(aside)
        best = misfit(reading, scene, lamp)
        others = [misfit(reading, scene, lamp + move) for move in (aside, -aside)]
        assert 0 <= best < min(others) <= max(others) <= 1
        dimmed = replace(reading, level=0.01 * reading.level)
        assert misfit(dimmed, scene, lamp) == pytest.approx(best, rel=1e-9)


def test_the_first_fit_starts_from_the_rays(drawn):
    world, (reading, *_) = drawn
    lamp, toward = world.lamps[0], world.lamps[0] - world.balls[0].center
    ray = MirroredRay(0, world.balls[0].center, toward / np.linalg.norm(toward), 5e-3)
    found = first_fit(thinned(reading, 600), scene_of(world), [ray], MIDDLE, DIAGONAL)
    assert np.linalg.norm(found[:3] - lamp) < 0.15 * np.linalg.norm(lamp - MIDDLE)
