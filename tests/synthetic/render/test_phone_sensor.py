"""A telephone's sensor: rows whose noise is 1/f, columns that stay, corners that are dark or noisy, its times."""

import numpy as np
import pytest

from photogonio.synthetic.render.sensor import expose, exposure_time_of, row_offsets, shading_of
from photogonio.synthetic.scene.model import Scene
from photogonio.synthetic.scene.parts import CameraScene, SensorScene
from photogonio.synthetic.scene.phone import AutoExposure, LensShading, NoiseFloor
from photogonio.synthetic.scene.plan import camera_of

SHAPE = (120, 160, 3)


def scene(shading=None, **sensor) -> Scene:
    lens = CameraScene(size=(160, 120), defocus=0.0, shading=shading)
    return Scene("test", {"model": "lambert"}, sensor=SensorScene(**sensor), camera=lens)


def photo(wanted: Scene, value: float, seed: int = 0) -> np.ndarray:
    return expose(wanted, camera_of(wanted), np.full(SHAPE, value), 1.0, 1.0, (seed,)) / 65535


@pytest.mark.parametrize("exponent", [0.0, 1.0])
@pytest.mark.parametrize("count", [255, 256])
def test_rows_wander_with_the_power_of_their_frequency(exponent, count):
    floor, random = NoiseFloor(row_electrons=2.0, exponent=exponent), np.random.default_rng(3)
    rows = np.stack([row_offsets(floor, count, random) for _ in range(400)])
    power = (np.abs(np.fft.rfft(rows, axis=1)) ** 2).mean(0)
    frequency = np.arange(1, 100)
    slope = np.polyfit(np.log(frequency), np.log(power[1:100]), 1)[0]
    # each of 99 means of 400 powers is off by 1 / 20: the slope by 0.05 over the spread of the logarithms
    assert slope == pytest.approx(-exponent, abs=4 * 0.05 / np.std(np.log(frequency)) / np.sqrt(99))
    assert rows.var() == pytest.approx(4.0, rel=0.15) and np.abs(rows.mean(1)).max() < 1e-12


def test_rows_are_anew_in_each_photo_and_columns_and_gains_are_not():
    floor = NoiseFloor(row_electrons=0.0, column_electrons=20.0, pixel_gain=0.02)
    wanted = scene(floor=floor, gain_electrons=1e8, read_noise_electrons=0.0, black_level=0.1)
    one, two = photo(wanted, 0.4, 1), photo(wanted, 0.4, 2)
    own = np.corrcoef(one.ravel(), two.ravel())[0, 1]
    assert own > 0.99 and one.std() == pytest.approx(0.9 * 0.4 * 0.02, rel=0.03)
    rows = scene(
        floor=NoiseFloor(row_electrons=50.0, column_electrons=0.0, pixel_gain=0.0), gain_electrons=10_000.0
    )
    one, two = (photo(rows, 0.4, k).mean(axis=(1, 2)) for k in (1, 2))
    assert abs(np.corrcoef(one, two)[0, 1]) < 0.7 and one.std() > 0.002


def test_corners_are_dark_or_where_that_is_corrected_noisy():
    shading = shading_of(LensShading(corner=0.4), SHAPE[:2])
    assert shading.max() == pytest.approx(1.0, abs=1e-4) and shading[0, 0] == pytest.approx(0.4, rel=0.015)
    dark = photo(scene(LensShading(0.4), gain_electrons=0.0), 0.5)
    assert np.abs(dark - 0.5 * shading[..., None]).max() < 1e-5
    even = photo(
        scene(LensShading(0.4, corrected=True), gain_electrons=2000.0, read_noise_electrons=0.0), 0.5
    )
    corner, middle = even[:20, :20], even[50:70, 70:90]
    assert corner.mean() == pytest.approx(0.5, rel=0.01) and middle.mean() == pytest.approx(0.5, rel=0.01)
    # photons count before the correction: variance grows as 1 / shading
    expected = np.mean(1 / shading[:20, :20]) / np.mean(1 / shading[50:70, 70:90])
    assert corner.var() / middle.var() == pytest.approx(expected, rel=4 * np.sqrt(4 / corner.size))


@pytest.mark.parametrize("steps", [0, 2, 3])
def test_the_camera_exposes_its_bright_parts_within_a_step(steps):
    auto = AutoExposure(low=0.5, high=0.5, steps=steps)
    wanted = scene(exposure=auto)
    camera = camera_of(wanted)
    for light in (0.3, 4.0, 37.0):
        radiance = np.full(SHAPE, light)
        seconds = exposure_time_of(wanted, camera, radiance, 0.02, 5, 1.0)
        least = 2 ** (-1.0 / steps) if steps else 1.0
        assert least * 0.5 <= light * seconds * (1 + 1e-9) and light * seconds <= 0.5 * (1 + 1e-9)
        assert exposure_time_of(wanted, camera, radiance, 0.04, 5, 1.0) == pytest.approx(2 * seconds)
    assert exposure_time_of(scene(), camera, np.ones(SHAPE), 0.02, 5, 1.0) == 0.02
