"""Rays from a grid of exact ones."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.reduce.ray_grid import STEP, lens_of


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


def test_the_grid_belongs_to_the_cameras_numbers(world):
    camera = world("ball").setup.camera
    assert lens_of(camera) is lens_of(replace(camera, matrix=camera.matrix.copy()))
    assert lens_of(camera) is not lens_of(replace(camera, distortion=0.5 * camera.distortion))


def test_without_distortion_rays_are_straight_lines_of_the_pixel(world):
    """Then x / z is linear in the pixel, and so exact between any nodes."""
    camera = world("ball").setup.camera
    plain = replace(camera, distortion=np.zeros(5))
    pixels = np.random.default_rng(0).integers(0, min(camera.size), (500, 2)).astype(float)
    rays = lens_of(plain).rays(pixels)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1.0, rtol=1e-14)
    homogeneous = np.column_stack([pixels, np.ones(len(pixels))])
    exact = np.linalg.solve(camera.matrix, homogeneous.T).T
    np.testing.assert_allclose(rays[:, :2] / rays[:, 2:], exact[:, :2], atol=1e-13)
    assert len(lens_of(plain).weights) == STEP  # nothing asks for a finer one
