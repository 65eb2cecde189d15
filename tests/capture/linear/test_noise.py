"""Noise against level, given or estimated, must be the noise that is there."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from scipy.stats import chi2

from photogonio.capture.linear.encoding import Encoding, linear_to_srgb
from photogonio.capture.linear.noise import (
    DEGREES,
    QUANTILE,
    NoiseModel,
    cut_off,
    estimate_noise,
    given_noise,
)
from photogonio.capture.photoset import Radiometry

HEIGHT, WIDTH = 400, 600


def scenes() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(7)
    gradient = np.linspace(0.02, 1, HEIGHT)[:, None] * np.linspace(0.2, 0.8, WIDTH)
    patches = np.kron(rng.uniform(0.03, 0.8, (HEIGHT // 20, WIDTH // 20)), np.ones((20, 20)))
    textured = gradient.copy()
    grain = cv2.GaussianBlur(rng.normal(size=(HEIGHT, WIDTH // 2)), (0, 0), 1.5)
    textured[:, : WIDTH // 2] *= 1 + 0.2 * grain / grain.std()
    return {"gradient": gradient, "patches": patches, "half textured": textured}


def coded(light: np.ndarray, bits: int, kind: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Signal, quantisation variance and usable pixels of light in a file."""
    full = 2**bits - 1
    encoded = linear_to_srgb(light) if kind == "srgb" else light
    codes = np.round(encoded * full).astype(int)
    value, step = Encoding(kind).lookup(full, 1)
    return value[codes, 0][..., None], step[codes, 0][..., None], (codes > 0) & (codes < full)


@pytest.mark.parametrize("scene", ["gradient", "patches", "half textured"])
@pytest.mark.parametrize(("bits", "kind"), [(16, "linear"), (12, "linear"), (8, "srgb")])
@pytest.mark.parametrize(("electrons", "read"), [(20000, 5), (2000, 20)])
def test_estimated_noise_is_the_sensors(sensor, scene, bits, kind, electrons, read):
    """10 % of variance is 5 % of a standard deviation.

    Where half of all blocks hold texture, the low quantile of all is a higher one of the calm half, so that
    noise may come out greater, by the ratio of the two and no more.
    """
    textured = chi2.ppf(2 * QUANTILE, DEGREES) / chi2.ppf(QUANTILE, DEGREES)
    light = np.clip(scenes()[scene], 0, 0.95)
    photos = [coded(sensor(light, electrons=electrons, read=read, seed=k), bits, kind) for k in range(2)]
    model = estimate_noise(photos)
    for level in (0.1, 0.5):
        true = level / electrons + (read / electrons) ** 2
        assert (
            0.9
            < float(model.variance(np.array([level]))[0]) / true
            < 1.1 * (textured if scene == "half textured" else 1.0)
        )


def test_no_noise_is_none(sensor):
    model = estimate_noise([coded(np.clip(scenes()["gradient"], 0, 0.95), 8, "linear")])
    assert float(model.variance(np.array([0.5]))[0]) < 1 / 255**2 / 12


def test_too_small_photos_tell_nothing():
    tiny = np.full((16, 16, 1), 0.5, np.float32)
    assert estimate_noise([(tiny, 0 * tiny, np.ones((16, 16), bool))]) is None


def test_given_noise_is_photon_and_read_noise(sensor):
    model = given_noise(Radiometry(gain_electrons=5000, read_noise_electrons=12), 1)
    for level in (0.0, 0.01, 0.3, 0.8):
        found = sensor(np.full(200_000, level + 0.02), electrons=5000, read=12, seed=3) - 0.02
        # relative scatter of a variance of n values: sqrt(2 / n) = 0.3 %; the pedestal keeps the dark from being cut
        expected = float(model.variance(np.array([level + 0.02]))[0])
        assert found.var() == pytest.approx(expected, rel=5 * np.sqrt(2 / 200_000))


def test_averaged_sites_have_less_noise():
    radiometry = Radiometry(gain_electrons=5000, read_noise_electrons=12)
    model = given_noise(radiometry, 3, (1, 2, 1))
    red, green, blue = model.variance(np.full(3, 0.4))
    assert green == pytest.approx(red / 2) and blue == pytest.approx(red)
    assert given_noise(Radiometry(), 3) is None


def test_below_black_there_is_read_noise_alone():
    model = NoiseModel(np.array([1e-6]), np.array([1e-4]))
    assert model.variance(np.array([-0.01]))[0] == pytest.approx(1e-6)


def test_black_that_codes_cut_off_at_0_shows_its_noise_by_half_of_it():
    rng = np.random.default_rng(4)
    noise = 2.5e-4 * rng.normal(size=(120, 160, 2))
    noise[..., 1] *= 2.0
    lit = np.where(np.arange(160)[None, :, None] < 40, 0.2, 0.0) + noise
    np.testing.assert_allclose(np.sqrt(cut_off(np.maximum(lit, 0.0))), [2.5e-4, 5e-4], rtol=0.03)
    assert not cut_off(lit).any()  # black that shows all of it
    assert not cut_off(np.maximum(lit, 0.2)).any() and not cut_off(np.zeros((120, 160, 1))).any()
