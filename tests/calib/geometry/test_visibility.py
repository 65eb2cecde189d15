"""Shadows of balls under a lamp that is no point, and what stands in the way."""

import numpy as np
import pytest

from photogonio.calib.geometry.visibility import behind_ball, direct, lit_fraction, log_cosine
from photogonio.calib.shading.kernel import light_on_board
from tests.drawn.shadows import LAMP_RADIUS, LAMPS, SPREAD, TABLE, blurred, ring_of


@pytest.mark.parametrize("lamp", LAMPS)
def test_the_edge_of_a_shadow_is_as_wide_as_lamp_and_blur_make_it(lamp):
    """Against rays. The limb's straight line and three lines for the disc leave 3 % at the worst of an edge whose
    places all lie within what the blur linearises; on the mean over the edges they leave nothing."""
    points = ring_of(np.random.default_rng(1), 1500)
    found, none, spread = np.empty((4, len(points))), np.zeros(2), np.tile(SPREAD, (len(points), 1))
    white, across, aim = np.ones(len(points)), np.zeros((2, len(points))), np.zeros(3)
    light_on_board(
        points, white, spread, across, lamp, 1.0, 0.1, LAMP_RADIUS, 0.0, aim, none, 0.0, TABLE, found
    )
    bare, shaded = found[1], found[2]
    true = blurred(points, lamp)
    edge = (true > 0.02) & (true < 0.98)
    assert edge.sum() > 50
    off = shaded / bare - true
    assert np.sqrt(np.mean(off[edge] ** 2)) < 0.03
    assert abs(off[edge].mean()) < 0.01
    assert np.abs(off[~edge]).max() < 0.03
    np.testing.assert_allclose(bare, direct(points, lamp))


NO_BALLS = np.zeros((0, 4))
BALL = np.array([[0.0, 0, 10, 5]])


def test_light_on_the_board_goes_with_the_third_power_of_the_cosine():
    """1 / h^2 at the lamp's foot; aside it is as much farther, and slants: cos^2 and cos of it. Nothing from below."""
    height = 40.0
    aside = np.linspace(0, 80, 9)
    points = np.column_stack([aside, np.zeros(9), np.zeros(9)])
    cosine = height / np.hypot(height, aside)
    np.testing.assert_allclose(direct(points, np.array([0.0, 0, height])), cosine**3 / height**2, rtol=1e-13)
    assert not direct(points, np.array([0.0, 0, -height])).any() and not direct(points, np.zeros(3)).any()


def test_all_light_that_a_lamp_sends_down_meets_the_board():
    """Of a lamp of unit intensity, over a disc of radius R: 2 pi (1 - h / sqrt(h^2 + R^2)) of solid angle."""
    height, reach = 10.0, 60.0
    ring = (np.arange(4000) + 0.5) / 4000 * reach
    points = np.column_stack([ring, np.zeros(4000), np.zeros(4000)])
    flux = np.sum(direct(points, np.array([0.0, 0, height])) * 2 * np.pi * ring) * reach / 4000
    assert flux == pytest.approx(2 * np.pi * (1 - height / np.hypot(height, reach)), rel=1e-5)


def test_the_beam_is_the_angle_at_the_lamp_and_never_darker_than_is_told():
    lamp, aim = np.array([0.0, 0, 30]), np.array([0.0, 0, 0])
    points = np.array([[0.0, 0, 0], [30, 0, 0], [0, 30 * np.sqrt(3), 0], [1e6, 0, 0]])
    found = np.exp(log_cosine(points, lamp, aim))
    np.testing.assert_allclose(found, [1.0, np.sqrt(0.5), 0.5, 0.05], rtol=1e-9)


@pytest.mark.parametrize("lamp_radius", [0.0, 0.5, 3.0])
def test_half_of_the_lamp_is_seen_along_its_middles_ray_past_the_limb(lamp_radius):
    """Where the straight line from the lamp's middle touches the ball, its limb cuts the disc in half."""
    lamp = np.array([200.0, 0, 210.0])
    offset = lamp - BALL[0, :3]
    half = np.arcsin(5 / np.linalg.norm(offset))
    turn = np.arctan2(offset[2], offset[0]) + half * np.array([-1, 1])  # of the two tangents in this plane
    feet = np.array([[lamp[0] - lamp[2] / np.tan(t), 0, 0] for t in turn])
    np.testing.assert_allclose(lit_fraction(feet, lamp, max(lamp_radius, 1e-9), BALL, 0.01), 0.5, atol=0.01)


def test_shadows_multiply_and_end_and_nothing_stands_in_the_way_from_behind():
    lamp, foot = np.array([0.0, 0, 300]), np.zeros((1, 3))
    far = np.array([[400.0, 0, 0]])
    assert lit_fraction(foot, lamp, 2.0, BALL, 0.0) == 0 and lit_fraction(far, lamp, 2.0, BALL, 0.0) == 1
    assert lit_fraction(foot, lamp, 2.0, NO_BALLS, 0.0) == 1
    above = np.array([[0.0, 0, 400, 5]])
    assert lit_fraction(foot, lamp, 2.0, above, 0.0) == 1  # beyond the lamp
    line = np.column_stack([np.linspace(4, 7, 40), np.zeros(40), np.zeros(40)])
    one, other = BALL, np.array([[0.0, 3, 10, 5]])
    both = lit_fraction(line, lamp, 20.0, np.vstack([one, other]), 0.0)
    each = lit_fraction(line, lamp, 20.0, one, 0.0) * lit_fraction(line, lamp, 20.0, other, 0.0)
    np.testing.assert_allclose(both, each, rtol=1e-12)


def test_what_a_ball_hides_lies_behind_it_and_not_before():
    eye, rng = np.array([0.0, -50, 80]), np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-30, 30, (3000, 2)), np.zeros(3000)])
    found = behind_ball(points, eye, BALL[0, :3], 5.0)
    toward = points - eye
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    offset = BALL[0, :3] - eye
    passing = np.linalg.norm(np.cross(toward, offset), axis=1)
    np.testing.assert_array_equal(found, passing < 5.0)
    assert 0.01 < found.mean() < 0.5
    assert not behind_ball(eye + 0.3 * (points - eye), eye, BALL[0, :3], 5.0).any()
