"""Which pairs of directions a photo sees."""

import numpy as np

from photogonio.reconstruct.design.pairs import COUNT, ball_pairs, flat_pairs
from photogonio.reconstruct.design.spots import Spot


def test_a_ball_shows_one_angle_between_lamp_and_camera():
    lamp, camera = 1e6 * np.array([0.6, 0.0, 0.8]), 1e6 * np.array([0.0, -0.6, 0.8])
    pairs = ball_pairs(lamp, camera, np.zeros(3), 25.0)
    level = np.cos(pairs.theta_i) * np.cos(pairs.theta_r)
    cosine = level + np.sin(pairs.theta_i) * np.sin(pairs.theta_r) * np.cos(pairs.dphi)
    np.testing.assert_allclose(cosine, 0.64, atol=1e-4)
    assert len(pairs) == COUNT and np.ptp(pairs.theta_i) > 1.0


def test_a_flat_piece_shows_where_lamp_and_camera_stand():
    far = Spot(30.0, 40.0, 1e7), Spot(70.0, -90.0, 1e7)
    pairs = flat_pairs(far[0].place, far[1].place, np.zeros(3), (35.0, 28.0))
    np.testing.assert_allclose(np.degrees(pairs.theta_i), 60.0, atol=1e-3)
    np.testing.assert_allclose(np.degrees(pairs.theta_r), 20.0, atol=1e-3)
    np.testing.assert_allclose(np.degrees(pairs.dphi), 130.0, atol=1e-3)


def test_what_is_behind_is_not_seen():
    below = np.array([0.0, 0.0, -1e5])
    assert len(flat_pairs(below, -below, np.zeros(3), (35.0, 28.0))) == 0
