"""Light that balls throw onto the board."""

import numpy as np
import pytest

from photogonio.calib.geometry.visibility import direct
from photogonio.calib.shading.interreflection import glossy_bounce, polished_bounce
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
