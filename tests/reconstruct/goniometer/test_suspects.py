"""Values that may be marks, by what they are alone; rows by a factor off all around them."""

import numpy as np
import pytest

from photogonio.reconstruct.goniometer.spoilt import find_spoilt
from photogonio.reconstruct.goniometer.suspects import far_off, is_mark, sure_of, suspects
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples
from photogonio.reconstruct.table.neighbours import Expected, places
from tests.drawn.goniometer import glossy, regular, scattered


def drawn(count=400, seed=1):
    value = 0.1 * (1.0 + 0.05 * np.random.default_rng(seed).standard_normal(count))
    return places(*scattered(count)), value


@pytest.mark.parametrize("mark", [-999.0, -0.05, 0.001, 0.12, 5.0, 1e30])
def test_a_value_that_comes_often_is_suspect(mark):
    at, value = drawn()
    assert suspects(at, value).tolist() == []
    value[::20] = mark
    assert suspects(at, value).tolist() == [mark]


def test_the_same_value_at_the_same_pair_of_directions_is_no_repetition():
    """Light from the normal has no azimuth: a ring of readings about it is one."""
    at = places(*regular())
    value = 0.1 * (1.0 + 0.05 * np.random.default_rng(1).standard_normal(len(at)))
    value[(at[:, 0] == 0.0) & (np.abs(at[:, 3] - np.cos(np.radians(10.0))) < 1e-9)] = 0.105
    assert suspects(at, value).tolist() == []


def test_numbers_that_programs_write():
    assert is_mark(np.array([-999.0, 65535.0, 1e30, -1.0, 0.3, 998.0])).tolist() == [True] * 4 + [False] * 2


def table_of(surface, *, noise=0.01, seed=1, digits=None):
    theta_i, theta_r, dphi = regular()
    value = surface(theta_i, theta_r, dphi) * (
        1.0 + noise * np.random.default_rng(seed).standard_normal(len(dphi))
    )
    value = value if digits is None else digits * np.rint(value / digits)
    return GoniometerSamples(
        theta_i, 0.0 * theta_i, theta_r, dphi, value=value[:, None], sigma=None, channels=("value",)
    )


@pytest.mark.parametrize("factor", [0.01, 0.1, 0.2])
def test_rows_that_are_holes_are_found_each_with_its_own_value(factor):
    table = table_of(glossy(0.3, 0.1, 20.0))
    wrong = np.arange(40, len(table.value), 75)
    table.value[wrong] *= factor
    (found,) = find_spoilt(table)
    assert set(found.rows) <= set(wrong) and len(found.rows) >= 0.8 * len(wrong)
    assert "decimal point" in found.why


def test_rows_that_stand_out_are_found_where_no_peak_is():
    """Near the mirror direction, or the light's own, one row may be all that is near a peak."""
    table = table_of(glossy(0.3, 0.1, 20.0))
    wrong = np.arange(40, len(table.value), 75)
    table.value[wrong] *= 10.0
    (found,) = find_spoilt(table)
    assert set(found.rows) <= set(wrong) and len(found.rows) >= 0.4 * len(wrong)


@pytest.mark.parametrize("power", [5.0, 50.0, 400.0])
@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("digits", [None, 0.005])
def test_no_row_of_a_surface_is_out(power, noise, digits):
    """Peaks a row or two wide on a step of ten degrees, and black ones whose last digits are cut off."""
    for base in (0.0, 0.2):
        assert find_spoilt(table_of(glossy(base, 0.3, power), noise=noise, digits=digits)) == []


def test_zeros_beside_a_row_speak_for_it():
    at = np.column_stack([np.arange(20.0), *np.zeros((3, 20))])
    value = np.r_[np.ones(10), 0.1, np.zeros(9)]
    assert [len(rows) for rows in far_off(at, value, value >= 0.0)] == [0, 0]
    alone = np.where(np.arange(20) == 10, 0.1, 1.0)
    assert [rows.tolist() for rows in far_off(at, alone, alone > 0.0)] == [[10], []]


def test_what_others_hardly_agree_on_excludes_nothing():
    told = Expected(*(np.full(2, x) for x in (1.0, 0.05, 1.0, 0.05)))
    unsure = Expected(*(np.full(2, x) for x in (1.0, 0.5, 1.0, 0.5)))
    value, noise = np.array([0.1, 0.5]), np.full(2, 0.01)
    assert sure_of(value, told, 0.01, noise).tolist() == [True, False]
    assert not sure_of(value, unsure, 0.01, noise).any()
    assert not sure_of(value, told, 0.01, np.full(2, 0.2)).any()


def test_a_third_of_all_rows_may_hold_what_the_instrument_stood_still_at():
    rng = np.random.default_rng(4)
    table = table_of(glossy(0.25, 0.14, 16.0), noise=0.015)
    stuck = rng.random(len(table.value)) < 0.35
    table.value[stuck] = float(np.median(table.value))
    (found,) = find_spoilt(table)
    assert set(found.rows) == set(np.flatnonzero(stuck)) and "stood still" in found.why
