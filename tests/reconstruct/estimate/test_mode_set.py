"""The modes of a fit: one face over three bases."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.table.cells import Cells

SYMMETRIES = ("isotropic", "reciprocal", "general")


def cells(n: int = 60) -> Cells:
    rng = np.random.default_rng(0)
    theta, phi = rng.uniform(0.0, 1.5, (2, n)), rng.uniform(-np.pi, np.pi, (2, n))
    return Cells.of_directions(theta[0], phi[0], theta[1], phi[1])


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_sums_without_a_matrix_are_those_with_one(symmetry):
    basis = Basis(symmetry, 4)
    own = np.random.default_rng(1).normal(size=(len(basis.modes), 3))
    np.testing.assert_allclose(basis.evaluate(cells(), own), basis.design(cells()) @ own, atol=1e-12)


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_a_lower_orders_modes_are_the_first(symmetry):
    low, high = Basis(symmetry, 2), Basis(symmetry, 4)
    count = len(low.modes)
    np.testing.assert_array_equal(high.modes[:count], low.modes)
    np.testing.assert_allclose(high.design(cells())[:, :count], low.design(cells()), atol=1e-13)
    np.testing.assert_array_equal(high.degree()[:count], low.degree())


def test_the_degree_is_zernikes_eigenvalue():
    """Bhatia and Wolf's operator on the disk, laplacian - (rho d/drho)^2 - 2 rho d/drho, takes R_n^l(rho) e^{il phi} to
    -n (n + 2) of itself; a degree is the sum of both factors' over 8."""
    for symmetry, mode, factors in (
        ("isotropic", [0, 0, 0], (0, 0)),
        ("isotropic", [2, 0, 0], (2, 0)),
        ("isotropic", [3, 1, 1], (3, 1)),
        ("general", [1, 1, 4, -2], (1, 4)),
    ):
        basis = Basis(symmetry, 4)
        (place,) = np.flatnonzero((basis.modes == mode).all(1))
        assert basis.degree()[place] == pytest.approx(sum(map(eigenvalue, factors)) / 8.0, rel=1e-6)


def eigenvalue(n: int) -> float:
    """n (n + 2), by differences of the radial polynomial of the lowest |l|."""
    l, rho, h = n % 2, 0.6, 1e-3
    coefficients = {
        0: [1.0],
        1: [1.0, 0.0],
        2: [2.0, 0.0, -1.0],
        3: [3.0, 0.0, -2.0, 0.0],
        4: [6.0, 0, -6.0, 0, 1.0],
    }[n]
    below, here, above = np.polyval(coefficients, [rho - h, rho, rho + h])
    first, second = (above - below) / (2.0 * h), (above - 2.0 * here + below) / h**2
    flat = second + first / rho - l**2 * here / rho**2
    return -(flat - (rho**2 * second + rho * first) - 2.0 * rho * first) / here
