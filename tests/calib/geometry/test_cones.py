"""The cone of rays that touches a ball."""

import numpy as np
import pytest

from photogonio.calib.geometry.camera import focal
from photogonio.calib.geometry.cones import cone_derivatives, cone_residual, outline
from tests.drawn.mirror_balls import BALLS, CAMERA, POSE


def test_the_outline_is_where_rays_touch_the_ball():
    ball = BALLS[0]
    rays = CAMERA.world_rays(POSE, outline(CAMERA, POSE, ball.center, ball.radius))
    apart = np.linalg.norm(np.cross(ball.center - POSE.center, rays), axis=1)
    np.testing.assert_allclose(apart, ball.radius, rtol=1e-8)


@pytest.mark.parametrize("share", [0.9, 1.0, 1.1])
def test_a_ray_lies_beside_the_limb_by_its_angle_times_the_focal_length(share):
    """Rays on the cone of a ball of another size: by how much its half angle is another."""
    axis = np.array([20.0, -30.0, 300.0])
    far = np.linalg.norm(axis)
    turn = np.linspace(0, 2 * np.pi, 7)[:, None]
    across = np.cross(axis, [0, 1.0, 0]) / np.linalg.norm(np.cross(axis, [0, 1.0, 0]))
    ring = np.cos(turn) * across + np.sin(turn) * np.cross(axis / far, across)
    half = np.arcsin(share * 25.0 / far)
    rays = np.cos(half) * axis / far + np.sin(half) * ring
    expected = 900.0 * (half - np.arcsin(25.0 / far))
    np.testing.assert_allclose(cone_residual(rays, axis, 25.0, 900.0), expected, atol=1e-8)


def test_derivatives_are_those_of_differences():
    ball, axis = BALLS[1], POSE.apply(BALLS[1].center)
    rays = CAMERA.rays(outline(CAMERA, POSE, ball.center, ball.radius, 20) + 0.7)
    by_center, by_radius = cone_derivatives(rays, axis, ball.radius, focal(CAMERA))

    def miss(center, radius):
        return cone_residual(rays, center, radius, focal(CAMERA))

    for k, step in enumerate(1e-4 * np.eye(3)):
        slope = (miss(axis + step, ball.radius) - miss(axis - step, ball.radius)) / 2e-4
        np.testing.assert_allclose(by_center[:, k], slope, atol=1e-6)
    slope = (miss(axis, ball.radius + 1e-4) - miss(axis, ball.radius - 1e-4)) / 2e-4
    np.testing.assert_allclose(by_radius, slope, atol=1e-6)


def test_a_ball_that_holds_the_camera_has_a_limb_all_around():
    inside = outline(CAMERA, POSE, POSE.center + np.array([0.0, 0, -5]), 9.0, 8)
    assert inside.shape == (8, 2)
