"""Columns by which a model leaves isotropy or reciprocity: orthonormal, and of that kind alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.modes.basis import isotropic_design
from photogonio.reconstruct.modes.quadrature import elevation_rule
from photogonio.reconstruct.symmetry.columns import SWAPPED, Columns, swapped_modes, turning_modes
from photogonio.reconstruct.table.cells import Cells


def cells(n: int = 80) -> Cells:
    rng = np.random.default_rng(0)
    theta, phi = rng.uniform(0.0, 1.5, (2, n)), rng.uniform(-np.pi, np.pi, (2, n))
    return Cells.of_directions(theta[0], phi[0], theta[1], phi[1])


def exchanged(given: Cells) -> Cells:
    return Cells.of_directions(given.theta_r, given.phi_r, given.theta_i, given.phi_i)


def rule(turns: int) -> tuple[Cells, np.ndarray]:
    """Pairs and weights that integrate products of low modes over both hemispheres exactly."""
    theta, weight = elevation_rule(5)
    phi = 2.0 * np.pi * np.arange(turns) / turns
    i, pi, r, pr = (a.ravel() for a in np.meshgrid(theta, phi, theta, phi, indexing="ij"))
    own = (weight[:, None] * np.full(turns, 2.0 * np.pi / turns)).ravel()
    return Cells.of_directions(i, pi, r, pr), np.multiply.outer(own, own).ravel()


def test_swapped_modes_change_sign_when_exchanged_and_are_orthonormal():
    there, back = swapped_modes(cells()), swapped_modes(exchanged(cells()))
    np.testing.assert_allclose(back.values, -there.values, atol=1e-13)
    pairs, weight = rule(9)
    values = swapped_modes(pairs).values
    np.testing.assert_allclose(values.T @ (weight[:, None] * values), np.eye(len(SWAPPED)), atol=1e-11)
    design = isotropic_design(4, pairs.theta_i, pairs.theta_r, pairs.dphi)
    np.testing.assert_allclose(design.T @ (weight[:, None] * values), 0.0, atol=1e-10)


@pytest.mark.parametrize("order", [1, 2])
def test_turning_modes_are_reciprocal_orthonormal_and_have_no_isotropic_part(order):
    given = cells()
    there = turning_modes(given, order)
    np.testing.assert_allclose(turning_modes(exchanged(given), order).values, there.values, atol=1e-12)
    pairs, weight = rule(9)
    values = turning_modes(pairs, order).values
    np.testing.assert_allclose(values.T @ (weight[:, None] * values), np.eye(values.shape[1]), atol=1e-10)
    design = isotropic_design(order, pairs.theta_i, pairs.theta_r, pairs.dphi)
    np.testing.assert_allclose(design.T @ (weight[:, None] * values), 0.0, atol=1e-10)


def test_turning_modes_know_a_turn_and_not_half_a_turn():
    given = cells()
    by = {turn: replace(given, phi_i=given.phi_i + turn, phi_r=given.phi_r + turn) for turn in (np.pi, 0.7)}
    values = turning_modes(given, 2).values
    np.testing.assert_allclose(turning_modes(by[np.pi], 2).values, values, atol=1e-12)
    assert np.abs(turning_modes(by[0.7], 2).values - values).max(0).min() > 1e-3


def test_none_is_none():
    none = Columns.none(cells())
    assert none.values.shape == (80, 0) and none.degree.shape == (0,)
    assert len(swapped_modes(cells()).degree) == len(SWAPPED)
