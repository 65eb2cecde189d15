"""How sure a fit is: what its standard error is made of."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
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
