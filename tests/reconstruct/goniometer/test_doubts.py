"""Conventions that are not what they are taken for are doubted; surfaces that only look so are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.goniometer.doubts import doubts_of, much_lost
from photogonio.reconstruct.goniometer.read import read_samples, take
from photogonio.reconstruct.goniometer.told import Told
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.goniometer import glossy, in_plane, matte, measured, regular, rough, scattered
from tests.places import DATA, SHARED

CASES = SHARED / "cases"
PLACES = {
    "grid": regular(),
    "square": regular(15.0, 15.0, 30.0),
    "plane": in_plane(),
    "random": scattered(800),
}
SURFACES = {
    "matte": matte(0.5),
    "rough": rough(0.6),
    "satin": glossy(0.3, 0.1, 20.0),
    "glossy": glossy(0.2, 0.1, 200.0),
    "metal": glossy(0.0, 0.8, 100.0),
}


def codes(table, quantity="brdf"):
    return [one.code for one in doubts_of(table, quantity)]


@pytest.mark.parametrize("places", PLACES)
@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("noise", [0.0, 0.01, 0.05])
def test_nothing_is_doubted_without_reason(places, surface, noise):
    assert codes(measured(SURFACES[surface], PLACES[places], noise=noise)) == []


@pytest.mark.parametrize("places", ["grid", "square", "plane"])
@pytest.mark.parametrize("surface", ["matte", "rough", "satin"])
def test_a_cosine_in_the_values(places, surface):
    table = measured(SURFACES[surface], PLACES[places])
    for angle, asked in ((table.theta_r, "brdf-cos"), (table.theta_i, "brdf-cos-incident")):
        (found,) = doubts_of(replace(table, value=table.value * np.cos(angle)[:, None]), "brdf")
        assert found.code == "table-cosine" and found.message.endswith(f"--quantity {asked}")


def test_a_cosine_that_was_told_and_is_not_there():
    table = measured(SURFACES["matte"], PLACES["square"])
    (found,) = doubts_of(replace(table, value=table.value / np.cos(table.theta_r)[:, None]), "brdf-cos")
    assert "are they brdf-cos, as was told?" in found.message


@pytest.mark.parametrize("places", ["grid", "square", "plane"])
@pytest.mark.parametrize("surface", ["satin", "glossy"])
def test_azimuths_from_the_mirror_side(places, surface):
    table = measured(SURFACES[surface], PLACES[places])
    turned = replace(table, phi_r=table.phi_r + np.pi)
    assert codes(turned) == ["table-lamp-side"]


def microfacets(toward: float):
    """GGX of roughness 0.3 about the mirror direction, or of as much a turned one about the lamp's (-1)."""

    def f(theta_i, theta_r, dphi):
        incident, exit = unit_vectors(theta_i, 0.0 * theta_i), unit_vectors(theta_r, dphi)
        half = incident + exit * [toward, toward, 1.0]
        cosine = half[:, 2] / np.linalg.norm(half, axis=1)
        return 0.05 + 0.02 / (cosine**2 * (0.3**2 - 1.0) + 1.0) ** 2 / (cosine**2 * 4.0) / np.maximum(
            np.cos(theta_i), np.cos(theta_r)
        )

    return f


@pytest.mark.parametrize("places", ["grid", "random"])
def test_a_gloss_on_the_lamps_side_is_told_from_a_retro_reflector(places):
    turned = measured(microfacets(-1.0), PLACES[places], noise=0.01)
    assert "table-mirrored" in codes(turned)
    assert "table-mirrored" not in [one.code for one in doubts_of(turned, "brdf", side_told=True)]
    assert codes(measured(microfacets(1.0), PLACES[places], noise=0.01)) == []
    retro = glossy(0.3, 0.1, 60.0, toward=1.0)
    assert codes(measured(retro, PLACES[places], noise=0.01)) == ["table-lamp-side"]


def test_rows_are_lost_toward_the_horizon_or_by_a_tenth_and_fewer_are_not_told():
    table = measured(SURFACES["satin"], PLACES["grid"], noise=0.01)
    grazing = table.theta_r > np.radians(65.0)
    (lost,) = much_lost(table, take(table, ~grazing))
    assert lost.code == "table-much-lost" and "beyond 60 degrees of exit" in lost.message
    few = np.arange(len(table.value)) % 20 != 0
    assert much_lost(table, take(table, few)) == ()
    (lost,) = much_lost(table, take(table, few & np.roll(few, 1)))
    assert "rows are no measurements" in lost.message


def test_the_shared_cases():
    if not CASES.exists():
        pytest.skip("the shared cases are not here")
    told = {"radians": Told(angles="radians"), "two-wavelengths": Told(channel_by="wavelength_nm")}
    told["in-plane-signed"] = Told(azimuth="mirror")
    doubted = {"times-cosine": "table-cosine", "azimuth-from-mirror-side": "table-lamp-side"}
    for path in CASES.glob("*.csv"):
        found = [one.code for one in read_samples(path, told.get(path.stem, Told())).diagnoses]
        assert [code for code in found if code != "rows-left-out"] == [
            code for name, code in doubted.items() if name == path.stem
        ]
    (wrong,) = read_samples(CASES / "in-plane-signed.csv", Told(azimuth="lamp")).diagnoses
    assert wrong.code == "table-lamp-side"


