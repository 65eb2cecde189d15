"""Noise of the size that it should have, encodings that come back, saturation, mosaic, vignetting."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.synthetic.render.sensor import cos4, demosaic, encode, expose
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.parts import CameraScene, SensorScene
from photogonio.synthetic.scene.plan import camera_of
from tests.drawn.rooms import camera


def scene(camera_changes=None, **sensor) -> Scene:
    lens = CameraScene(size=(160, 120), defocus=0.0, **(camera_changes or {}))
    return Scene("test", {"model": "lambert"}, sensor=SensorScene(**sensor), camera=lens)


def photo(wanted: Scene, value, seed=(0,)) -> np.ndarray:
    radiance = np.broadcast_to(np.asarray(value, float), (120, 160, 3)).copy()
    return expose(wanted, camera_of(wanted), radiance, 1.0, 1.0, seed)


def test_noise_is_photon_plus_read_noise():
    wanted = scene(gain_electrons=10_000.0, read_noise_electrons=20.0)
    values = photo(wanted, 0.25) / 65535
    variance = 0.25 / 10_000 + (20 / 10_000) ** 2
    n = values.size
    assert values.mean() == pytest.approx(0.25, abs=4 * np.sqrt(variance / n))
    assert values.var() == pytest.approx(variance, rel=4 * np.sqrt(2 / n))


def test_noise_is_named_by_its_seed():
    wanted = scene()
    assert np.array_equal(photo(wanted, 0.3, (1, 2)), photo(wanted, 0.3, (1, 2)))
    assert not np.array_equal(photo(wanted, 0.3, (1, 2)), photo(wanted, 0.3, (1, 3)))
    assert not np.array_equal(photo(wanted, 0.3), photo(replace(wanted, seed=9), 0.3))


@pytest.mark.parametrize("bits", [8, 16])
def test_encodings_come_back_within_half_a_step(bits):
    ramp = np.linspace(0.0, 1.0, 4000).reshape(1, -1, 1)
    for encoding, decode in (
        ("linear", lambda v: v),
        ("gamma", lambda v: v**2.2),
        ("srgb", lambda v: np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)),
    ):
        code = encode(scene(bits=bits, encoding=encoding), ramp)
        top = 2**bits - 1
        low, high = decode(np.maximum(code / top - 0.5 / top, 0)), decode(code / top + 0.5 / top)
        assert code.dtype == (np.uint8 if bits == 8 else np.uint16)
        assert np.all(low <= ramp + 1e-7) and np.all(ramp <= high + 1e-7)


def test_black_level_and_saturation():
    wanted = scene(black_level=0.1, gain_electrons=0.0)
    assert photo(wanted, 0.0).max() == round(0.1 * 65535)
    assert photo(wanted, 7.0).min() == 65535
    assert photo(wanted, 0.5)[0, 0, 0] == round(0.55 * 65535)


def test_hot_pixels_stay_and_grow_with_time():
    wanted = scene(hot_pixels=0.01, gain_electrons=0.0, exposure_time=1.0)
    dark = photo(wanted, 0.0)
    hot = dark[..., 0] > 0
    assert hot.mean() == pytest.approx(0.01, abs=0.003)
    twice = expose(wanted, camera_of(wanted), np.zeros((120, 160, 3)), 2.0, 1.0, (5,))
    assert np.array_equal(twice[..., 0] > 0, hot) and np.all(twice[hot].mean() > 1.3 * dark[hot].mean())


def test_demosaic_leaves_even_and_sloping_light_alone():
    row, column = np.indices((20, 30))
    signal = np.stack([0.2 + 0.01 * row, 0.3 + 0.005 * column, 0.4 + 0 * row], axis=-1)
    assert demosaic(signal)[2:-2, 2:-2] == pytest.approx(signal[2:-2, 2:-2], abs=1e-12)


def test_vignetting_is_the_fourth_power_of_the_field_angle():
    cam = camera(301, 201, 200.0)
    shade = cos4(cam)
    # a pixel's middle is the mean of its corners' places exactly where the lens does not bend
    assert shade[100, 150] == pytest.approx(1.0, abs=1e-9)
    assert shade[100, 300] == pytest.approx(np.cos(np.arctan(150 / 200)) ** 4, rel=1e-9)
    wanted = scene(
        {"vignetting": "cos4", "focal": 120.0, "center": (0.0, 0.0), "distortion": ()}, gain_electrons=0.0
    )
    image = photo(wanted, 0.8) / 65535
    assert image[0, 0, 0] == pytest.approx(0.8 / (1 + (79.5**2 + 59.5**2) / 120**2) ** 2, abs=1e-5)


def test_defocus_keeps_the_light():
    wanted = replace(scene(gain_electrons=0.0), camera=CameraScene(size=(160, 120), defocus=1.5))
    radiance = np.zeros((120, 160, 3))
    radiance[60, 80] = 4.0
    image = expose(wanted, camera_of(wanted), radiance, 1.0, 1.0, (0,)) / 65535
    assert image.sum() == pytest.approx(12.0, rel=1e-2)
    column = np.arange(160)
    spread = np.sum((column - 80) ** 2 * image[..., 0]) / image[..., 0].sum()
    assert spread == pytest.approx(1.5**2, rel=0.05)
