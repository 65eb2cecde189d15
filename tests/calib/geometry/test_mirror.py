"""A polished ball as a mirror: the law of reflection, and the shortest way."""

import numpy as np
import pytest

from photogonio.calib.detect.highlights import Highlight
from photogonio.calib.detect.mirror_rays import mirrored_ray
from photogonio.calib.geometry.mirror import hit_sphere, mirrored_direction, mirrored_point, reflected_ray
from tests.drawn.mirror_balls import BALLS, CAMERA, LAMP, LAMPS, POSE, unit


@pytest.mark.parametrize("lamp", LAMPS, ids=str)
@pytest.mark.parametrize("ball", BALLS, ids=["left", "right"])
def test_the_law_of_reflection_holds_at_the_mirrored_point(ball, lamp):
    point = mirrored_point(ball.center, ball.radius, POSE.center, lamp)
    normal = (point - ball.center) / ball.radius
    assert np.linalg.norm(normal) == pytest.approx(1.0, abs=1e-12)
    to_eye, to_lamp = unit(POSE.center - point), unit(lamp - point)
    assert normal @ to_eye == pytest.approx(normal @ to_lamp, abs=1e-10)
    assert np.linalg.det([normal, to_eye, to_lamp]) == pytest.approx(0.0, abs=1e-10)
    assert normal @ to_eye > 0


@pytest.mark.parametrize("lamp", LAMPS, ids=str)
def test_the_ray_back_from_the_mirrored_point_meets_the_lamp(lamp):
    ball = BALLS[0]
    point = mirrored_point(ball.center, ball.radius, POSE.center, lamp)
    hit, direction = reflected_ray(POSE.center, unit(point - POSE.center)[None], ball.center, ball.radius)
    np.testing.assert_allclose(hit[0], point, atol=1e-8)
    assert np.linalg.norm(np.cross(lamp - hit[0], direction[0])) < 1e-7
    assert (lamp - hit[0]) @ direction[0] > 0


def test_light_takes_the_shortest_way_by_the_ball():
    """Fermat: no point of the ball that both see makes the way shorter."""
    ball = BALLS[1]
    best = mirrored_point(ball.center, ball.radius, POSE.center, LAMP)
    turns = np.random.default_rng(2).normal(size=(500, 3))
    others = ball.center + ball.radius * unit(best - ball.center + 3.0 * turns)

    def way(p: np.ndarray) -> np.ndarray:
        return np.linalg.norm(p - POSE.center, axis=-1) + np.linalg.norm(p - LAMP, axis=-1)

    assert (way(others) >= way(best) - 1e-9).all()


def test_a_direction_is_a_lamp_very_far_off():
    ball, toward = BALLS[0], unit(np.array([0.3, 0.4, 0.8]))
    reach = 1e7
    near = mirrored_point(ball.center, ball.radius, POSE.center, ball.center + reach * toward)
    far = mirrored_direction(ball.center, ball.radius, POSE.center, toward)
    # the lamp's direction differs between centre and point by at most radius / reach, the normal's by half
    np.testing.assert_allclose(far, near, atol=ball.radius**2 / reach)


def test_a_ray_past_the_ball_hits_nothing():
    ball = BALLS[0]
    across = unit(np.cross(ball.center - POSE.center, [0, 0, 1.0]))
    beside = ball.center + 1.2 * ball.radius * across
    assert np.isnan(hit_sphere(POSE.center, unit(beside - POSE.center)[None], ball.center, ball.radius)).all()
    lost = Highlight(0, CAMERA.project(POSE, beside[None])[0], 0.1, 1.0, 4.0, False)
    assert mirrored_ray(CAMERA, POSE, BALLS[0], lost) is None
