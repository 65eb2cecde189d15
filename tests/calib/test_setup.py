"""What calibration finds, as it is asked for light and falloff."""

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Camera
from photogonio.calib.setup import (
    Falloff,
    Light,
    Setup,
)
from photogonio.capture.photoset import Plane, Sphere


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


def test_the_light_in_the_corner_is_known_as_well_as_the_terms():
    """Both terms count whole there; many draws of them scatter as is said."""
    rng = np.random.default_rng(0)
    terms, covariance = np.array([-0.15, 0.04]), np.array([[4e-4, -3e-4], [-3e-4, 4e-4]])
    change, error = Falloff(terms, covariance).corner
    assert change == pytest.approx(np.exp(-0.11) - 1)
    drawn = np.exp(rng.multivariate_normal(terms, covariance, 20_000).sum(1)) - 1
    assert error == pytest.approx(drawn.std(), rel=5 / np.sqrt(2 * 20_000) + 0.01)


def test_a_flat_sample_is_no_ball():
    camera = Camera(np.eye(3), np.zeros(0), (8, 6))
    ball = Sphere(np.zeros(3), 1.0)
    assert Setup(camera, ball, (), "relative", ("Y",)).ball is ball
    with pytest.raises(TypeError, match="flat"):
        _ = Setup(camera, Plane(np.zeros((3, 2))), (), "relative", ("Y",)).ball
