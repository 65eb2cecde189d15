"""Where each unknown stands, and what is expected of it."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.response.curve import BENDS
from photogonio.calib.response.unknowns import Unknowns, expectations, raised, scatter_of
from tests.calib.response.phones import CURVES, FLASH, photos


def layout_and_values(told):
    lights = tuple(dict.fromkeys(one.light for one in told))
    layout = Unknowns(1, lights, len(told), (1e-5,) * len(told))
    values = np.zeros(layout.size)
    for k, name in enumerate(lights):
        one = next(p for p in told if p.light == name)
        values[layout.places + 3 * k : layout.places + 3 * k + 3] = FLASH if one.attached else one.place
    values[layout.ink] = np.log(0.05)
    for k, one in enumerate(told):
        values[layout.strengths + k] = np.log(1e-5 * one.exposure)
    return layout, values


def test_every_unknown_has_a_place_of_its_own():
    layout = Unknowns(3, ("a", "b"), 4, (1.0,) * 4)
    asked = np.concatenate([layout.asked("ab"[p % 2], p, c) for p in range(4) for c in range(3)])
    assert set(asked.tolist()) == set(range(layout.size))
    assert len(np.unique(layout.asked("a", 0, 1))) == 2 * BENDS + 9


def test_what_is_expected_is_expected():
    told = photos(CURVES["srgb"], count=4, channels=1)
    layout, values = layout_and_values(told)
    values[layout.places + 0 : layout.places + 3] = 0.0  # the flash in the lens
    rows, expected = expectations(layout, told, values, dict.fromkeys(layout.lights, 0.05))
    assert rows @ values == pytest.approx(expected, abs=1e-9)


def test_a_lamp_that_is_known_is_held():
    told = [replace(one, sure=0.5) for one in photos(CURVES["srgb"], count=2, channels=1)]
    layout, values = layout_and_values(told)
    rows, _ = expectations(layout, told, values, dict.fromkeys(layout.lights, 0.05))
    assert np.abs(rows[:, layout.places]).max() == pytest.approx(2.0)


def test_a_flash_is_expected_beside_the_lens_in_any_unit():
    told = photos(CURVES["srgb"], count=2, channels=1)
    layout, values = layout_and_values(told)
    alike = dict.fromkeys(layout.lights, 0.05)
    flash = slice(layout.places, layout.places + 3)
    rows, _ = expectations(layout, told, values, alike)
    smaller = values.copy()
    smaller[layout.places : layout.even] *= 0.1
    others, _ = expectations(layout, [replace(one, millimetre=0.1) for one in told], smaller, alike)
    assert others[:, flash] @ smaller[flash] == pytest.approx(rows[:, flash] @ values[flash])


def test_the_same_strength_in_all_photos_has_no_scatter():
    told = photos(CURVES["srgb"], count=8, channels=1)
    layout, values = layout_and_values(told)
    steady = scatter_of(layout, told, values, "flash")
    values[layout.strengths : layout.places : 2] += [0.0, 0.02, -0.02, 0.02]
    assert steady < scatter_of(layout, told, values, "flash") <= scatter_of(layout, told, values, "L1")


def test_no_lamp_begins_below_the_board():
    assert raised(np.array([300.0, 400.0, -20.0])) == pytest.approx([300.0, 400.0, 150.0])
    assert raised(np.array([3.0, 4.0, 500.0])) == pytest.approx([3.0, 4.0, 500.0])