@pytest.mark.skipif(not DATA.exists(), reason="the measured data are not here")
def test_measured_tables_are_not_doubted():
    columns = {"theta_i": "thetai", "phi_i": "phi", "theta_r": "thetar", "phi_r": "phir", "value": "f_r11"}
    for wavelength in ("0.351", "0.532", "0.633", "1.064"):
        told = Told(columns=columns, where=(("lambda", wavelength),))
        assert read_samples(DATA / "nist-ptfe/PTFE.data.csv", told).diagnoses == ()
    for path in sorted((DATA / "curet-30").glob("*.csv")):
        assert read_samples(path).diagnoses == (), path


@pytest.mark.parametrize("surface", ["satin", "matte", "metal"])
def test_a_detector_that_could_take_no_more_is_told(surface):
    table = measured(SURFACES[surface], PLACES["random"], noise=0.01)
    limit = np.quantile(table.value, 0.97)
    assert codes(replace(table, value=np.minimum(table.value, limit))) == ["table-saturated"]


@pytest.mark.parametrize("turn", [60.0, -90.0])
@pytest.mark.parametrize("surface", ["satin", "sheen"])
def test_a_gloss_beside_the_plane_of_incidence(surface, turn):
    table = measured((SURFACES | {"sheen": glossy(0.5, 0.02, 20.0)})[surface], PLACES["grid"], noise=0.02)
    turned = replace(table, phi_r=table.phi_r + np.radians(turn))
    assert "table-mirrored" in codes(turned) and "table-mirrored" not in codes(table)
    assert not doubts_of(turned, "brdf", side_told=True)


@pytest.mark.parametrize("places", ["grid", "random"])
@pytest.mark.parametrize("surface", ["matte", "rough", "satin"])
def test_values_that_hold_both_cosines_are_doubted(surface, places):
    """Which are reciprocal: exchanged pairs say nothing."""
    table = measured(SURFACES[surface], PLACES[places], noise=0.02)
    both = np.cos(table.theta_i) * np.cos(table.theta_r)
    dark = replace(table, value=table.value * both[:, None])
    (doubt,) = [one for one in doubts_of(dark, "brdf") if one.code == "table-cosine"]
    assert "--quantity brdf-cos-cos" in doubt.message and abs(doubt.amount - 1.0) < 0.25
    assert "table-cosine" not in [one.code for one in doubts_of(dark, "brdf", quantity_told=True)]
    assert "table-cosine" not in codes(table)


def test_a_sample_that_was_turned_is_not_held_to_isotropic_models():
    """Brushed metal at even steps: such models are wrong of it with values as read and moved, and by chance less so
    moved (odds e^322)."""
    steps = (np.arange(0, 360, 30), np.arange(0, 80, 20), np.arange(0, 80, 10), np.arange(0, 360, 45))
    phi_i, theta_i, theta_r, dphi = (np.radians(one).ravel() for one in np.meshgrid(*steps, indexing="ij"))
    brushed = make_brdf("brushed-metal", {"roughness_x": 0.12, "roughness_y": 0.4})
    value = brushed(unit_vectors(theta_i, phi_i), unit_vectors(theta_r, phi_i + dphi))[:, :1]
    table = GoniometerSamples(theta_i, phi_i, theta_r, phi_i + dphi, value, None, ("f",))
    assert not {one.code for one in doubts_of(table, "brdf")}


@pytest.mark.parametrize("surface", ["matte", "rough", "satin", "glossy"])
def test_a_table_of_two_scales_is_not_reciprocal(surface):
    """Incidences beyond 40 degrees are read with twice the gain: twins across it differ by a factor of two."""
    table = measured(SURFACES[surface], PLACES["square"], noise=0.02)
    twice = np.where(table.theta_i > np.radians(40.0), 2.0, 1.0)[:, None]
    told = {"table-not-reciprocal", "table-gain"}  # the second where nearly all of it is told by the step
    assert not told & set(codes(table))
    assert len(told & set(codes(replace(table, value=table.value * twice)))) == 1


def test_of_a_table_of_zeros_nothing_is_doubted():
    """Nor warned of: a fit refuses it."""
    assert codes(measured(lambda ti, tr, p: 0.0 * ti, regular())) == []


def test_a_brushed_sample_at_one_rotation_is_not_reciprocal():
    """Exchanged pairs of one rotation are twins of a surface that is alike however it is turned, and of no other."""
    theta_i, theta_r, dphi = PLACES["square"]
    brushed = make_brdf("brushed-metal", {"roughness_x": 0.25, "roughness_y": 0.5})
    value = brushed(unit_vectors(theta_i, 0 * theta_i), unit_vectors(theta_r, dphi))[:, :1]
    (found,) = doubts_of(GoniometerSamples(theta_i, 0 * theta_i, theta_r, dphi, value, None, ("f",)), "brdf")
    assert found.code == "table-not-reciprocal" and "brushed or woven" in found.message
