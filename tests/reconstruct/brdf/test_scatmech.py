"""SCATMECH's coefficient files: the published PTFE coefficients, their normaliser, and round trips."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.scatmech import (
    ScatmechTable,
    read_scatmech,
    scatmech_brdf,
    scatmech_table,
    write_scatmech,
)
from photogonio.reconstruct.modes import basis as m
from tests.places import DATA

PTFE = DATA / "nist-ptfe"
needs_ptfe = pytest.mark.skipif(not PTFE.is_dir(), reason="the PTFE data are not beside the project")


@needs_ptfe
@pytest.mark.parametrize(("nanometres", "percent"), [(351, 1.05), (532, 0.93), (633, 1.07), (1064, 1.74)])
def test_published_coefficients_reproduce_the_measurements(nanometres, percent):
    brdf = scatmech_brdf(read_scatmech(PTFE / f"PTFE.{nanometres}.coeff.csv"))
    table = np.genfromtxt(PTFE / "PTFE.data.csv", delimiter=",", skip_header=1)
    theta_i, phi_i, theta_r, phi_r, f = table[np.isclose(table[:, 0], nanometres / 1000), 1:6].T
    assert len(f) == 1824
    other_side = np.where(theta_i < 0, np.pi, 0.0)  # a negative theta_i is seen from phi_i = 180
    found = brdf.evaluate(
        np.radians(np.abs(theta_i)), np.radians(phi_i) + other_side, np.radians(theta_r), np.radians(phi_r)
    )
    rms = np.sqrt(np.mean((found[:, 0] / f - 1) ** 2))
    assert round(100 * rms, 2) <= percent
    # far from any other reading of the file: unity for the sign of theta_i, a mirrored azimuth
    wrong = brdf.evaluate(np.radians(np.abs(theta_i)), 0.0, np.radians(theta_r), np.radians(phi_r))
    assert np.sqrt(np.mean((wrong[:, 0] / f - 1) ** 2)) > 3 * rms


@needs_ptfe
def test_whole_files_survive_a_round_trip(tmp_path):
    for path in sorted(PTFE.glob("PTFE.*.coeff.csv")):
        table = read_scatmech(path)
        assert len(table.values) == 330 and table.unpolarised.sum() == 40
        write_scatmech(tmp_path / path.name, table)
        back = read_scatmech(tmp_path / path.name)
        assert np.array_equal(back.rows, table.rows) and np.array_equal(back.values, table.values)


def test_their_normaliser():
    """sqrt((n+1)(m+1) / c^2) / 2 pi; c^2 is 4 if n = 0 or (n = m and l = 0), 2 if n = m or l = 0, else 1."""
    rows = [(n, k, l) for n in range(5) for k in range(5) for l in range(min(n, k) + 1)]
    rows = [row for row in rows if (row[0] - row[2]) % 2 == 0 and (row[1] - row[2]) % 2 == 0]
    assert (0, 2, 0) in rows and (2, 0, 0) in rows
    theta_i, theta_r, dphi = 0.5, 1.1, 0.7
    for n, k, l in rows:
        table = ScatmechTable(np.array([[1, 1, n, k, l, l, 0]]), np.array([1.0]))
        c2 = 4 if n == 0 or (n == k and l == 0) else 2 if n == k or l == 0 else 1
        factor = np.sqrt((n + 1) * (k + 1) / c2) / (2 * np.pi)
        one, two = np.sqrt(2) * np.sin(theta_i / 2), np.sqrt(2) * np.sin(theta_r / 2)
        both = _radial(n, l, one) * _radial(k, l, two) + _radial(k, l, one) * _radial(n, l, two)
        exact = factor * both * np.cos(l * dphi)
        assert scatmech_brdf(table).evaluate(theta_i, 0, theta_r, dphi)[0] == pytest.approx(exact, rel=1e-12)


def _radial(n: int, l: int, rho: float) -> float:
    """By heart, to order 4."""
    return {
        (0, 0): 1.0,
        (1, 1): rho,
        (2, 0): 2 * rho**2 - 1,
        (2, 2): rho**2,
        (3, 1): 3 * rho**3 - 2 * rho,
        (3, 3): rho**3,
        (4, 0): 6 * rho**4 - 6 * rho**2 + 1,
        (4, 2): 4 * rho**4 - 3 * rho**2,
        (4, 4): rho**4,
    }[n, l]


def test_rows_of_one_mode_add_up():
    rows = np.array([[1, 1, 2, 0, 0, 0, 0], [1, 1, 0, 2, 0, 0, 0], [1, 2, 2, 0, 0, 0, 0]])
    brdf = scatmech_brdf(ScatmechTable(rows, np.array([0.3, 0.4, 9.0])))
    assert np.array_equal(brdf.modes, [[2, 0, 0]])
    assert brdf.coefficients[0, 0] == pytest.approx(0.3 + 0.4 / np.sqrt(2), rel=1e-14)


def test_powers_of_the_wavelength():
    rows = np.array([[1, 1, 0, 0, 0, 0, p] for p in range(4)])
    table = ScatmechTable(rows, np.array([1.0, 0.1, 0.01, 0.001]))
    brdf = scatmech_brdf(table, wavelength=0.5)
    assert brdf.coefficients[0, 0] == pytest.approx(1 + 0.05 + 0.0025 + 0.000125, rel=1e-14)
    with pytest.raises(InputError, match="wavelength"):
        scatmech_brdf(table)


def test_brdf_to_file_and_back(tmp_path):
    modes = m.isotropic_modes(5)
    values = np.random.default_rng(0).normal(size=(len(modes), 2))
    brdf = Brdf(5, ("a", "b"), modes, values, values)
    write_scatmech(tmp_path / "c.csv", scatmech_table(brdf, channel=1))
    back = scatmech_brdf(read_scatmech(tmp_path / "c.csv"))
    assert np.array_equal(back.modes, modes) and np.array_equal(back.coefficients[:, 0], values[:, 1])
    general = Brdf(1, ("a",), m.general_modes(1), np.ones((9, 1)), np.ones((9, 1)), symmetry="general")
    with pytest.raises(InputError, match="isotropic"):
        scatmech_table(general)


def test_blanks_commas_and_comments(tmp_path):
    path = tmp_path / "c.txt"
    path.write_text(
        "; a comment\n\n1 1 0 0 0 0 0 2.5 ; Lambert\n1,1,1,1,1,1,0,-0.25\r\n  1, 1,\t2, 0, 0, 0, 0, 1e-3\n"
    )
    table = read_scatmech(path)
    assert table.values.tolist() == [2.5, -0.25, 1e-3] and table.rows[2].tolist() == [1, 1, 2, 0, 0, 0, 0]


BAD_LINES = """1,1,0,0,0,0,0
1,1,0,0,0,0,0,x
1,1,2,1,0,0,0,1
2,1,0,0,0,0,0,1
1,1,1,1,1,-1,0,1
1,1,0,0,0,0,-1,1
1,1,0,0,0,0,0,nan
1,1,0,0,0.5,0,0,1"""


@pytest.mark.parametrize("line", BAD_LINES.splitlines())
def test_bad_lines_are_named(tmp_path, line):
    path = tmp_path / "bad.csv"
    path.write_text(f"1,1,0,0,0,0,0,1\n{line}\n")
    with pytest.raises(InputError, match=r"bad\.csv: line 2: "):
        read_scatmech(path)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="absent"):
        read_scatmech(tmp_path / "absent.csv")
    (tmp_path / "empty.csv").write_text("; nothing\n")
    with pytest.raises(InputError, match="no coefficients"):
        read_scatmech(tmp_path / "empty.csv")
    (tmp_path / "binary.csv").write_bytes(b"\xff\xfe\x00\x81")
    with pytest.raises(InputError, match="binary"):
        read_scatmech(tmp_path / "binary.csv")
