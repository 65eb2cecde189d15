"""The cone of rays that touches a ball."""

import numpy as np

from photogonio.calib.geometry.cones import outline
from tests.drawn.mirror_balls import BALLS, CAMERA, POSE


def test_the_outline_is_where_rays_touch_the_ball():
    ball = BALLS[0]
    rays = CAMERA.world_rays(POSE, outline(CAMERA, POSE, ball.center, ball.radius))
    apart = np.linalg.norm(np.cross(ball.center - POSE.center, rays), axis=1)
    np.testing.assert_allclose(apart, ball.radius, rtol=1e-8)
