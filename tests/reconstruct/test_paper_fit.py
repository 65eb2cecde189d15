"""The paper's own fit of q, beside pseudo-inverses of modes that are summed here."""

import numpy as np
import pytest
from scipy.special import eval_jacobi

from photogonio.capture.errors import InputError
from photogonio.reconstruct.fit import FitOptions, fit_table
from photogonio.reconstruct.paper_fit import UNTOLD
from photogonio.reconstruct.table.cells import cells_of
from tests.drawn.goniometer import rows_of, table_of_rows


def elevation(n: int, l: int, theta: np.ndarray) -> np.ndarray:
    """Theta_n^l by Jacobi's polynomials, which scipy has."""
    square = 1.0 - np.cos(theta)
    k = (n - l) // 2
    radial = (-1.0) ** k * square ** (l / 2) * eval_jacobi(k, l, 0, 1.0 - 2.0 * square)
    return np.sqrt((n + 1) / (2.0 * np.pi)) * radial


def design(order: int, theta_i, theta_r, dphi) -> tuple[list[tuple[int, int, int]], np.ndarray]:
    """The paper's S of orthonormal factors, each over its own norm."""
    modes = [
        (n, m, l)
        for n in range(order + 1)
        for m in range(n + 1)
        for l in range(m + 1)
        if (n - l) % 2 == 0 and (m - l) % 2 == 0
    ]
    columns = []
    for n, m, l in modes:
        both = elevation(n, l, theta_i) * elevation(m, l, theta_r)
        both = both + elevation(m, l, theta_i) * elevation(n, l, theta_r)
        norm = (4.0 if n == m else 2.0) * (1.0 if l == 0 else 0.5)
        columns.append(both * np.cos(l * dphi) / np.sqrt(norm))
    return modes, np.column_stack(columns)


def asked(quantity: str, order: int | None = 6, **more) -> FitOptions:
    return FitOptions(order=order, quantity=quantity, robust=False, smooth=False, **more)


@pytest.mark.parametrize("quantity", ["brdf_cos", "brdf_cos_cos"])
def test_coefficients_are_those_of_the_pseudo_inverse(quantity):
    value, *angles = rows_of("oren-nayar", {})
    table = table_of_rows(value, *angles)
    cells = cells_of(table)
    factor = np.cos(cells.theta_i) * (np.cos(cells.theta_r) if quantity == "brdf_cos_cos" else 1.0)
    modes, columns = design(6, cells.theta_i, cells.theta_r, cells.dphi)
    expected = np.linalg.pinv(columns) @ (factor[:, None] * cells.value)
    found = fit_table(table, asked(quantity))
    where = {tuple(row): k for k, row in enumerate(found.brdf.modes.tolist())}
    own = found.brdf.coefficients[[where[mode] for mode in modes]]
    np.testing.assert_allclose(own, expected, atol=1e-11 * np.abs(expected).max())
    assert found.brdf.quantity == quantity and not found.brdf.lobes and found.diagnostics[UNTOLD][0] == 0
    said = found.brdf.evaluate(cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r)
    np.testing.assert_allclose(said * factor[:, None], columns @ expected, atol=1e-11)


def test_lambert_is_modes_of_f_cos_cos_and_not_of_f_cos():
    """f cos_i is not symmetric: of all pairs both ways, symmetric modes have its half, (cos_i + cos_r) / (2 pi)."""
    value, *angles = rows_of("lambert", {"albedo": (0.5,)})
    angles = (np.r_[angles[0], angles[1]], np.r_[angles[1], angles[0]], np.r_[angles[2], angles[2]])
    table = table_of_rows(np.concatenate([value, value]), *angles)
    right = fit_table(table, asked("brdf_cos_cos", 2)).brdf
    half = fit_table(table, asked("brdf_cos", 2)).brdf
    theta_i, theta_r = 0.3, 1.1
    assert right.evaluate(theta_i, 0.0, theta_r, 2.0)[0] == pytest.approx(0.5 / np.pi, rel=1e-9)
    expected = 0.25 / np.pi * (1.0 + np.cos(theta_r) / np.cos(theta_i))
    assert half.evaluate(theta_i, 0.0, theta_r, 2.0)[0] == pytest.approx(expected, rel=1e-9)


def test_errors_of_q_are_as_stated_where_its_noise_is_the_same_everywhere():
    """Of modes that hold the surface, over draws of the noise: the squares of what is off over the errors are 1."""
    value, *angles = rows_of("lambert", {})
    theta_i, theta_r = angles[:2]
    size = 0.02 / (np.cos(theta_i) * np.cos(theta_r))[:, None]
    pulls = []
    for seed in range(8):
        noise = size * np.random.default_rng(seed).standard_normal(value.shape)
        found = fit_table(table_of_rows(value + noise, *angles), asked("brdf_cos_cos", 4))
        truth = fit_table(table_of_rows(value, *angles), asked("brdf_cos_cos", 4)).brdf.coefficients
        spread = np.sqrt(np.diagonal(found.uncertainty.covariance, axis1=1, axis2=2)).T
        pulls.append((found.brdf.coefficients - truth) / spread)
    squares = np.square(pulls)
    assert squares.mean() == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / squares.size) + 0.05)


def test_modes_that_are_untold_are_counted():
    value, *angles = rows_of("lambert", {})
    table = table_of_rows(value[:9], *(one[:9] for one in angles))
    found = fit_table(table, asked("brdf_cos_cos", 4))
    untold, modes = found.diagnostics[UNTOLD]
    assert modes == 14 and untold >= 5


def test_what_is_no_part_of_it_is_refused():
    value, *angles = rows_of("lambert", {})
    table = table_of_rows(value, *angles)
    for options in (asked("brdf_cos", lobes=1), asked("brdf_cos", physics="on"), asked("brdf_cos", 99)):
        with pytest.raises(InputError):
            fit_table(table, options)
