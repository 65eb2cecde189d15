"""A scan with a factor of its own is found; surfaces that change with incidence are none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.goniometer.doubts import doubts_of
from photogonio.reconstruct.symmetry.scans import run_off, scan_off
from tests.drawn.goniometer import glossy, matte, measured, regular, scattered

SURFACES = {"matte": matte(0.5), "satin": glossy(0.3, 0.1, 20.0), "glossy": glossy(0.1, 0.2, 100.0)}


def found(table):
    return scan_off(table.theta_i, table.theta_r, table.phi_r - table.phi_i, table.value[:, 0])


@pytest.mark.parametrize("surface", SURFACES)
def test_no_scan_of_a_surface_is_off(surface):
    assert found(measured(SURFACES[surface], regular(15.0, 15.0, 30.0), noise=0.03)) is None


@pytest.mark.parametrize("surface", ["matte", "satin"])
@pytest.mark.parametrize("factor", [0.1, 0.6, 2.0])
@pytest.mark.parametrize("incidence", [30.0, 60.0])
def test_a_scan_with_another_factor(surface, factor, incidence):
    table = measured(SURFACES[surface], regular(15.0, 15.0, 30.0), noise=0.01)
    scan = np.abs(np.degrees(table.theta_i) - incidence) < 1.0
    table = replace(table, value=np.where(scan[:, None], factor, 1.0) * table.value)
    one = found(table)
    assert abs(np.degrees(one.incidence) - incidence) < 0.1 and one.count == scan.sum()
    assert abs(np.log(one.factor / factor)) < 0.1  # the surface changes little between incidences
    assert "table-scan-off" in [told.code for told in doubts_of(table, "brdf")]


def test_few_incidences_do_not_tell():
    table = measured(matte(0.5), regular(30.0, 15.0, 30.0), noise=0.01)
    scan = (np.abs(np.degrees(table.theta_i) - 30.0) < 1.0)[:, None]
    assert len(np.unique(table.theta_i)) < 4
    assert found(replace(table, value=np.where(scan, 2.0, 1.0) * table.value)) is None


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("seed", [1, 2])
def test_no_run_of_scattered_rows_is_off(surface, seed):
    table = measured(SURFACES[surface], scattered(300, seed), noise=0.03)
    assert run_off(table.theta_i, table.theta_r, table.phi_r - table.phi_i, table.value[:, 0]) is None


@pytest.mark.parametrize("surface", ["matte", "satin"])
@pytest.mark.parametrize(("factor", "first", "count"), [(0.5, 100, 30), (1.5, 0, 40), (10.0, 270, 30)])
def test_a_run_of_lines_with_another_factor(surface, factor, first, count):
    table = measured(SURFACES[surface], scattered(300, 3), noise=0.02)
    rows = np.arange(300)
    own = (rows >= first) & (rows < first + count)
    table = replace(table, value=np.where(own[:, None], factor, 1.0) * table.value)
    one = run_off(table.theta_i, table.theta_r, table.phi_r - table.phi_i, table.value[:, 0])
    assert abs(one.first - first) <= 10 and abs(one.count - count) <= 15
    assert abs(np.log(one.factor / factor)) < 0.15
    assert "table-scan-off" in [told.code for told in doubts_of(table, "brdf")]


def test_lines_that_are_places_beside_one_another_tell_of_no_run():
    table = measured(SURFACES["satin"], regular(15.0, 15.0, 30.0), noise=0.01)
    value = table.value[:, 0].copy()
    value[40:80] *= 1.5
    assert run_off(table.theta_i, table.theta_r, table.phi_r - table.phi_i, value) is None
