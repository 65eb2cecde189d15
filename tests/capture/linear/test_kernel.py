"""Compiled passes over pixels against what SciPy and numpy make of whole pictures."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import generic_filter, median_filter

from photogonio.capture.linear import kernel

RNG = np.random.default_rng(0)
F = np.float32


def codes(channels: int) -> np.ndarray:
    return RNG.integers(0, 65536, (17, 23, channels)).astype(np.uint16)


@pytest.mark.parametrize("channels", [1, 3])
def test_a_straight_line_and_its_noise(channels):
    """Of a part of the picture; float32 rounds each of the few steps by 6e-8 of what is added up."""
    pixels, top, left = codes(channels), 3, 4 * channels
    pixels[5, 6] = 0  # below black
    scale, offset, read, slope, step = F(1 / 65535), F(-0.02), 1e-6, 2e-4, F(3e-4)
    value, variance = np.empty((2, 9, 11 * channels), np.float32)
    ones = np.ones(11 * channels, np.float32)
    kernel.scaled(
        pixels.reshape(17, -1),
        top,
        left,
        scale,
        offset,
        F(slope) * ones,
        F(read) * ones,
        step,
        value,
        variance,
    )
    part = pixels[3:12, 4:15].reshape(9, -1).astype(float) * scale + offset
    np.testing.assert_allclose(value, part, atol=2e-7)
    np.testing.assert_allclose(variance, read + slope * np.maximum(part, 0) + (step * part) ** 2, rtol=1e-4)


@pytest.mark.parametrize("channels", [1, 3, 5])
def test_a_pixel_is_full_where_one_channel_is(channels):
    pixels = codes(channels)
    for clip in (0, 40000, int(pixels.max()), int(pixels.max()) + 1):
        found = np.zeros(pixels.shape[:2], bool)
        found[0, 0] = True  # known from before
        kernel.full(pixels, clip, found)
        expected = (pixels >= clip).any(axis=2)
        expected[0, 0] = True
        assert np.array_equal(found, expected)


@pytest.mark.parametrize("channels", [1, 3])
def test_gray_levels_are_means_of_the_channels(channels):
    pixels = codes(channels)
    level, usable = np.empty(pixels.shape[:2], np.float32), np.empty(pixels.shape[:2], bool)
    kernel.line_level(pixels, F(1 / 65535), F(0.01), np.int64(60000), level, usable)
    np.testing.assert_allclose(level, pixels.mean(axis=2) / 65535 + 0.01, rtol=1e-6)
    assert np.array_equal(usable, (pixels < 60000).all(axis=2))
    table = RNG.uniform(0, 1, (65536, channels)).astype(np.float32)
    kernel.table_level(pixels, table / F(channels), np.int64(60000), level, usable)
    looked_up = np.stack([table[pixels[..., c], c] for c in range(channels)], axis=-1)
    np.testing.assert_allclose(level, looked_up.mean(axis=2), rtol=1e-6)
    assert np.array_equal(usable, (pixels < 60000).all(axis=2))


def test_pixels_that_are_not_finite_count_as_black():
    value = RNG.uniform(0, 1, (6, 7, 3)).astype(np.float32)
    value[1, 2, 0], value[3, 3, 1], value[5, 6, 2] = np.nan, np.inf, -np.inf
    level, total = np.empty((2, 6, 7), np.float32)
    kernel.mean_level(value, level)
    finite = np.isfinite(value).all(axis=2)
    np.testing.assert_allclose(
        level, np.where(finite, np.where(finite[..., None], value, 0).mean(axis=2), 0), rtol=1e-6
    )
    kernel.totals(value, total)
    assert np.array_equal(np.isfinite(total), finite)


@pytest.mark.parametrize("spikes", [0, 12])
def test_spikes_are_replaced_by_the_median_around_them(spikes):
    """SciPy's median of 3 x 3, the nearest pixels again beyond the border, where the pixel is above 4 m + floor."""
    level, floor = RNG.uniform(0.1, 0.3, (20, 31)).astype(np.float32), F(0.01)
    places = RNG.integers(0, [20, 31], (spikes, 2))
    level[tuple(places.T)] = 5.0
    level[0, 0] = level[19, 30] = level[7, 0] = 5.0  # corners and an edge
    found = np.empty_like(level)
    kernel.calmed(level, floor, found)
    middle = median_filter(level, 3, mode="nearest")
    expected = np.where(level > 4 * middle + floor, middle, level)
    assert np.array_equal(found, expected) and (expected != level).any()


def test_halves_bounds_and_tones():
    level = RNG.uniform(-0.2, 1.4, (8, 10)).astype(np.float32)
    small, part = np.empty((4, 5), np.float32), np.empty_like(level)
    kernel.halved(level, small)
    np.testing.assert_allclose(small, level.reshape(4, 2, 5, 2).mean(axis=(1, 3)), atol=1e-7)
    kernel.bounded(level, F(0.8), part)
    np.testing.assert_allclose(part, np.clip(level / 0.8, 0, 1), atol=1e-7)
    tone = np.empty(level.shape, np.uint8)
    kernel.toned(level, F(0.8), tone)
    exact = 255 * np.sqrt(np.clip(level.astype(float) / 0.8, 0, 1))
    assert np.abs(tone + 0.5 - exact).max() <= 0.5 + 1e-4  # cut off, not rounded
    assert tone.min() == 0 and tone.max() == 255


def ring(window: np.ndarray) -> tuple[float, np.ndarray]:
    """The middle of 5 x 5, and the 16 pixels around its 3 x 3."""
    square = window.reshape(5, 5)
    around = np.ones((5, 5), bool)
    around[1:4, 1:4] = False
    return square[2, 2], square[around]


def test_extremes_of_three_by_three_stand_off_the_ring():
    """Pixel by pixel, from the words of the docstring."""
    level = RNG.normal(1.0, 0.1, (24, 26)).astype(np.float32)
    level[5, 5], level[12, 20], level[1, 1] = 3.0, 0.1, 9.0  # the last too near the border
    noise = np.full(level.shape, 0.05, np.float32)
    found = np.zeros(level.shape, bool)
    kernel.extremes(level, noise, F(4.0), F(0.1), found)

    def stands_off(window):
        middle, around = ring(window)
        inner = window.reshape(5, 5)[1:4, 1:4]
        off = middle - around.mean()
        extreme = (middle == inner.max() and off > 0) or (middle == inner.min() and off < 0)
        return extreme and abs(off) > max(4.0 * 0.05, 0.1 * abs(around.mean()))

    expected = generic_filter(level.astype(float), stands_off, size=5) > 0
    expected[:2] = expected[-2:] = expected[:, :2] = expected[:, -2:] = False
    assert np.array_equal(found, expected) and found[5, 5] and found[12, 20] and found.sum() > 2


@pytest.mark.parametrize(("unrest", "spot"), [(0.5, True), (1.5, False)])
def test_a_spot_is_calm_around(unrest, spot):
    """A ring pixel may go the spot's way by ``calm`` of its height: here 0.1 of 2."""
    level, noise = np.ones((9, 9), np.float32), np.full((9, 9), 0.01, np.float32)
    level[4, 4] = 3.0
    level[2, 2] = 1.0 + unrest * 0.1 * 2.0
    marked, candidates = np.zeros((2, 9, 9), bool)
    candidates[4, 4] = True
    kernel.calm_spots(level, noise, candidates, 8.0, 0.1, 0.1, 3.5, marked)
    expected = np.zeros((9, 9), bool)
    expected[3:6, 3:6] = spot
    assert np.array_equal(marked, expected)
