"""MERL tables against a reader transcribed from MERL's own C code, and round trips."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.merl import bin_centres, bin_values, read_merl, write_merl
from photogonio.reconstruct.modes.angles import from_half_difference, half_difference, unit_vectors


def merl_lookup(data: bytes, theta_in, phi_in, theta_out, phi_out) -> list[float]:
    """One lookup as BRDFRead.cpp does it, in plain numbers: rotate, then index by half and difference angles."""
    n = struct.unpack("<3i", data[:12])

    def rotate(v, axis, angle):
        c, s = math.cos(angle), math.sin(angle)
        dot = sum(a * b for a, b in zip(axis, v, strict=True))
        cross = (
            axis[1] * v[2] - axis[2] * v[1],
            axis[2] * v[0] - axis[0] * v[2],
            axis[0] * v[1] - axis[1] * v[0],
        )
        return [v[k] * c + axis[k] * dot * (1 - c) + cross[k] * s for k in range(3)]

    def vector(theta, phi):
        return [math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]

    i, o = vector(theta_in, phi_in), vector(theta_out, phi_out)
    half = [(a + b) / 2 for a, b in zip(i, o, strict=True)]
    length = math.sqrt(sum(h * h for h in half))
    half = [h / length for h in half]
    theta_h, phi_h = math.acos(min(1.0, half[2])), math.atan2(half[1], half[0])
    diff = rotate(rotate(i, (0, 0, 1), -phi_h), (0, 1, 0), -theta_h)
    theta_d, phi_d = math.acos(min(1.0, diff[2])), math.atan2(diff[1], diff[0])
    row_h = min(max(int(math.sqrt(theta_h / (math.pi / 2) * 90 * 90)), 0), 89)
    row_d = min(max(int(theta_d / (math.pi / 2) * 90), 0), 89)
    phi_d = phi_d + math.pi if phi_d < 0 else phi_d
    row_p = min(max(int(phi_d / math.pi * 360 / 2), 0), 179)
    index = row_p + row_d * 180 + row_h * 180 * 90
    plane = n[0] * n[1] * n[2]
    stored = [struct.unpack_from("<d", data, 12 + 8 * (index + k * plane))[0] for k in range(3)]
    return [value * scale for value, scale in zip(stored, (1 / 1500, 1.15 / 1500, 1.66 / 1500), strict=True)]


def glossy(incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
    half = incident + exit
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    return np.column_stack(
        [0.1 + half[:, 2] ** 20, 0.2 + incident[:, 2] * exit[:, 2], np.full(len(half), 0.3)]
    )


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    path = tmp_path_factory.mktemp("merl") / "glossy.binary"
    write_merl(path, bin_values(glossy))
    return path


def test_half_and_difference_angles_and_back():
    incident, exit = (v[::997] for v in bin_centres())
    back = from_half_difference(*half_difference(incident, exit))
    np.testing.assert_allclose(back[0], incident, atol=1e-12)
    np.testing.assert_allclose(back[1], exit, atol=1e-12)


def test_the_independent_reader_finds_what_was_written(written):
    data, rng = written.read_bytes(), np.random.default_rng(1)
    table = read_merl(written)
    theta, phi = np.arccos(rng.uniform(0.2, 1, (2, 300))), rng.uniform(0, 2 * np.pi, (2, 300))
    incident, exit = (unit_vectors(theta[k], phi[k]) for k in range(2))
    found = table.evaluate(incident, exit)
    expected = [merl_lookup(data, *row) for row in zip(theta[0], phi[0], theta[1], phi[1], strict=True)]
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    # half a bin of 2 degrees or less changes these smooth functions by little
    np.testing.assert_allclose(expected, glossy(incident, exit), atol=0.09)


def test_bin_centres_are_read_back_exactly(written):
    incident, exit = (v[::1013] for v in bin_centres())
    above = (incident[:, 2] > 0) & (exit[:, 2] > 0)
    found = read_merl(written).evaluate(incident, exit)
    np.testing.assert_allclose(found[above], glossy(incident[above], exit[above]), rtol=1e-12)
    assert np.isnan(found[~above]).all()


def test_no_merl_table_is_refused(tmp_path):
    path = tmp_path / "short.binary"
    path.write_bytes(struct.pack("<3i", 90, 90, 180))
    with pytest.raises(InputError, match="no MERL table"):
        read_merl(path)
    with pytest.raises(InputError, match="cannot be read"):
        read_merl(tmp_path / "none.binary")


def test_bins_that_the_horizon_cuts_have_what_the_next_have(tmp_path):
    """Their middles lie below it, and are marked; pairs in them that lie above are as bright as a pair beside them."""
    write_merl(tmp_path / "even.binary", bin_values(lambda incident, exit: np.full((len(incident), 3), 0.25)))
    merl = read_merl(tmp_path / "even.binary")
    rng = np.random.default_rng(0)
    incident = unit_vectors(np.radians(rng.uniform(0.0, 88.0, 5000)), 0.0)
    exit = unit_vectors(np.radians(rng.uniform(86.0, 89.5, 5000)), rng.uniform(0.0, np.pi, 5000))
    np.testing.assert_allclose(merl.evaluate(incident, exit), 0.25, rtol=1e-9)
    below = exit * [1.0, 1.0, -1.0]
    assert np.isnan(merl.evaluate(incident, below)).mean() > 0.5
