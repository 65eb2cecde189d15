"""An unknown response comes back from brackets, or is refused."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.linear.encoding import linear_to_srgb
from photogonio.capture.linear.response import Series, recover_response

EXPOSURES = (1 / 20, 1 / 6, 1.0, 3.7)  # uneven steps
CURVES = {
    "srgb": linear_to_srgb,
    "linear": lambda x: x,
    "gamma 1.8": lambda x: x ** (1 / 1.8),
    "film": lambda x: np.log1p(30 * x) / np.log1p(30),
}


def bracket(sensor, curve, light, exposures=EXPOSURES) -> Series:
    photos = [
        np.round(curve(sensor(light * step, seed=k)) * 255).astype(np.uint8)
        for k, step in enumerate(exposures)
    ]
    return Series(tuple(photos), tuple(exposures))


@pytest.fixture(scope="module")
def light() -> np.ndarray:
    rng = np.random.default_rng(4)
    patches = np.kron(10 ** rng.uniform(-3.3, 0.5, (24, 32)), np.ones((8, 8)))
    return patches[..., None] * [1.0, 0.8, 0.6]


@pytest.mark.parametrize("name", CURVES)
def test_the_curve_comes_back(sensor, light, name):
    found = recover_response([bracket(sensor, CURVES[name], light)])
    fine = np.linspace(0, 1, 100_001)
    true = np.interp(np.arange(256) / 255, CURVES[name](fine), fine)
    # the scale is free: compared at the middle
    ratio = (found.table / found.table[128])[30:251] / (true / true[128])[30:251, None]
    assert np.abs(ratio - 1).max() < 0.01
    assert found.error < 0.02


def test_the_table_rises_from_0_to_1(sensor, light):
    table = recover_response([bracket(sensor, linear_to_srgb, light)]).table
    assert table.shape == (256, 3) and (np.diff(table, axis=0) >= 0).all()
    assert np.array_equal(table[[0, -1]], [[0, 0, 0], [1, 1, 1]])


def test_wrong_exposures_are_refused(sensor, light):
    true = bracket(sensor, linear_to_srgb, light)
    stated = Series(true.codes, (1 / 20, 1 / 19, 1.0, 1.1))
    with pytest.raises(ValueError, match=r"predicts exposures|rises"):
        recover_response([stated])


def test_equal_exposures_are_refused(sensor, light):
    with pytest.raises(ValueError, match="different exposures"):
        recover_response([bracket(sensor, linear_to_srgb, light, (1.0, 1.0))])


def test_too_few_levels_are_refused(sensor):
    with pytest.raises(ValueError, match="too few levels"):
        recover_response([bracket(sensor, linear_to_srgb, np.full((40, 40, 3), 0.2))])
