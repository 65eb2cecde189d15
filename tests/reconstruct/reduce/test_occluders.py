"""What may cover or shade the sample: nothing that does is missed, and what is far off is let go."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.calib.setup import Light
from photogonio.capture.photoset import MirrorBall, Plane, Sphere, WhitePatch
from photogonio.reconstruct.reduce.occluders import (
    BALL_SLACK,
    balls_beside,
    bounding_ball,
    cone_of,
    may_cover,
    may_shade,
    patch_cones,
)

SAMPLE = Sphere(np.array([0.0, 0.0, 25.0]), 25.0)
PLATE = Plane(np.array([[-30.0, -20.0], [30.0, -20.0], [30.0, 20.0], [-30.0, 20.0]]), 2.0)
EYE = np.array([40.0, -150.0, 200.0])


def lamp(place, radius: float = 8.0, kind: str = "point") -> Light:
    return Light("L", kind, np.asarray(place, float), np.zeros((3, 3)), "given", radius)


def meets(origin: np.ndarray, ray: np.ndarray, ball: np.ndarray) -> bool:
    """Whether any of the segments from ``origin`` along ``ray`` (n, 3) meets a ball (4,)."""
    offset, length = ball[:3] - origin, np.linalg.norm(ray, axis=1)
    along = np.clip(np.sum(offset * ray, axis=1) / length**2, 0.0, 1.0)
    return bool((np.linalg.norm(offset - along[:, None] * ray, axis=1) < ball[3]).any())


def anywhere(count: int, rng) -> np.ndarray:
    """Balls (n, 4) on the board about the sample, and above it."""
    return np.column_stack(
        [
            rng.uniform(-120.0, 120.0, (count, 2)),
            rng.uniform(3.0, 150.0, count),
            rng.uniform(3.0, 12.0, count),
        ]
    )


def test_a_ray_is_in_a_cone_by_the_angle_that_the_normals_say():
    corners = np.array([[-10.0, -5, 0], [10, -5, 0], [8, 6, 0], [-9, 7, 0]])
    for turn in (corners, corners[::-1]):
        normals = cone_of(EYE, turn)
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-14)
        inside = corners.mean(0) - EYE
        assert (normals @ inside > 0.0).all()
        assert (normals @ (corners[0] - EYE) > -1e-9).all()
        assert (normals @ (1.5 * corners[0] - EYE)).min() < 0.0


def test_balls_stand_beside_the_sample_or_in_its_place():
    beside = MirrorBall(np.array([40.0, 10.0, 8.0]), 8.0)
    for sample, probe in ((SAMPLE, SAMPLE.center + 1.0), (PLATE, np.array([0.0, 0.0, 5.0]))):
        rows = balls_beside((beside, MirrorBall(probe, 8.0)), sample)
        np.testing.assert_allclose(rows, [[40.0, 10.0, 8.0, 8.0 * (1.0 + BALL_SLACK)]])
    on_top = MirrorBall(np.array([0.0, 0.0, PLATE.height + 8.0]), 8.0)
    assert len(balls_beside((on_top,), PLATE)) == 1


def test_the_bounding_ball_holds_the_sample():
    middle = bounding_ball(PLATE)
    corners = np.column_stack([PLATE.outline, np.full(4, PLATE.height)])
    assert np.linalg.norm(corners - middle[:3], axis=1).max() <= middle[3] * (1.0 + 1e-12)
    np.testing.assert_array_equal(bounding_ball(SAMPLE), [0.0, 0.0, 25.0, 25.0])


def test_no_ball_that_covers_the_sample_is_missed_and_few_others_are_kept():
    rng = np.random.default_rng(0)
    balls, sample = anywhere(300, rng), bounding_ball(SAMPLE)
    kept = {tuple(ball) for ball in may_cover(balls, sample, EYE, 0.0)}
    surface = sample[:3] + sample[3] * unit(rng, 2000)
    covering = [ball for ball in balls if meets(EYE, surface - EYE, ball)]
    assert len(covering) > 10 and all(tuple(ball) in kept for ball in covering)
    assert len(kept) < 0.7 * len(balls)


def test_no_ball_that_shades_the_sample_is_missed_and_few_others_are_kept():
    rng = np.random.default_rng(1)
    balls, sample = anywhere(300, rng), bounding_ball(SAMPLE)
    light = lamp([150.0, 60.0, 220.0])
    kept = {tuple(ball) for ball in may_shade(balls, sample, light, 0.0)}
    surface = sample[:3] + sample[3] * unit(rng, 2000)
    rim = light.place + light.radius * unit(rng, 2000)
    shading = [ball for ball in balls if meets(surface, rim - surface, ball)]
    assert len(shading) > 10 and all(tuple(ball) in kept for ball in shading)
    assert len(kept) < 0.7 * len(balls)


def test_a_ball_before_the_sample_shades_it_and_one_behind_does_not():
    sample = bounding_ball(SAMPLE)
    for side in (1.0, -1.0):
        light = lamp([0.6 * side, 0.0, 0.8], kind="directional")
        behind, before = np.array([[-80.0 * side, 0.0, 8.0, 8.0], [60.0 * side, 0.0, 105.0, 8.0]])
        np.testing.assert_array_equal(may_shade(np.stack([behind, before]), sample, light, 0.01), [before])


def test_a_lamp_of_some_size_is_shaded_by_balls_farther_off_its_axis():
    """From beneath the ball, 100 off, a lamp of 0.1 radians reaches 10 to the side, and 2.5 more from the sample's far
    side."""
    overhead = lamp([0.0, 0.0, 1.0], kind="directional")
    for aside, small, wide in ((30.0, 1, 1), (38.0, 0, 1), (50.0, 0, 0)):
        ball = np.array([[aside, 0.0, 125.0, 8.0]])
        assert len(may_shade(ball, bounding_ball(SAMPLE), overhead, 0.0)) == small
        assert len(may_shade(ball, bounding_ball(SAMPLE), overhead, 0.1)) == wide


def test_a_patchs_shadow_on_a_plane_is_covered_and_a_patch_beneath_it_is_not_there(world):
    plane = world("plane")
    patch = plane.options.white_patches[0]
    ((height, normals),) = patch_cones((patch,), plane.setup.sample, plane.view, 0.0)
    assert height == patch.height
    corner = np.append(patch.outline[0], patch.height)
    toward = plane.view.light.place - corner
    foot = corner - toward * (patch.height - plane.setup.sample.height) / toward[2]
    for point in (corner, foot):
        assert (normals @ (point - plane.view.pose.center) > -1e-9).all()
    far = WhitePatch(patch.outline + 5000.0, patch.height, (0.9,))
    assert patch_cones((far, replace(patch, height=0.0)), plane.setup.sample, plane.view, 0.0) == ()


def unit(rng, n: int) -> np.ndarray:
    vectors = rng.normal(size=(n, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
