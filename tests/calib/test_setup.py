"""What calibration finds, as it is asked for light and falloff."""

import numpy as np

from photogonio.calib.setup import (
    Light,
)


def test_light_falls_off_with_the_square_only_when_near():
    points = np.array([[0.0, 0, 0], [0, 0, 1.0], [3.0, 0, 0]])
    near = Light("a", "point", np.array([0, 0, 4.0]), np.zeros((3, 3)), "given")
    toward, falloff = near.toward(points)
    np.testing.assert_allclose(falloff, [1 / 16, 1 / 9, 1 / 25], rtol=1e-14)
    reached = points + toward / np.sqrt(falloff)[:, None]
    np.testing.assert_allclose(reached, near.place[None].repeat(3, 0), atol=1e-14)
    far = Light("b", "directional", np.array([0.6, 0, 0.8]), np.zeros((3, 3)), "given")
    toward, falloff = far.toward(points)
    np.testing.assert_array_equal(falloff, 1.0)
    np.testing.assert_array_equal(toward, far.place[None].repeat(3, 0))
