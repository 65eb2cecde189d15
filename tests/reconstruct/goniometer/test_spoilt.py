"""Rows that hold a number and are no measurements are found by what their neighbours say; true zeros and noise stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.goniometer.read import believed, read_samples
from photogonio.reconstruct.goniometer.spoilt import find_spoilt, lamp_angle, without
from photogonio.reconstruct.goniometer.told import Told
from tests.drawn.goniometer import glossy, in_plane, matte, measured, regular, rough, samples, scattered
from tests.places import DATA, SHARED

CASES = SHARED / "cases"
SURFACES = {
    "matte": matte(0.5),
    "dark": matte(0.04),
    "rough": rough(0.6),
    "satin": glossy(0.3, 0.1, 20.0),
    "glossy": glossy(0.2, 0.1, 200.0),
}
PLACES = {"grid": regular(), "plane": in_plane(), "scattered": scattered(300)}


def spoiled(table, rows, value):
    values = table.value.copy()
    values[rows] = value
    return replace(table, value=values)


def some(table, share: float) -> np.ndarray:
    return np.random.default_rng(7).choice(
        len(table.value), max(1, int(share * len(table.value))), replace=False
    )


@pytest.mark.parametrize("places", PLACES)
@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("noise", [0.0, 0.005, 0.05])
def test_nothing_is_left_out_of_a_clean_table(surface, places, noise):
    assert find_spoilt(measured(SURFACES[surface], PLACES[places], noise=noise)) == []


@pytest.mark.parametrize("places", PLACES)
@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("radius", [8.0, 16.0, 22.0])
def test_the_lamp_hidden_by_the_detector(surface, places, radius):
    table = measured(SURFACES[surface], PLACES[places])
    rows = np.flatnonzero(lamp_angle(table, np.arange(len(table.value))) < np.radians(radius))
    found = find_spoilt(spoiled(table, rows, 0.0))
    np.testing.assert_array_equal(np.unique(np.concatenate([one.rows for one in found])), rows)
    assert found[0].lamp is None or found[0].lamp <= np.radians(radius)


@pytest.mark.parametrize("places", PLACES)
@pytest.mark.parametrize("surface", ["matte", "dark", "rough", "satin"])
@pytest.mark.parametrize("share", [0.001, 0.05, 0.3])
def test_zeros_here_and_there(surface, places, share):
    table = measured(SURFACES[surface], PLACES[places])
    rows = some(table, share)
    found = find_spoilt(spoiled(table, rows, 0.0))
    np.testing.assert_array_equal(np.sort(np.concatenate([one.rows for one in found])), np.sort(rows))


@pytest.mark.parametrize("mark", [-999.0, -1.0, -9.99, 9999.0, 99.0, 1e30, -1e30])
@pytest.mark.parametrize("surface", ["matte", "dark", "rough", "satin"])
@pytest.mark.parametrize("share", [0.02, 0.4])
def test_marks_of_missing_values(surface, mark, share):
    table = measured(SURFACES[surface], PLACES["grid"])
    rows = some(table, share)
    found = find_spoilt(spoiled(table, rows, mark))
    assert [one.mark for one in found] == [mark]
    np.testing.assert_array_equal(found[0].rows, np.sort(rows))


@pytest.mark.parametrize("mark", [-999.0, 1e30])
def test_a_single_mark(mark):
    table = measured(SURFACES["satin"], PLACES["scattered"])
    (found,) = find_spoilt(spoiled(table, [17], mark))
    np.testing.assert_array_equal(found.rows, [17])


def test_two_marks_and_zeros_at_once():
    table = measured(SURFACES["satin"], PLACES["grid"])
    rows = some(table, 0.3)
    values = np.array([-999.0, 9999.0, 0.0])[np.arange(len(rows)) % 3][:, None]
    found = find_spoilt(spoiled(table, rows, values))
    assert {one.mark for one in found} == {-999.0, 9999.0, 0.0}
    np.testing.assert_array_equal(np.flatnonzero(~without(table, found)), np.sort(rows))


@pytest.mark.parametrize("step", [0.001, 0.005, 0.02])
@pytest.mark.parametrize("exponent", [20.0, 50.0, 300.0])
@pytest.mark.parametrize("places", PLACES)
def test_true_zeros_of_a_dark_gloss_stay(places, exponent, step):
    """Read to a step: beyond the highlight nothing is left of it."""
    table = measured(glossy(0.0, 0.3, exponent), PLACES[places])
    table = replace(table, value=np.round(table.value / step) * step)
    assert (table.value == 0.0).sum() > 20
    assert find_spoilt(table) == []


@pytest.mark.parametrize("step", [0.0, 0.002])
def test_noise_below_zero_stays_and_so_does_what_is_cut_off_at_zero(step):
    table = measured(glossy(0.0, 0.3, 50.0), PLACES["grid"], constant=0.004)
    values = np.round(table.value / step) * step if step else table.value
    assert (values < 0.0).sum() > 50
    assert find_spoilt(replace(table, value=values)) == []
    assert find_spoilt(replace(table, value=np.maximum(values, 0.0))) == []


def test_a_peak_far_above_everything_stays():
    """A mirror's peak, the same at all incidences, without noise."""
    table = measured(glossy(0.1, 0.5, 20000.0), PLACES["grid"], noise=0.0)
    assert table.value.max() > 1000.0 * np.median(table.value)
    assert find_spoilt(table) == []


