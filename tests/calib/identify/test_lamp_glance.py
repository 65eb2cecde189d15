"""A lamp is seen by how it lights the paper."""

import numpy as np

from photogonio.calib.geometry.camera import Camera
from photogonio.calib.identify.lamp_glance import shrunk


def test_a_smaller_picture_has_the_same_rays():
    camera = Camera(
        np.array([[900.0, 0, 411.0], [0, 905.0, 303.0], [0, 0, 1.0]]),
        np.array([-0.1, 0.05, 0, 0]),
        (800, 600),
    )
    small = shrunk(camera, 4, (150, 200))
    there = np.array([[10.0, 20.0], [120.5, 80.25]])
    np.testing.assert_allclose(small.rays(there), camera.rays(4 * there + 1.5), atol=1e-9)
