"""Readings of a BRDF that is known everywhere."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.goniometer.sampled import INCIDENCE, TURNS, samples_of
from photogonio.reconstruct.modes.angles import unit_vectors


def cosines(incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
    return np.column_stack([incident[:, 2] * exit[:, 2], incident[:, 0] + exit[:, 1]])


@pytest.mark.parametrize("isotropic", [True, False])
def test_readings_are_those_of_the_directions_beside_them(isotropic):
    found = samples_of(cosines, ("a", "b"), isotropic=isotropic, note="known")
    np.testing.assert_allclose(found.value, cosines(found.incident, found.exit), atol=1e-12)
    assert (found.theta_i < np.pi / 2).all() and (found.theta_r < np.pi / 2).all()
    turns = np.unique(np.round(np.degrees(found.phi_i[found.theta_i > 0.0]) % 360.0, 9))
    np.testing.assert_array_equal(turns % 360.0, [0.0] if isotropic else TURNS)
    assert f"read at {len(found.value)} pairs" in found.notes[0]


def test_the_mirror_direction_of_every_incidence_is_among_them():
    found = samples_of(cosines, ("a", "b"), isotropic=True, note="known")
    for theta in np.radians(INCIDENCE):
        mirror = unit_vectors(np.array([theta]), np.array([np.pi]))
        here = np.abs(found.theta_i - theta) < 1e-9
        assert np.linalg.norm(found.exit[here] - mirror, axis=1).min() < 1e-12


def test_where_nothing_is_said_nothing_is_read():
    def half(incident, exit):
        return np.where(exit[:, :1] > 0.0, np.nan, 1.0)

    found = samples_of(half, ("a",), isotropic=True, note="known")
    whole = samples_of(lambda i, r: np.ones((len(i), 1)), ("a",), isotropic=True, note="known")
    assert 0 < len(found.value) < len(whole.value)
    assert (found.exit[:, 0] <= 1e-12).all() and (found.value == 1.0).all()
