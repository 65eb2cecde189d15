"""A polished ball as a mirror: from lamp to highlight, and from highlights back to the lamp."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.detect.highlights import Highlight, find_highlight
from photogonio.calib.detect.mirror_rays import MirroredRay, meet, mirrored_ray
from photogonio.calib.detect.observe import of_one_lamp
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.cones import outline
from photogonio.calib.geometry.mirror import hit_sphere, mirrored_direction, mirrored_point, reflected_ray
from photogonio.capture.photoset import MirrorBall
from tests.drawn.boards import looking_at, radiance

SIZE = (640, 480)
CAMERA = Camera(
    np.array([[900.0, 0, 318.0], [0, 900.0, 241.0], [0, 0, 1]]),
    np.array([-0.1, 0.05, 3e-4, -2e-4, 0.0]),
    SIZE,
)
BALLS = (MirrorBall(np.array([-60.0, 5, 12]), 12.0), MirrorBall(np.array([60.0, -8, 12]), 12.0))
POSE = looking_at(np.array([10.0, -220, 330]), np.array([0.0, 0, 8]))
LAMP = np.array([150.0, 80, 420])
LAMPS = [LAMP, np.array([-300.0, 100, 150]), np.array([5.0, -350, 400])]


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def highlight(number: int, lamp: np.ndarray, off: np.ndarray | float = 0.0) -> Highlight:
    """Where a lamp shows, moved by ``off`` pixels."""
    ball = BALLS[number]
    point = mirrored_point(ball.center, ball.radius, POSE.center, lamp)
    return Highlight(number, CAMERA.project(POSE, point[None])[0] + off, 0.1, 1.0, 4.0, False)


def ray(number: int, lamp: np.ndarray, off: np.ndarray | float = 0.0) -> MirroredRay:
    found = mirrored_ray(CAMERA, POSE, BALLS[number], highlight(number, lamp, off))
    assert found is not None
    return found


def miss(one: MirroredRay, place: np.ndarray) -> float:
    """Distance of a place from a ray."""
    return float(np.linalg.norm(np.cross(place - one.origin, one.direction)))


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


def test_the_outline_is_where_rays_touch_the_ball():
    ball = BALLS[0]
    rays = CAMERA.world_rays(POSE, outline(CAMERA, POSE, ball.center, ball.radius))
    apart = np.linalg.norm(np.cross(ball.center - POSE.center, rays), axis=1)
    np.testing.assert_allclose(apart, ball.radius, rtol=1e-8)


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


def spot(pixel: np.ndarray, width: float, peak: float) -> np.ndarray:
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    return peak * np.exp(-0.5 * ((x - pixel[0]) ** 2 + (y - pixel[1]) ** 2) / width**2)


@pytest.mark.parametrize("shift", [0.0, 0.25, 0.5, 0.75])
def test_a_drawn_highlight_is_found_where_it_is(shift):
    true = highlight(0, LAMP).pixel + shift
    level = 0.05 + spot(true, 1.2, 3.0) + 0.002 * np.random.default_rng(1).normal(size=SIZE[::-1])
    found = find_highlight(radiance(level, 0.002), CAMERA, POSE, BALLS[0], 0)
    assert found is not None
    assert np.abs(found.pixel - true).max() < found.sigma
    assert not found.clipped


@pytest.mark.parametrize(("peak", "lamp"), [(40.0, True), (0.3, False)])
def test_a_clipped_lamp_is_brighter_than_a_window_that_sends_more_than_its_pixels_hold(peak, lamp):
    """A window's image, 3 x 3 pixels and blurred, holds more than a lamp's clipped at 1 does, and less than the lamp's
    own. A pixel that is always full is neither."""
    there = highlight(0, LAMP).pixel
    apart = there + np.array([0.0, 9.0])
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    window = 0.65 * (np.hypot(x - apart[0], y - apart[1]) < 2.6)
    level = 0.05 + spot(there, 0.5, peak) + window + 0.002 * np.random.default_rng(1).normal(size=SIZE[::-1])
    level[int(there[1]) + 4, int(there[0]) - 5] = 1.0
    image = radiance(np.minimum(level, 1.0), 0.002)
    full = image.value[..., 0] >= 1.0
    found = find_highlight(replace(image, saturated=full, valid=~full), CAMERA, POSE, BALLS[0], 0)
    place = there if lamp else apart
    assert found is not None and found.clipped == lamp
    assert np.hypot(*(found.pixel - place)) < 1.0


def test_a_highlight_outside_the_ball_is_none_of_its():
    away = highlight(1, LAMP).pixel
    level = 0.05 + spot(away, 1.2, 3.0) + 0.002 * np.random.default_rng(1).normal(size=SIZE[::-1])
    assert find_highlight(radiance(level, 0.002), CAMERA, POSE, BALLS[0], 0) is None
    assert find_highlight(radiance(level, 0.002), CAMERA, POSE, BALLS[1], 1) is not None


def test_a_dark_ball_shows_no_highlight():
    level = 0.05 + 0.002 * np.random.default_rng(1).normal(size=SIZE[::-1])
    assert find_highlight(radiance(level, 0.002), CAMERA, POSE, BALLS[0], 0) is None


def test_a_ball_outside_the_picture_is_not_searched():
    aside = Pose(POSE.rotation, POSE.translation + np.array([1000.0, 0, 0]))
    assert find_highlight(radiance(np.zeros(SIZE[::-1]), 0.002), CAMERA, aside, BALLS[0], 0) is None


@pytest.mark.parametrize(("dimmer", "kept"), [(0.5, 2), (0.1, 2), (0.01, 1)])
def test_a_ball_that_does_not_show_the_lamp_shows_something_dimmer(dimmer, kept):
    """A glossy sample or a bright wall in the second ball, where something hides the lamp."""
    bright, other = highlight(0, LAMP), highlight(1, LAMP)
    found = of_one_lamp([bright, replace(other, peak=dimmer * bright.peak)], BALLS)
    assert [h.ball for h in found] == [0, 1][:kept]


def test_a_clipped_lamp_is_a_lamp_in_a_ball_of_any_size():
    large = MirrorBall(BALLS[1].center, 8.0 * BALLS[0].radius)
    found = of_one_lamp([highlight(0, LAMP), replace(highlight(1, LAMP), clipped=True)], (BALLS[0], large))
    assert len(found) == 2


def test_a_small_ball_shows_the_same_lamp_dimmer():
    small = MirrorBall(
        BALLS[1].center, BALLS[1].radius / 10
    )  # its image of the lamp is a hundredth of the area
    found = of_one_lamp([highlight(0, LAMP), replace(highlight(1, LAMP), peak=0.01)], (BALLS[0], small))
    assert len(found) == 2
