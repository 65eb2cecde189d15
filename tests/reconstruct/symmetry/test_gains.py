"""Exchanged pairs that a change of gain tells apart are told from those of surfaces that are not reciprocal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.goniometer.doubts import doubts_of
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.symmetry.gains import GainChange, gain_of
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.goniometer import glossy, in_plane, matte, measured, regular, rough, samples, scattered
from tests.places import DATA

SURFACES = {
    "matte": matte(0.5),
    "rough": rough(0.6),
    "satin": glossy(0.3, 0.1, 20.0),
    "glossy": glossy(0.2, 0.1, 60.0),
}
PLACES = {"grid": regular(15.0, 15.0, 30.0), "coarse": regular(20.0, 10.0, 30.0), "random": scattered(400, 3)}


def found(table) -> GainChange | None:
    return gain_of(table.theta_i, table.theta_r, table.phi_r - table.phi_i, table.value[:, 0])


def scaled(table, factor):
    return replace(table, value=table.value * factor[:, None])


@pytest.mark.parametrize("places", [*PLACES, "plane"])
@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("noise", [0.002, 0.05])
def test_surfaces_have_no_gain_of_their_own(places, surface, noise):
    table = measured(SURFACES[surface], (PLACES | {"plane": in_plane()})[places], noise=noise)
    assert found(table) is None


@pytest.mark.parametrize("places", PLACES)
@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize(("beyond", "factor"), [(50.0, 0.7), (32.0, 1.5)])
def test_readings_beyond_an_angle(places, surface, beyond, factor):
    """The angle is told to half a step of the grid, the factor to a few per cent, as the noise of twins has it."""
    table = measured(SURFACES[surface], PLACES[places], noise=0.02)
    far = table.theta_r > np.radians(beyond)
    gain = found(scaled(table, np.where(far, factor, 1.0)))
    assert abs(np.degrees(gain.beyond) - beyond) < 10.1 and abs(np.log(gain.factor / factor)) < 0.05
    other = found(scaled(table, np.where(table.theta_i > np.radians(beyond), 1.0 / factor, 1.0)))
    assert abs(np.log(other.factor / factor)) < 0.05  # exchange cannot tell which of the two it was
    (doubt,) = doubts_of(scaled(table, np.where(far, factor, 1.0)), "brdf")
    assert doubt.code in ("table-gain", "table-scan-off")  # where one incidence alone lies beyond


@pytest.mark.parametrize("places", ["grid", "coarse"])
@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("last", [2.0, 0.6])
def test_a_lamp_that_drifts(places, surface, last):
    """From line to line it does so evenly, and not as a power has it: to a tenth."""
    table = measured(SURFACES[surface], PLACES[places], noise=0.01)
    gain = found(scaled(table, np.linspace(1.0, last, len(table.value))))
    assert gain.beyond is None and abs(np.log(gain.factor / last)) < 0.1


@pytest.mark.parametrize(("x", "y"), [(0.25, 0.5), (0.12, 0.4)])
@pytest.mark.parametrize("places", PLACES)
def test_a_brushed_sample_is_not_reciprocal_in_another_way(places, x, y):
    theta_i, theta_r, dphi = PLACES[places]
    brushed = make_brdf("brushed-metal", {"roughness_x": x, "roughness_y": y})
    value = brushed(unit_vectors(theta_i, 0 * theta_i), unit_vectors(theta_r, dphi))[:, 0]
    assert found(samples(PLACES[places], value)) is None


def test_few_rows_tell_nothing():
    table = measured(matte(0.5), scattered(12))
    assert found(scaled(table, np.where(table.theta_r > 0.8, 0.5, 1.0))) is None


@pytest.mark.skipif(not DATA.exists(), reason="the measured data are not here")
def test_measured_tables_whose_pairs_differ_have_no_such_gain():
    for path in sorted((DATA / "curet-30").glob("*.csv")):
        assert found(read_samples(path)) is None, path
