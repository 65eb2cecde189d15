"""A polished ball as a mirror: from lamp to highlight, and from highlights back to the lamp."""

import numpy as np
import pytest

from photogonio.calib.detect.mirror_rays import MirroredRay, meet
from tests.drawn.mirror_balls import BALLS, LAMP, LAMPS, miss, ray, unit


@pytest.mark.parametrize("lamp", LAMPS, ids=str)
def test_two_balls_give_the_place(lamp):
    place = meet([ray(0, lamp), ray(1, lamp)], None, 150.0)
    assert place.kind == "point"
    np.testing.assert_allclose(place.place, lamp, atol=1e-6)
    assert place.residual < 1e-6


def test_one_ball_gives_a_direction():
    one = ray(0, LAMP)
    place = meet([one], None, 150.0)
    assert place.kind == "directional"
    np.testing.assert_allclose(place.place, unit(LAMP - one.origin), atol=1e-9)


def test_parallel_rays_mean_a_distant_lamp():
    toward = unit(np.array([0.2, -0.3, 0.9]))
    rays = [ray(k, BALLS[k].center + 1e8 * toward) for k in (0, 1)]
    place = meet(rays, None, 150.0)
    assert place.kind == "directional"
    np.testing.assert_allclose(place.place, toward, atol=1e-6)


def test_a_lamp_stated_as_distant_is_not_placed():
    assert meet([ray(0, LAMP), ray(1, LAMP)], "directional", 150.0).kind == "directional"


def test_the_surer_ray_counts_more():
    sure, vague = ray(0, LAMP), ray(1, LAMP, np.array([0.0, 1.0]))
    vague = MirroredRay(1, vague.origin, vague.direction, 10 * sure.spread)
    alike = MirroredRay(1, vague.origin, vague.direction, sure.spread)
    weighted, even = meet([sure, vague], None, 150.0).place, meet([sure, alike], None, 150.0).place
    assert miss(sure, weighted) < 0.1 * miss(sure, even)


def test_the_stated_error_is_that_of_many_trials():
    rng = np.random.default_rng(7)
    pairs = rng.normal(size=(400, 2, 2)) * 0.1
    found = [meet([ray(k, LAMP, off[k]) for k in (0, 1)], None, 150.0) for off in pairs]
    spread = np.trace(np.cov(np.array([p.place for p in found]).T))
    stated = np.mean([np.trace(p.covariance) for p in found])
    # the spread counts one isotropic error a ray: right to the slant at which the ball is met, within two
    assert 0.5 < np.sqrt(stated / spread) < 2.0
