"""A plain table of angles and values: what ``fit`` reads again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from photogonio.reconstruct.export import table_grid
from photogonio.reconstruct.export.csv_table import read_csv, write_csv
from photogonio.reconstruct.export.loss import loss_of
from photogonio.reconstruct.goniometer.read import read_samples
from tests.drawn.brdfs import brdf_of, mirror, uncertain
from tests.drawn.exports import gloss, over_ground, satin


def columns(path: Path) -> dict[str, np.ndarray]:
    """By their names, as any program reads them."""
    names = path.read_text().partition("\n")[0].split(",")
    return dict(zip(names, np.loadtxt(path, delimiter=",", skiprows=1, unpack=True), strict=True))


@pytest.fixture
def short_tables(monkeypatch):
    """A tenth of the rows, where what is asked hangs on no number of them."""
    monkeypatch.setattr(table_grid, "ROWS", {False: 40_000, True: 60_000})


def test_the_program_reads_it_as_the_brdf(tmp_path, short_tables):
    brdf = satin(lobes=False)
    write_csv(brdf, tmp_path / "a.csv")
    samples = read_samples(tmp_path / "a.csv")
    assert samples.channels == ("R", "G", "B") and samples.sigma is None
    assert samples.diagnoses == ()
    # angles have three decimals, values nine digits
    np.testing.assert_allclose(samples.value, brdf(samples.incident, samples.exit), rtol=1e-8)
    assert np.degrees(samples.theta_r).max() == pytest.approx(89.5)


def test_a_narrow_gloss_has_rows_where_it_is(tmp_path):
    """Of two polar angles and an azimuth each misses 0.4 %, at grazing twice that; rows every 5 degrees lose 10 % of
    this gloss. Lines between rows add no light to speak of."""
    brdf = over_ground(gloss(0.2, 1), ("Y",))
    write_csv(brdf, tmp_path / "a.csv")
    loss = loss_of(brdf, read_csv(tmp_path / "a.csv"))
    assert max(loss.rms) < 2 * 3**0.5 * 0.004 and max(loss.albedo) < 1.005


def test_a_turning_surface_goes_all_the_way_round_and_an_isotropic_one_half(tmp_path, short_tables):
    write_csv(satin(), tmp_path / "a.csv")
    brushed = brdf_of(mirror((0.5, 0.3), azimuth=0.4), order=0)
    write_csv(brushed, tmp_path / "b.csv")
    once, every = (columns(tmp_path / name) for name in ("a.csv", "b.csv"))
    assert set(once["phi_i"]) == {0.0} and once["phi_r"].min() == 0.0 and once["phi_r"].max() == 180.0
    turn = np.unique(every["phi_i"])
    np.testing.assert_allclose(turn, np.arange(len(turn)) * (360.0 / len(turn)))
    apart = [
        np.unique(np.mod(every["phi_r"] - every["phi_i"], 360.0)[every["phi_i"] == one].round(3))
        for one in turn
    ]
    assert all(np.array_equal(one, apart[0]) for one in apart)
    np.testing.assert_allclose(np.sort(np.mod(-apart[0], 360.0)), apart[0], atol=1e-9)  # alike on both sides
    row = {name: column[len(column) // 3] for name, column in every.items()}
    angles = np.radians([row[name] for name in ("theta_i", "phi_i", "theta_r", "phi_r")])
    np.testing.assert_allclose([row[c] for c in "RGB"], brushed.evaluate(*angles), rtol=1e-8)


def test_standard_errors_stand_beside_what_they_are_of(tmp_path, short_tables):
    brdf = uncertain(brdf_of(order=1))
    write_csv(brdf, tmp_path / "a.csv")
    table = columns(tmp_path / "a.csv")
    angles = np.radians([table[name] for name in ("theta_i", "phi_i", "theta_r", "phi_r")])
    said = np.column_stack([table[f"sigma_{c}"] for c in "RGB"])
    np.testing.assert_allclose(said, brdf.standard_error(*angles), rtol=5.1e-4)  # of four digits
