"""Fireflies and hot pixels are found; real highlights, edges and noise are left alone."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from photogonio.capture.linear.outliers import isolated_spots

SHAPE = (120, 160)


@pytest.fixture
def scene(sensor):
    """A shaded ground with an edge, its variance, and noise."""
    light = np.linspace(0.05, 0.5, SHAPE[1]) * np.linspace(1, 0.6, SHAPE[0])[:, None]
    light[:, 100:] *= 0.2
    light = np.repeat(light[..., None], 3, axis=2)
    return light, (light / 20000 + (5 / 20000) ** 2).astype(np.float32), sensor


def photo(scene, light):
    _, variance, sensor = scene
    return isolated_spots(sensor(light, seed=11).astype(np.float32), variance)


def test_noise_gradients_and_edges_are_left_alone(scene):
    assert photo(scene, scene[0]).sum() == 0


def test_poisoned_pixels_are_found(scene):
    """Single pixels, and spots blurred to 3 x 3, brighter and darker than the ground."""
    light = scene[0].copy()
    blur = np.outer([0.11, 0.78, 0.11], [0.11, 0.78, 0.11])
    places = [(20, 20), (60, 45), (90, 130), (30, 80)]
    for k, (y, x) in enumerate(places):
        if k % 2:
            light[y, x] *= 3
        else:
            light[y - 1 : y + 2, x - 1 : x + 2] += 0.5 * blur[..., None]
    light[100, 60] *= 0.2  # dead
    found = photo(scene, light)
    for y, x in [*places, (100, 60)]:
        assert found[y, x]
    assert found.sum() <= 9 * 5


def test_one_hot_channel_is_enough(scene):
    light = scene[0].copy()
    light[50, 50, 0] += 0.4
    assert photo(scene, light)[50, 50]


@pytest.mark.parametrize("width", [1.5, 3.0, 8.0])
def test_a_real_highlight_stays(scene, width):
    light = scene[0].copy()
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    light += 0.6 * np.exp(-((y - 60) ** 2 + (x - 50.3) ** 2) / (2 * width**2))[..., None]
    assert photo(scene, light).sum() == 0


def test_a_clipped_lamp_in_a_ball_stays(scene):
    light = scene[0].copy()
    cv2.circle(light, (40, 60), 3, (1.0, 1.0, 1.0), -1)
    assert photo(scene, cv2.GaussianBlur(light, (0, 0), 0.7)).sum() == 0


def test_a_sparkling_surface_stays_but_a_spot_elsewhere_goes(scene):
    light = scene[0].copy()
    rng = np.random.default_rng(2)
    sparkle = rng.random((60, 60)) < 0.03
    light[:60, :60][sparkle] *= 5
    light[90, 130] *= 5
    found = photo(scene, light)
    assert found[90, 130] and found[15:45, 15:45].mean() < 0.02 and not found[90:, :60].any()


def test_tiny_regions_are_left_alone():
    assert isolated_spots(np.ones((4, 9, 3), np.float32), np.ones((4, 9, 3), np.float32)).shape == (4, 9)
