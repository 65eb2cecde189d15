"""Exposure series: linear over four decades, with honest variance; ghosts seen; steps measured."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.linear.brackets import merge, trimmed
from photogonio.capture.linear.encoding import Encoding, linear_to_srgb
from photogonio.capture.linear.noise import NoiseModel
from photogonio.capture.linear.signal import Signal

ELECTRONS, READ = 20000.0, 5.0
NOISE = NoiseModel(np.full(3, (READ / ELECTRONS) ** 2), np.full(3, 1 / ELECTRONS))
STEPS = (1.0, 16.0, 256.0)
WIDTH = 480


def photographed(sensor, light: np.ndarray, exposure: float, seed: int) -> Signal:
    """An 8-bit sRGB photo of light (h, w, 3), decoded."""
    codes = np.round(
        linear_to_srgb(sensor(light * exposure, electrons=ELECTRONS, read=READ, seed=seed)) * 255
    )
    value, step = Encoding("srgb").lookup(255, 3)
    codes = codes.astype(int)
    signal, quantisation = value[codes, 0], step[codes, 0]
    return Signal(signal, NOISE.variance(signal) + quantisation, (codes == 255).any(axis=2))


@pytest.fixture(scope="module")
def wedge() -> np.ndarray:
    """Light over four decades, up to the shortest exposure's white."""
    ramp = 10 ** np.linspace(-4, 0, WIDTH, endpoint=False)
    return np.broadcast_to(ramp[None, :, None], (160, WIDTH, 3)) * [0.98, 0.8, 0.6]


@pytest.fixture(scope="module")
def merged(sensor, wedge):
    signals = [photographed(sensor, wedge, step, k) for k, step in enumerate(STEPS)]
    return merge(signals, STEPS, NOISE)


def test_three_exposures_are_linear_within_a_percent_over_four_decades(merged, wedge):
    good = ~(merged.saturated | merged.ghost)
    assert good.mean() > 0.99
    ratio = np.where(good[..., None], merged.value / wedge, np.nan)
    columns = np.nanmean(ratio.reshape(160, WIDTH // 16, 16, 3), axis=(0, 2))  # means of 2560 pixels each
    assert np.abs(columns - 1).max() < 0.01


def test_the_variance_is_that_of_the_values(merged, wedge):
    """In each eighth of the wedge, that is, half a decade."""
    normal = ((merged.value - wedge) / np.sqrt(merged.variance))[~merged.saturated].reshape(-1)
    place = np.broadcast_to(np.arange(WIDTH)[None, :, None], wedge.shape)[~merged.saturated].reshape(-1)
    for part in range(8):
        inside = normal[place // (WIDTH // 8) == part]
        # 28800 values: 0.4 % of scatter; rounding to codes is uniform, not normal, and follows the level
        assert inside.std() == pytest.approx(1.0, abs=0.05)
        assert np.mean(np.abs(inside) < 1.96) == pytest.approx(0.95, abs=0.02)


def test_full_in_every_exposure_is_saturated(sensor):
    light = np.full((20, 20, 3), 0.5)
    light[5:10, 5:10] = 3.0
    found = merge([photographed(sensor, light, step, 0) for step in (1.0, 4.0)], (1.0, 4.0), NOISE)
    assert found.saturated[5:10, 5:10].all() and not found.saturated[12:, 12:].any()


def test_what_moved_is_a_ghost_and_what_did_not_is_none(sensor):
    light = np.full((60, 60, 3), 0.05)
    signals = [photographed(sensor, light, step, k) for k, step in enumerate((1.0, 4.0, 16.0))]
    moved = light.copy()
    moved[20:30, 20:30] *= 1.5
    signals[1] = photographed(sensor, moved, 4.0, 9)
    found = merge(signals, (1.0, 4.0, 16.0), NOISE)
    assert found.ghost[21:29, 21:29].mean() > 0.95
    found.ghost[20:30, 20:30] = False
    assert not found.ghost.any()


def test_the_order_of_the_photos_does_not_matter(sensor, wedge):
    signals = [photographed(sensor, wedge[:20], step, k) for k, step in enumerate(STEPS)]
    one = merge(signals, STEPS, NOISE)
    other = merge(signals[::-1], STEPS[::-1], NOISE)
    assert np.array_equal(one.value, other.value) and np.array_equal(one.ghost, other.ghost)


def test_exact_exposures_are_kept(sensor, wedge):
    signals = [photographed(sensor, wedge, step, k) for k, step in enumerate(STEPS)]
    assert trimmed(signals, STEPS) == pytest.approx(STEPS, rel=1e-12)


def test_rounded_exposures_are_measured(sensor, wedge):
    """1/250, 1/60 and 1/15 s on the dial are 1/256, 1/64 and 1/16 s."""
    true = np.array([1.0, 4.0, 16.0])
    stated = np.array([1 / 250, 1 / 60, 1 / 15]) * 256
    signals = [photographed(sensor, wedge, step, k) for k, step in enumerate(true)]
    found = np.array(trimmed(signals, list(stated)))
    assert np.diff(np.log(found)) == pytest.approx(np.diff(np.log(true)), abs=2e-3)
    assert np.log(found).mean() == pytest.approx(np.log(stated).mean(), abs=1e-12)


def test_a_wrong_exposure_is_refused(sensor, wedge):
    signals = [photographed(sensor, wedge, step, k) for k, step in enumerate((1.0, 4.0))]
    with pytest.raises(ValueError, match="stated exposure is 8 times"):
        trimmed(signals, [1.0, 8.0])
