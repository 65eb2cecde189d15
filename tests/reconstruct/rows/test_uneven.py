"""Groups of rows that are a multiple of the others are told, and no surface has any."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.goniometer.doubts import UNEVEN, doubts_of
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.rows.uneven import FEWEST, MOST_ROWS, Uneven, uneven_of
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.goniometer import glossy, in_plane, matte, measured, regular, rough, scattered
from tests.places import DATA

LEAST = min(UNEVEN.values())
SURFACES = {
    "matte": matte(0.5),
    "rough": rough(0.6),
    "satin": glossy(0.3, 0.1, 20.0),
    "sheen": glossy(0.5, 0.02, 20.0),
}
PLACES = {"grid": regular(), "half": regular(20.0, 10.0, 60.0), "random": scattered(300, 4)}


def found(table, least: float = LEAST) -> Uneven | None:
    return uneven_of(table, table.value[:, 0], least)


def scaled(table, factor):
    return replace(table, value=table.value * factor[:, None])


def groups(table, factor: float) -> dict[str, np.ndarray]:
    """By what rows are multiplied."""
    lines, sine = np.arange(len(table.value)), np.sin(table.phi_r - table.phi_i)
    scan = np.unique(np.rint(np.degrees(table.theta_i)), return_inverse=True)[1].ravel()
    chosen = {"lines": lines % 2 == 1, "side": sine > 0.01, "scans": scan % 2 == 1}
    found = {name: np.where(one, factor, 1.0) for name, one in chosen.items()}
    return found | {"order": np.linspace(1.0, factor, len(lines))}


@pytest.mark.parametrize("places", [*PLACES, "plane"])
@pytest.mark.parametrize("surface", [*SURFACES, "metal", "sharp"])
@pytest.mark.parametrize("noise", [0.002, 0.05])
def test_no_rows_of_a_surface_are_uneven(places, surface, noise):
    others = {"metal": glossy(0.05, 0.8, 60.0), "sharp": glossy(0.05, 0.8, 100.0)}
    table = measured((SURFACES | others)[surface], (PLACES | {"plane": in_plane()})[places], noise=noise)
    assert found(table, 10.0) is None


@pytest.mark.parametrize("places", PLACES)
@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("factor", [1.3, 0.8])
def test_every_second_line(places, surface, factor):
    table = measured(SURFACES[surface], PLACES[places], noise=0.02)
    one = found(scaled(table, groups(table, factor)["lines"]))
    assert one.group == "lines" and abs(np.log(one.factor / factor)) < 0.06


@pytest.mark.parametrize("group", ["side", "scans", "order"])
@pytest.mark.parametrize("surface", SURFACES)
def test_a_side_or_later_rows(group, surface):
    """Lines of a grid come in the order of its angles: there exchanged pairs tell a drift."""
    table = measured(SURFACES[surface], PLACES["random" if group == "order" else "grid"], noise=0.02)
    spoilt = scaled(table, groups(table, 0.75)[group])
    one = found(spoilt)
    assert one.group == group and one.odds > UNEVEN[group] and abs(np.log(one.factor / 0.75)) < 0.06
    assert "table-uneven" in [told.code for told in doubts_of(spoilt, "brdf", side_told=True)]


def test_every_second_line_of_more_rows_than_are_looked_at():
    table = measured(SURFACES["satin"], regular(10.0, 5.0, 20.0), noise=0.02)
    assert len(table.value) > MOST_ROWS and found(table) is None
    assert found(scaled(table, groups(table, 1.3)["lines"])).group == "lines"


def test_few_bright_rows_with_noise_of_their_own_are_no_group():
    """Of 300 rows six have most of the light, and noise of 5 % of it."""
    for seed in range(12):
        table = measured(glossy(0.1, 0.2, 200.0), scattered(300, seed), noise=0.05, seed=seed)
        assert found(table, 10.0) is None


def test_few_rows_tell_nothing():
    table = measured(SURFACES["matte"], scattered(FEWEST - 1), noise=0.01)
    assert found(scaled(table, groups(table, 2.0)["lines"])) is None


@pytest.mark.parametrize("turn", [0.3, 0.8, 1.2])
def test_brushed_metal_at_one_rotation_has_sides_that_are_not_told(turn):
    """They differ, but not by a number."""
    theta_i, theta_r, dphi = regular()
    brushed = make_brdf("brushed-metal", {"roughness_x": 0.25, "roughness_y": 0.5})
    value = brushed(unit_vectors(theta_i, 0 * theta_i + turn), unit_vectors(theta_r, turn + dphi))[:, :1]
    table = GoniometerSamples(theta_i, 0 * theta_i, theta_r, dphi, value, None, ("f",))
    assert "table-uneven" not in [told.code for told in doubts_of(table, "brdf")]


@pytest.mark.skipif(not DATA.exists(), reason="the measured data are not here")
def test_measured_tables_have_none():
    for path in sorted((DATA / "curet-30").glob("*.csv")):
        assert found(read_samples(path), 10.0) is None, path