def test_what_is_told():
    table = measured(SURFACES["matte"], PLACES["grid"])
    kept = believed(spoiled(table, [10, 11, 12, 20], 0.0))
    assert kept.left_out == 4 and len(kept.value) == len(table.value) - 4
    (told,) = kept.warnings
    assert told.startswith("4 rows left out: 0 where the rows around them say about 0.159")
    assert told.endswith("(lines 12 to 14, 22)")


def test_a_mark_is_found_whatever_the_quantity(tmp_path):
    """Divided by cosines, a mark is repeated no more."""
    table = measured(SURFACES["satin"], PLACES["grid"])
    values = np.cos(table.theta_r) * table.value[:, 0]
    values[some(table, 0.05)] = -1.0
    angles = np.degrees([table.theta_i, table.phi_i, table.theta_r, table.phi_r]).T
    path = tmp_path / "cosine.csv"
    header = "theta_i,phi_i,theta_r,phi_r,f"
    np.savetxt(path, np.column_stack([angles, values]), delimiter=",", header=header, comments="", fmt="%.6g")
    found = read_samples(path, Told(quantity="brdf-cos"))
    assert found.left_out == 32 and (found.value > 0.0).all()
    assert "-1 where" in found.warnings[0]


def test_of_several_channels_a_row_goes_if_one_is_spoilt():
    table = measured(SURFACES["matte"], PLACES["grid"])
    both = samples(PLACES["grid"], table.value[:, 0])
    both = replace(both, value=np.column_stack([table.value, table.value]), channels=("a", "b"))
    both.value[[3, 30], 1] = -999.0
    kept = believed(both)
    assert kept.left_out == 2 and "for b" in kept.warnings[0]


@pytest.mark.skipif(not CASES.exists(), reason="the shared cases are not here")
@pytest.mark.parametrize(
    ("name", "out", "said"),
    [
        ("plain", 0, ""),
        ("one-zero", 1, "line 302"),
        ("zeros-toward-lamp", 62, "the detector hid the lamp"),
        ("sentinel-999", 38, "-999"),
        ("dark-with-true-zeros", 0, ""),
        ("constant-noise", 0, ""),
    ],
)
def test_the_shared_cases(name, out, said):
    found = read_samples(CASES / f"{name}.csv")
    assert found.left_out == out
    assert len(found.warnings) == (out > 0) and said in " ".join(found.warnings)


@pytest.mark.skipif(not DATA.exists(), reason="the measured data are not here")
def test_no_row_of_measured_tables_is_left_out():
    columns = {"theta_i": "thetai", "phi_i": "phi", "theta_r": "thetar", "phi_r": "phir", "value": "f_r11"}
    for wavelength in ("0.351", "0.532", "0.633", "1.064"):
        told = Told(columns=columns, where=(("lambda", wavelength),))
        assert read_samples(DATA / "nist-ptfe/PTFE.data.csv", told).warnings == ()
    for path in sorted((DATA / "curet-30").glob("*.csv")):
        found = read_samples(path)
        assert len(found.value) == 205 and found.warnings == (), path


@pytest.mark.parametrize("mark", [0.001, 1e-6])
@pytest.mark.parametrize("surface", ["matte", "rough", "satin"])
@pytest.mark.parametrize("share", [0.02, 0.3])
def test_a_small_value_where_nothing_was_measured(surface, mark, share):
    table = measured(SURFACES[surface], PLACES["grid"])
    rows = some(table, share)
    found = find_spoilt(spoiled(table, rows, mark))
    assert [one.mark for one in found] == [mark]
    np.testing.assert_array_equal(found[0].rows, np.sort(rows))


@pytest.mark.parametrize("mark", [0.07, 0.3])
def test_a_value_that_comes_again_and_again_among_others(mark):
    table = measured(SURFACES["matte"], PLACES["scattered"], noise=0.02)
    rows = some(table, 0.1)
    assert [one.mark for one in find_spoilt(spoiled(table, rows, mark))] == [mark]


@pytest.mark.parametrize(("power", "step"), [(20.0, 0.01), (50.0, 0.005), (300.0, 0.02)])
def test_the_last_digits_of_a_black_gloss_are_believed(power, step):
    table = measured(glossy(0.0, 0.3, power), PLACES["grid"], noise=0.0)
    cut = replace(table, value=np.round(table.value / step) * step)
    assert find_spoilt(cut) == [] and np.mean(cut.value == 0.0) > 0.5


@pytest.mark.parametrize("surface", ["matte", "satin"])
@pytest.mark.parametrize("signed", [True, False])
def test_the_noise_of_a_covered_detector_is_no_measurement(surface, signed):
    table = measured(SURFACES[surface], regular(), noise=0.01)
    rows, rng = np.sort(some(table, 0.05)), np.random.default_rng(3)
    dark = 1e-3 * np.median(table.value) * rng.standard_normal(len(rows))
    found = find_spoilt(spoiled(table, rows, (dark if signed else np.abs(dark))[:, None]))
    np.testing.assert_array_equal(np.unique(np.concatenate([one.rows for one in found])), rows)
