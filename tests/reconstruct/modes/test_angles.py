"""Angles and unit vectors, both ways, to the last digit where it is hard."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.modes.angles import pair_angles, spherical_angles, unit_vectors


def test_round_trip():
    theta, phi = np.meshgrid([1e-9, 0.3, 1.2, np.pi / 2, 2.5], [-3.0, -0.1, 0.0, 2.9])
    back = spherical_angles(unit_vectors(theta, phi))
    assert np.abs(back[0] - theta).max() < 1e-15 and np.abs(back[1] - phi).max() < 1e-15
    assert np.linalg.norm(unit_vectors(theta, phi), axis=-1) == pytest.approx(1, rel=1e-15)


def test_length_does_not_matter_and_the_pole_has_azimuth_0():
    theta, phi = spherical_angles(np.array([[0, 0, 5.0], [0, 0, 1e-200], [3e-150, 0, 3e-150]]))
    assert theta == pytest.approx([0, 0, np.pi / 4]) and np.array_equal(phi, [0, 0, 0])


def test_pairs():
    theta_i, phi_i, theta_r, phi_r = np.random.default_rng(0).uniform(0, [[1.57], [6], [1.57], [6]], (4, 200))
    found = pair_angles(unit_vectors(theta_i, phi_i), unit_vectors(theta_r, phi_r))
    assert np.abs(found[0] - theta_i).max() < 1e-14 and np.abs(found[1] - theta_r).max() < 1e-14
    assert np.abs(np.exp(1j * found[2]) - np.exp(1j * (phi_r - phi_i))).max() < 1e-12
    spread = pair_angles(unit_vectors(0.3, 0.1), unit_vectors(theta_r, phi_r))
    assert [a.shape for a in spread] == [(200,)] * 3
    assert pair_angles([0, 0, 1.0], [0.6, 0, 0.8])[2] == 0.0
