"""Names of shutter times and apertures, and the steps that they mean."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.files import stops
from photogonio.capture.files.exposure import Exposure, stepped

THIRDS = [30, 25, 20, 15, 13, 10, 8, 6, 5, 4, 3.2, 2.5, 2, 1.6, 1.3, 1, 0.8, 0.6, 0.5, 0.4, 0.3]
PARTS = [
    4,
    5,
    6,
    8,
    10,
    13,
    15,
    20,
    25,
    30,
    40,
    50,
    60,
    80,
    100,
    125,
    160,
    200,
    250,
    320,
    400,
    500,
    640,
    800,
    1000,
]


def test_names_of_a_camera_mean_steps_of_a_third():
    """From 32 s ("30") on each step is 2^(1/3) shorter; 46 names down to 1/1024 s ("1/1000")."""
    times = [*THIRDS, *(1 / part for part in PARTS)]
    found, lines = stepped({str(time): Exposure(time) for time in times})
    expected = [32 * 2 ** (-k / 3) for k in range(len(times))]
    assert [one.exposure_time for one in found.values()] == pytest.approx(expected, rel=1e-12)
    assert len(lines) == 1 and "true steps" in lines[0]
    numbers = [1.4, 2.8, 3.5, 5.6, 8, 11, 16, 22]
    found, _ = stepped({str(number): Exposure(f_number=number) for number in numbers})
    squares = np.square([one.f_number for one in found.values()])
    assert squares == pytest.approx([2, 8, 8 * 2 ** (2 / 3), 32, 64, 128, 256, 512], rel=1e-9)


def test_times_that_are_no_names_stay_all_of_them():
    phone = {"a": Exposure(1 / 60), "b": Exposure(1 / 121), "c": Exposure(1 / 30)}
    assert stepped(phone) == (phone, ())


def test_thirds_are_steps_as_well_as_names():
    """Some photos tell 1/64 s, others "1/30"."""
    found, _ = stepped({"a": Exposure(1 / 64), "b": Exposure(1 / 30)})
    assert [one.exposure_time for one in found.values()] == [1 / 64, 1 / 32]


@pytest.mark.parametrize("field", sorted(stops.NAMES))
def test_every_name_is_nearest_to_the_step_that_it_stands_for(field):
    """Steps are a third of a stop apart, so within a sixth; an aperture's light goes with its square."""
    stops_of = 1.0 if field == "exposure_time" else 2.0
    for name, step in stops.NAMES[field].items():
        assert abs(stops_of * np.log2(name / step)) < 1 / 6, name
        thirds = 3 * stops_of * np.log2(step)
        assert thirds == pytest.approx(round(thirds), abs=1e-9)


@pytest.mark.parametrize(("off", "known"), [(0.9, True), (1.1, False)])
def test_a_name_may_be_rounded_by_as_much_as_files_round(off, known):
    value = (1 / 60) * np.exp(off * stops.SAME)
    assert stops.is_name("exposure_time", value) == known
    assert (stops.true_steps("exposure_time", [value, 1 / 30]) != {}) == known


def test_one_value_that_is_neither_name_nor_step_spoils_all():
    assert stops.true_steps("f_number", [8.0, 11.0, 11.7]) == {}
    assert stops.true_steps("f_number", [8.0, 11.0]) == {8.0: 8.0, 11.0: pytest.approx(2**3.5)}


def test_a_camera_that_steps_in_halves():
    """1/750 is 2^-9.5 s; 1/60 and 1/20, which others call thirds by, are 2^-6 and 2^-4.5 s."""
    found = stops.true_steps("exposure_time", [1 / 750, 1 / 60, 1 / 20, 1.5, 0.7, 3.0])
    powers = {1 / 750: -9.5, 1 / 60: -6, 1 / 20: -4.5, 1.5: 0.5, 0.7: -0.5, 3.0: 1.5}
    assert found == pytest.approx({value: 2.0**power for value, power in powers.items()})
    found = stops.true_steps("f_number", [6.7, 9.5, 11.0])
    assert found == pytest.approx({6.7: 2**2.75, 9.5: 2**3.25, 11.0: 2**3.5})
    assert stops.true_steps("exposure_time", [1 / 20, 1 / 60]) == pytest.approx(
        {1 / 20: 2 ** (-13 / 3), 1 / 60: 1 / 64}
    )


@pytest.mark.parametrize("field", ["exposure_time", "f_number"])
def test_names_of_halves_are_near_their_steps(field):
    """Rounded for the dial: 0.35 s is called 0.3."""
    for name, step in stops._IN_HALVES[field].items():
        assert abs(np.log2(step / name)) < 0.25, name


def test_a_shutter_held_open_says_nothing_of_the_others():
    found = stops.true_steps("exposure_time", [1 / 60, 123.4, 1 / 15])
    assert found == {1 / 60: 1 / 64, 123.4: 123.4, 1 / 15: 1 / 16}
    assert (
        stops.true_steps("exposure_time", [1 / 121, 123.4])
        == {}
        == stops.true_steps("exposure_time", [123.4])
    )
