"""Modes that were asked for, alone, beside plain least squares."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.fit import FitOptions, fit_table
from photogonio.reconstruct.table.cells import cells_of
from tests.drawn.goniometer import rows_of, table_of_rows


@pytest.mark.parametrize("order", [4, 8])
@pytest.mark.parametrize(
    ("name", "parameters"),
    [("ggx-conductor", {"f0": (0.8,), "roughness": 0.3}), ("oren-nayar", {}), ("phong", {"power": 20.0})],
)
def test_modes_alone_follow_the_rows_as_least_squares_do(name, parameters, order):
    value, *angles = rows_of(name, parameters)
    table = table_of_rows(value, *angles)
    cells, basis = cells_of(table), Basis("isotropic", order)
    design = basis.design(cells)
    plain = np.linalg.lstsq(design, value, rcond=None)[0]
    least = np.linalg.norm(design @ plain - value)
    asked = FitOptions(order=order, lobes=0, symmetry="isotropic", physics="off")
    found = fit_table(table, asked)
    assert np.linalg.norm(found.predicted - value) <= 1.1 * least
    bare = FitOptions(order=order, lobes=0, symmetry="isotropic", physics="off", robust=False, smooth=False)
    np.testing.assert_allclose(
        fit_table(table, bare).brdf.coefficients, plain, atol=1e-6 * np.abs(plain).max()
    )
