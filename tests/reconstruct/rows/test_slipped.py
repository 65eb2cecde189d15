"""Values that stand a row beside their directions are told, and no table whose rows are right is."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.goniometer.doubts import SLIPPED, doubts_of
from photogonio.reconstruct.rows.slipped import FEWEST, Slip, slip_of
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples
from tests.drawn.goniometer import glossy, in_plane, matte, measured, regular, rough, samples, scattered

SURFACES = {
    "rough": rough(0.6),
    "satin": glossy(0.3, 0.1, 20.0),
    "metal": glossy(0.05, 0.8, 60.0),
}
PLACES = {
    "grid": regular(15.0, 10.0, 30.0),
    "plane": in_plane(),
    "scattered": scattered(300),
}


def told(table: GoniometerSamples) -> Slip | None:
    return slip_of(table, table.value[:, 0], SLIPPED)


@pytest.mark.parametrize(
    (
        "surface",
        "places",
    ),  # scans of a metal in one plane begin and end in the dark, and a row is a tilt of 3 degrees
    [one for one in itertools.product(SURFACES, PLACES) if one != ("metal", "plane")],
)
def test_values_a_row_off_are_told_and_moved_back(surface, places):
    table = measured(SURFACES[surface], PLACES[places], noise=0.03)
    assert told(table) is None
    for by in (1, -1, 2):
        off = replace(table, value=np.roll(table.value, by, axis=0))
        slip = told(off)
        assert slip.by == -by and slip.odds > SLIPPED
        if slip.first == 0:
            np.testing.assert_array_equal(slip.mended(off.value), table.value)


@pytest.mark.parametrize("places", ["grid", "scattered"])
@pytest.mark.parametrize("share", [0.23, 0.48, 0.66])
def test_a_value_that_was_lost_on_the_way(places, share):
    table = measured(SURFACES["satin"], PLACES[places], noise=0.02)
    at = int(share * len(table.value))
    slip = told(replace(table, value=np.r_[table.value[:at], table.value[at + 1 :], table.value[-1:]]))
    assert slip.by == 1 and abs(slip.first - at) < 0.15 * len(table.value)


@pytest.mark.parametrize("noise", [0.002, 0.2])
@pytest.mark.parametrize("places", PLACES)
def test_where_all_values_are_alike_none_is_beside_its_place(places, noise):
    table = measured(matte(0.5), PLACES[places], noise=noise)
    assert told(replace(table, value=np.roll(table.value, 1, axis=0))) is None
    assert told(table) is None


@pytest.mark.parametrize(("step", "width"), [(1.0, 0.05), (2.0, 0.1), (5.0, 0.2)])
def test_a_peak_that_a_tilt_moves_by_a_step_of_the_angles_is_no_slip(step, width):
    """Most rows would fit a row on; from the end of a scan to the next they would not."""
    angles = np.meshgrid((15.0, 35.0, 55.0, 70.0), np.arange(0, 80.0, step), indexing="ij")
    theta_i, theta_r = (np.radians(one.ravel()) for one in angles)
    value = 0.1 + 5.0 * np.exp(-(((theta_r - theta_i - np.radians(step)) / width) ** 2))
    value *= 1.0 + 0.01 * np.random.default_rng(3).standard_normal(len(value))
    assert told(samples((theta_i, theta_r, np.full(len(value), np.pi)), value)) is None


def test_few_rows_do_not_tell():
    table = measured(SURFACES["satin"], scattered(FEWEST - 1), noise=0.01)
    assert told(replace(table, value=np.roll(table.value, 1, axis=0))) is None


def test_a_slip_is_doubted_and_nothing_else_that_follows_from_it():
    table = measured(SURFACES["satin"], PLACES["plane"], noise=0.01)
    off = replace(table, value=np.roll(table.value, 1, axis=0))
    (doubt,) = doubts_of(off, "brdf")
    assert doubt.code == "table-slipped" and "a row higher" in doubt.message
