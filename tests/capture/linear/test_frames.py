"""Dark frames, flat fields and cos^4 undo what they should, exactly where nothing is noisy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from photogonio.capture.files.exposure import Exposure
from photogonio.capture.linear.frames import cos4_gain, dark_of, falloff_gain, flat_gain, hot_pixels, is_lit
from photogonio.capture.linear.signal import Signal

SHAPE = (40, 50, 3)


def still(value: np.ndarray) -> Signal:
    return Signal(value.astype(np.float32), np.full(SHAPE, 1e-8, np.float32), np.zeros(SHAPE[:2], bool))


@pytest.fixture
def dark_world():
    rng = np.random.default_rng(0)
    return rng.uniform(0.01, 0.02, SHAPE), rng.uniform(0, 0.01, SHAPE)  # bias; rate a second


def test_frames_of_two_times_give_bias_and_rate(dark_world):
    bias, rate = dark_world
    times = (0.1, 0.5, 2.0)
    dark = dark_of([still(bias + rate * t) for t in times], [Exposure(t) for t in times], black_known=False)
    assert np.abs(dark.at(7.0, None) - (bias + 7 * rate)).max() < 1e-6
    region = (5, 10, 25, 30)
    assert np.array_equal(dark.at(0.3, region), dark.at(0.3, None)[10:30, 5:25])


def test_frames_of_one_time_scale_only_if_black_is_known(dark_world):
    bias, rate = dark_world
    frames = [still(rate * 0.5)] * 2, [Exposure(0.5)] * 2
    assert np.abs(dark_of(*frames, black_known=True).at(2.0, None) - 2 * rate).max() < 1e-6
    frames = [still(bias)] * 2, [Exposure(0.5)] * 2
    assert np.abs(dark_of(*frames, black_known=False).at(2.0, None) - bias).max() < 1e-6
    unknown = dark_of([still(bias)], [Exposure()], black_known=True)
    assert np.abs(unknown.at(None, None) - bias).max() < 1e-6


def test_the_mean_of_frames_is_less_noisy(dark_world):
    bias, _ = dark_world
    dark = dark_of([still(bias)] * 4, [Exposure()] * 4, black_known=False)
    assert np.allclose(dark.variance, 1e-8 / 4)


def test_hot_pixels_are_those_far_off():
    dark = np.random.default_rng(1).normal(0.01, 0.001, SHAPE)
    dark[3, 4, 1], dark[10, 11, 0] = 0.1, -0.05
    found = hot_pixels(dark)
    assert found[3, 4] and found[10, 11] and found.sum() == 2
    assert not hot_pixels(np.full(SHAPE, 0.01)).any()


def test_a_dark_frame_is_told_from_a_picture():
    """Noise, hot pixels, heat and a glowing corner are dark, at any black that cameras write; a lit scene, also a dim
    one, and an even field are not."""
    rng = np.random.default_rng(2)
    y, x = np.mgrid[:400, :600] / 400.0
    shape = (*x.shape, 3)
    scene = np.where((x // 0.1 + y // 0.1) % 2 > 0, 0.6, 0.03)[..., None] * np.ones(3)
    for black in (0.0, 0.06, 0.125):
        heat = 0.005 * (1.0 + y) + 0.1 * np.exp(-(x**2 + y**2) / 0.1**2)
        dark = black + heat[..., None] + rng.normal(0.0, 0.01, shape)
        dark[rng.random(x.shape) < 1e-3] = 1.0
        assert not is_lit(dark.astype(np.float32))
        assert is_lit((dark + scene).astype(np.float32)) and is_lit((dark + 0.1 * scene).astype(np.float32))
        assert is_lit((dark + 0.2).astype(np.float32))


def falloff() -> np.ndarray:
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    radius2 = ((x - 24.5) ** 2 + (y - 19.5) ** 2) / 30**2
    return (1 - 0.4 * radius2)[..., None] * [1.0, 0.9, 1.1]


def test_a_flat_field_without_noise_is_its_inverse():
    """Up to the factor of each channel by which the middle counts as 1."""
    gain = flat_gain(falloff().astype(np.float32), np.zeros(SHAPE, np.float32))
    even = gain * falloff()
    assert np.abs(even / even.mean(axis=(0, 1)) - 1).max() < 1e-6
    assert np.abs(gain[18:22, 23:27] - 1).max() < 0.01  # 0.4 of 5 % of the radius squared


def test_a_noisy_flat_field_is_smoothed():
    rng = np.random.default_rng(0)
    height, width, sigma = 600, 800, 0.01
    noisy = 0.5 * (1 + rng.normal(0, sigma, (height, width, 1)))
    gain = flat_gain(noisy.astype(np.float32), np.full(noisy.shape, (0.5 * sigma) ** 2, np.float32))
    # the law of a Gaussian's blur holds for sigmas of some pixels; a factor of 1.5 covers those below
    assert 1e-3 / 1.5 < gain.std() < 1e-3 * 1.5


def test_a_dark_corner_is_refused():
    field = falloff().astype(np.float32)
    field[:3, :3] = 0.0
    with pytest.raises(ValueError, match="falls below"):
        flat_gain(field, np.zeros(SHAPE, np.float32))


@dataclass
class Pinhole:
    size: tuple[int, int] = (640, 480)
    focal: float = 500.0

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        plane = (pixels - [300.0, 250.0]) / self.focal
        rays = np.column_stack([plane, np.ones(len(plane))])
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def test_what_a_lens_leaves_is_divided_out():
    class Middle:
        size = (7, 5)

        def aside(self, pixels):
            return ((pixels - [3.0, 2.0]) ** 2).sum(1) / 13.0

    gain = falloff_gain(Middle(), (-0.3, 0.05))
    assert gain.shape == (5, 7, 1)
    assert gain.dtype == np.float32
    assert gain[2, 3, 0] == 1.0
    np.testing.assert_allclose(gain[[0, 4, 0, 4], [0, 0, 6, 6], 0], np.exp(0.25), rtol=1e-6)
    np.testing.assert_allclose(gain[2, 6, 0], np.exp(0.3 * 9 / 13 - 0.05 * (9 / 13) ** 2), rtol=1e-6)


def test_cos4_is_the_fourth_power_of_each_pixels_cosine():
    camera = Pinhole()
    y, x = np.mgrid[:480, :640]
    exact = camera.rays(np.column_stack([x.ravel(), y.ravel()]).astype(float))[:, 2].reshape(480, 640) ** -4
    # a cubic spline over 128 steps of a field of unit scale: far below float32's own rounding of 6e-8 relative
    assert np.abs(cos4_gain(camera)[..., 0] / exact - 1).max() < 3e-7
