"""A plain table of angles and values: what ``fit`` reads again."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.export.csv_table import write_csv
from photogonio.reconstruct.goniometer.read import read_samples
from tests.drawn.brdfs import brdf_of, mirror, uncertain
from tests.drawn.exports import satin


def test_the_program_reads_it_as_the_brdf(tmp_path):
    write_csv(satin(), tmp_path / "a.csv")
    samples = read_samples(tmp_path / "a.csv")
    assert samples.channels == ("R", "G", "B") and samples.sigma is None
    assert samples.diagnoses == ()
    # angles are whole degrees, values have nine digits
    np.testing.assert_allclose(samples.value, satin()(samples.incident, samples.exit), rtol=1e-8)
    assert np.degrees(samples.theta_r).max() == pytest.approx(85.0)


def test_a_turning_surface_goes_all_the_way_round_and_an_isotropic_one_half(tmp_path):
    write_csv(satin(), tmp_path / "a.csv")
    brushed = brdf_of(mirror((0.5, 0.3), azimuth=0.4), order=0)
    write_csv(brushed, tmp_path / "b.csv")
    once, every = (np.genfromtxt(tmp_path / name, delimiter=",", names=True) for name in ("a.csv", "b.csv"))
    assert set(once["phi_i"]) == {0.0} and set(once["phi_r"]) == set(np.arange(0.0, 181.0, 15.0))
    for column in ("phi_i", "phi_r"):
        assert set(every[column]) == set(np.arange(0.0, 360.0, 15.0))
    row = every[len(every) // 3]
    angles = np.radians([row[name] for name in ("theta_i", "phi_i", "theta_r", "phi_r")])
    np.testing.assert_allclose([row[c] for c in "RGB"], brushed.evaluate(*angles), rtol=1e-8)


def test_standard_errors_stand_beside_what_they_are_of(tmp_path):
    brdf = uncertain(brdf_of(order=1))
    write_csv(brdf, tmp_path / "a.csv")
    table = np.genfromtxt(tmp_path / "a.csv", delimiter=",", names=True)
    angles = np.radians([table[name] for name in ("theta_i", "phi_i", "theta_r", "phi_r")])
    said = np.column_stack([table[f"sigma_{c}"] for c in "RGB"])
    np.testing.assert_allclose(said, brdf.standard_error(*angles), rtol=5.1e-4)  # of four digits
