"""What lies between light and photo is taken off again: photos, parts of them, and paper read of them."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Camera
from photogonio.calib.shading.correction import NO_CORRECTION, PhotometricCorrection
from photogonio.capture.linear.frames import falloff_gain
from photogonio.capture.radiance import RadianceImage

CAMERA = Camera(np.array([[100.0, 0, 27.0], [0, 100.0, 14.0], [0, 0, 1]]), np.zeros(0), (60, 40))
VEIL, TERMS = np.array([0.01, 0.02, 0.03]), (-0.2, 0.05)
KNOWN = PhotometricCorrection(VEIL, 0.1 * VEIL, TERMS)


def photo(light: np.ndarray) -> RadianceImage:
    """Of light (h, w, 3), by a lens that darkens its corners and spreads light over all."""
    value = (light / falloff_gain(CAMERA, TERMS) + VEIL).astype(np.float32)
    clear = np.ones(light.shape[:2], bool)
    return RadianceImage(value, np.full_like(value, 1e-6), clear, ~clear)


@pytest.fixture(scope="module")
def light() -> np.ndarray:
    return np.random.default_rng(0).uniform(0.1, 1.0, (40, 60, 3))


def test_the_light_comes_back_and_its_noise_grows_with_the_gain(light):
    found = KNOWN.of_image(photo(light), CAMERA)
    np.testing.assert_allclose(found.value, light, rtol=5e-7)  # of float32
    gain = falloff_gain(CAMERA, TERMS)
    np.testing.assert_allclose(found.variance, 1e-6 * gain**2 * np.ones(3), rtol=5e-7)
    assert found.value.dtype == found.variance.dtype == np.float32


def test_a_part_is_that_part_of_the_whole(light):
    whole, cut = photo(light), np.s_[7:29, 11:48]
    part = RadianceImage(
        whole.value[cut], whole.variance[cut], whole.valid[cut], whole.saturated[cut], (11, 7)
    )
    one, other = KNOWN.of_image(part, CAMERA), KNOWN.of_image(whole, CAMERA)
    np.testing.assert_array_equal(one.value, other.value[cut])
    np.testing.assert_array_equal(one.variance, other.variance[cut])


def test_nothing_known_changes_nothing(light, drawn):
    image, reading = photo(light), drawn[1][0]
    assert NO_CORRECTION.of_image(image, CAMERA) is image
    same = NO_CORRECTION.of_reading(reading)
    np.testing.assert_array_equal(same.level, reading.level)
    np.testing.assert_array_equal(same.samples.value, reading.samples.value)


def test_paper_is_freed_as_the_picture_is(drawn):
    """Level, colours and noise alike, each sample by its own place in the picture."""
    _, (reading, *_) = drawn
    aside, veil = reading.samples.aside, np.array([0.01])
    lens = np.exp(TERMS[0] * aside + TERMS[1] * aside**2)
    value = reading.samples.value * lens[:, None] + veil
    seen = replace(
        reading,
        samples=replace(reading.samples, value=value, variance=reading.samples.variance * lens[:, None] ** 2),
        level=reading.level * lens + veil.mean(),
        noise=reading.noise * lens**2,
    )
    found = PhotometricCorrection(veil, None, TERMS).of_reading(seen)
    for one, true in (
        (found.level, reading.level),
        (found.noise, reading.noise),
        (found.samples.value, reading.samples.value),
        (found.samples.variance, reading.samples.variance),
    ):
        np.testing.assert_allclose(one, true, rtol=1e-10)
