"""How sure a fit is: what its standard error is made of."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import STEP, LobeSet, Model, shape_slopes
from photogonio.reconstruct.lobes.families import retro_lobe
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.budget import Rival, Uncertainty


def test_the_stated_error_holds_the_spread_of_the_rivals():
    """Of models that are f and 1.1 f, each believed by half, the mean square of what is off is 0.005 f^2; and half of
    the rival's own variance."""
    basis, cells = Basis("isotropic", 0), Cells.of_angles(*np.full((3, 1), 0.5))
    model, other = (Model(basis, np.full((1, 1), size), LobeSet(), np.empty((0, 1))) for size in (1.0, 1.1))
    sure = Uncertainty(basis, np.zeros((1, 1, 1)), 0, 10.0)
    value = model.evaluate(cells)
    told = Uncertainty(basis, sure.covariance, 0, 10.0, rivals=(Rival(other, 0.5),))
    assert sure.standard_error(model, cells) == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(told.standard_error(model, cells), np.sqrt(0.005) * value, rtol=1e-9)
    unsure = Uncertainty(basis, np.full((1, 1, 1), 0.03), 0, 10.0)
    both = Uncertainty(basis, sure.covariance, 0, 10.0, rivals=(Rival(other, 0.5, unsure),))
    expected = np.sqrt(0.5 * (0.01 + 0.03)) * value
    np.testing.assert_allclose(both.standard_error(model, cells), expected, rtol=1e-9)


def test_an_interval_of_few_degrees_of_freedom_is_students():
    basis = Basis("isotropic", 0)
    for freedom, quantile in ((1.0, 12.706), (10.0, 2.228), (1e9, 1.960)):
        spread = Uncertainty(basis, np.zeros((1, 1, 1)), 0, freedom)
        np.testing.assert_allclose(spread.half_width(np.array([2.0])), 2.0 * quantile, rtol=1e-3)
    assert spread.half_width(np.ones(1), 0.5) == pytest.approx(0.6745, rel=1e-3)


def test_modes_alone_are_as_sure_as_with_the_lobes_known():
    """The covariance of modes given all else is the inverse of their part of the precision."""
    basis = Basis("isotropic", 2)
    m, rng = len(basis.modes), np.random.default_rng(0)
    root = rng.normal(size=(2, m + 3, m + 3))
    whole = root @ np.swapaxes(root, 1, 2) + np.eye(m + 3)
    spread = Uncertainty(basis, whole, 3, 10.0)
    for found, one in zip(spread.of_modes_alone(), whole, strict=True):
        np.testing.assert_allclose(found, np.linalg.inv(np.linalg.inv(one)[:m, :m]), rtol=1e-9)


def test_slopes_by_the_logarithm_of_a_roughness_in_closed_form():
    """Seen along the light a retro-reflective peak is weight / (4 pi roughness^2): its slope is -2 of itself."""
    lobes = LobeSet((retro_lobe(absolute=True),), (np.array([0.2]),))
    model = Model(Basis("isotropic", 0), np.zeros((1, 1)), lobes, np.full((1, 1), 0.6))
    along = Cells.of_angles(np.array([0.0, 0.5]), np.array([0.0, 0.5]), np.zeros(2))
    # differences of exp(-2 x) over steps h are off by 2 h^2 / 3
    np.testing.assert_allclose(shape_slopes(model, along)[:, 0], -2.0 * model.evaluate(along), rtol=STEP**2)
