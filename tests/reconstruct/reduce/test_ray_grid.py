"""Rays from a grid of exact ones."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.reduce.ray_grid import lens_of


@pytest.mark.parametrize("strength", [1.0, 2.2])
def test_the_lens_grid_gives_the_cameras_rays(world, strength):
    camera = world("ball", scale=3.0).setup.camera
    camera = replace(camera, distortion=strength * camera.distortion)
    width, height = camera.size
    rng = np.random.default_rng(2)
    inner = np.column_stack([rng.integers(0, width, 4000), rng.integers(0, height, 4000)])
    corners = np.array([[0, 0], [width - 1, 0], [0, height - 1], [width - 1, height - 1]])
    pixels = np.concatenate([inner, corners]).astype(float)
    # fifth degree over 16 pixels or fewer
    np.testing.assert_allclose(lens_of(camera).rays(pixels), camera.rays(pixels), atol=1e-12)
