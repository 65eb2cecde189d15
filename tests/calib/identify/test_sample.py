"""A ball and a flat piece are found where they were put, and told from one another."""

import numpy as np
import pytest

from photogonio.calib.geometry.print_map import draw_print
from photogonio.calib.geometry.visibility import behind_ball
from photogonio.calib.identify.covered import cover_of
from photogonio.calib.identify.sample import SamplePhoto, find_sample
from photogonio.capture.photoset import Plane, Sphere
from tests.drawn.boards import BOARD, CAMERA, draw, looking_at

EYES = [np.array(eye) for eye in ([48.0, -90.0, 220.0], [160.0, 40.0, 210.0], [-60.0, 60.0, 200.0])]
MIDDLE = np.array([48.0, 36.0, 0.0])
NEAR = 1.0  # mm
GRAY = 0.35  # of the sample, evenly


def photos(hides):
    """The board with something on it; ``hides(eye, points, rays)`` says which pixels (n,) show that."""
    width, height = CAMERA.size
    x, y = np.meshgrid(np.arange(float(width)), np.arange(float(height)))
    pixels = np.column_stack([x.ravel(), y.ravel()])
    made = []
    for k, eye in enumerate(EYES):
        pose = looking_at(eye, MIDDLE)
        rays = CAMERA.world_rays(pose, pixels)
        points = eye - (eye[2] / rays[:, 2])[:, None] * rays
        level = draw(CAMERA, pose, 0.003, k).astype(np.float32)
        level[hides(eye, points, rays).reshape(height, width)] = GRAY
        made.append(SamplePhoto(level, pose, cover_of(BOARD, level, CAMERA, pose)))
    return made


def test_a_ball_is_found():
    ball = Sphere(np.array([50.0, 33.0, 14.0]), 14.0)
    found = find_sample(
        photos(lambda eye, points, rays: behind_ball(points, eye, ball.center, ball.radius)),
        CAMERA,
        draw_print(BOARD),
    )
    assert isinstance(found.sample, Sphere) and found.placed
    np.testing.assert_allclose(found.sample.center, ball.center, atol=NEAR)
    assert found.sample.radius == pytest.approx(14.0, abs=NEAR)


def test_a_flat_piece_is_found():
    low, high, top = np.array([27.0, 21.0]), np.array([65.0, 50.0]), 0.5

    def hides(eye, points, rays):
        flat = (eye + ((top - eye[2]) / rays[:, 2])[:, None] * rays)[:, :2]
        return ((flat > low) & (flat < high)).all(axis=1)

    found = find_sample(photos(hides), CAMERA, draw_print(BOARD))
    assert isinstance(found.sample, Plane)
    corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    apart = np.linalg.norm(corners[:, None] - found.sample.outline[None], axis=2).min(axis=1)
    assert apart.max() < NEAR


def test_a_bare_board_has_no_sample():
    bare = photos(lambda eye, points, rays: np.zeros(len(points), bool))[:1]
    assert find_sample(bare, CAMERA, None) is None
