"""Light that balls throw onto the board."""

import numpy as np
import pytest

from photogonio.calib.geometry.visibility import direct
from photogonio.calib.shading.interreflection import (
    bounce_columns,
    bounce_on_patch,
    diffuse_bounce,
    glossy_bounce,
    polished_bounce,
)
from tests.drawn.shadows import BALLS, LAMPS, TABLE, ring_of


@pytest.mark.parametrize("lamp", LAMPS)
def test_light_off_a_polished_ball_between_its_nodes(lamp):
    points = ring_of(np.random.default_rng(2), 3000)
    exact = sum(glossy_bounce(points, lamp, b.center, b.radius, f0=1.0) for b in BALLS)
    off = (polished_bounce(points, lamp, TABLE) - exact) / direct(points, lamp)
    assert np.abs(off).max() < 0.02  # at the line beyond which the ball hides its own light
    assert np.sqrt(np.mean(off**2)) < 0.002


def test_far_off_a_polished_ball_scatters_alike_in_all_directions():
    """(R / 2 d)^2 of the light that meets it (geometrical optics of a sphere), times the cosine at the ground of a way
    that begins where the normal halves the right angle. The images' depth in the ball counts with 3/2 R / d."""
    turn = np.arange(6.0)
    points = np.column_stack([10 + 230 * np.cos(turn), 10 + 230 * np.sin(turn), np.zeros(6)])
    lamp = np.array([10.0, 10, 4e4])
    height, away = 8 + 8 / np.sqrt(2), 230 - 8 / np.sqrt(2)
    expected = (8 / (2 * away)) ** 2 * (height / away) / np.linalg.norm(lamp) ** 2
    np.testing.assert_allclose(polished_bounce(points, lamp, TABLE[:1]), expected, rtol=1.5 * 8 / 230)


CENTER, RADIUS = np.array([90.0, 70, 25]), 25.0


def test_far_from_a_white_ball_its_light_is_that_of_a_sphere_in_full_moon():
    """Lambert's sphere, lit and seen from one side: its geometric albedo is 2/3, so that it sends 2/3 R^2 of the
    lamp's irradiance per solid angle. The lamp stands
    beside it, and so do the points, far off."""
    lamp = np.array([4e5, 70.0, 25 + 1e3])
    points = np.array([[90 + 4000.0, 70, 0], [90 + 4000.0, 90, 0]])
    offset = CENTER - points
    squared = (offset**2).sum(1)
    lit = 1 / np.sum((lamp - CENTER) ** 2)
    expected = 2 / 3 * RADIUS**2 * lit * (offset[:, 2] / np.sqrt(squared)) / squared
    found = diffuse_bounce(points, lamp, CENTER, RADIUS)
    # 160 facets, and a few per cent from the board below the ball at grazing light
    np.testing.assert_allclose(found, expected, rtol=0.1)


def test_a_ball_throws_no_more_than_it_gets():
    """Over all of the board: less than what falls on its disc, and on its lower half from a board of a third."""
    lamp = np.array([300.0, 70, 400])
    ring = np.geomspace(25.5, 5000, 120)
    turn = 2 * np.pi * (np.arange(24) + 0.5) / 24
    points = np.array([[90 + r * np.cos(t), 70 + r * np.sin(t), 0] for r in ring for t in turn])
    thrown = diffuse_bounce(points, lamp, CENTER, RADIUS).reshape(120, 24).mean(1)
    flux = np.trapezoid(thrown * 2 * np.pi * ring, ring)
    got = np.pi * RADIUS**2 / np.sum((lamp - CENTER) ** 2)
    assert 0.1 * got < flux < got


@pytest.mark.parametrize("lamp", LAMPS)
def test_between_nodes_it_is_what_it_is_point_by_point(lamp):
    """On the board to a hundredth of the most, rms; on a patch to less, but where gloss ends at the ball's horizon."""
    rng = np.random.default_rng(3)
    flat = np.column_stack([rng.uniform(0, 180, 2500), rng.uniform(0, 140, 2500)])
    flat = flat[np.hypot(*(flat - CENTER[:2]).T) > 1.5 * RADIUS]
    points = np.column_stack([flat, np.zeros(len(flat))])
    exact = np.column_stack([part(points, lamp, CENTER, RADIUS) for part in (diffuse_bounce, glossy_bounce)])
    coarse = bounce_columns(points, lamp, CENTER, RADIUS) - exact
    assert np.abs(coarse).max() < 0.05 * exact.max() and np.sqrt((coarse**2).mean()) < 0.01 * exact.max()
    near = points[(np.abs(points[:, :2] - [160, 20]) < 10).all(1)]
    repeated = np.tile(near, (60, 1))  # so many that a grid is worth it
    fine = bounce_on_patch(repeated, lamp, CENTER, RADIUS)[: len(near)]
    there = np.column_stack([part(near, lamp, CENTER, RADIUS) for part in (diffuse_bounce, glossy_bounce)])
    assert (
        np.abs(fine - there).max() < 0.05 * there.max() and np.abs(fine - there).mean() < 1e-3 * there.max()
    )
    np.testing.assert_allclose(bounce_on_patch(near, lamp, CENTER, RADIUS), there, rtol=1e-12)


def test_what_is_thrown_goes_with_the_lamps_strength_at_the_ball():
    """A lamp ten times as far sends a hundredth, and as good as parallel light throws it alike."""
    points = np.array([[30.0, 40, 0], [140, 120, 0]])
    toward = np.array([0.4, 0.3, 0.87])
    one, other = (
        diffuse_bounce(points, CENTER + far * toward, CENTER, RADIUS) * far**2 for far in (1e5, 1e6)
    )
    np.testing.assert_allclose(
        one, other, rtol=3 * 2 * RADIUS / 1e5
    )  # the square, and the slant, to a diameter
