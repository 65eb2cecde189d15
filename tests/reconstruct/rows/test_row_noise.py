"""Fits of measured rows that state no errors, and modes alone beside plain least squares."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.fit import FitOptions, fit_table
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.cells import cells_of
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table
from photogonio.synthetic.brdf.library import make_brdf

ROWS = 900
MATTE = 0.05


def scattered(name, parameters, seed=0):
    rng = np.random.default_rng(seed)
    theta_i, theta_r = np.arccos(rng.uniform(0.17, 1.0, (2, ROWS)))
    phi_r = rng.uniform(0.0, 2.0 * np.pi, ROWS)
    brdf = make_brdf(name, parameters)
    return (
        brdf(unit_vectors(theta_i, 0.0 * theta_i), unit_vectors(theta_r, phi_r))[:, :1],
        theta_i,
        theta_r,
        phi_r,
    )


def table_of(value, theta_i, theta_r, phi_r):
    return samples_table(GoniometerSamples(theta_i, 0.0 * theta_i, theta_r, phi_r, value, None, ("Y",)))


@pytest.mark.parametrize("relative", [0.1, 0.3])
def test_noise_that_is_the_same_everywhere_pulls_nothing_down(relative):
    """The mean of so many rows is known to ``relative / sqrt(ROWS)``; weights by readings are off by the square of
    ``relative``, twice."""
    value, *angles = scattered("lambert", {"albedo": (MATTE,)})
    noise = relative * value.mean() * np.random.default_rng(1).standard_normal(value.shape)
    found = fit_table(table_of(value + noise, *angles), FitOptions(symmetry="isotropic")).brdf
    assert found.bihemispherical_albedo()[0] == pytest.approx(MATTE, rel=4.0 * relative / np.sqrt(ROWS))


@pytest.mark.parametrize("order", [4, 8])
@pytest.mark.parametrize(
    ("name", "parameters"),
    [("ggx-conductor", {"f0": (0.8,), "roughness": 0.3}), ("oren-nayar", {}), ("phong", {"power": 20.0})],
)
def test_modes_alone_follow_the_rows_as_least_squares_do(name, parameters, order):
    value, *angles = scattered(name, parameters)
    table = table_of(value, *angles)
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
