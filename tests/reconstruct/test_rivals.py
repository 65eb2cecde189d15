"""Lobes that held-out data cannot tell from those chosen are in the stated error."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.model_averaging import rivals_of
from photogonio.reconstruct.estimate.model_selection import Candidate, Prior
from photogonio.reconstruct.lobes.families import families, retro_lobe
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.budget import Rival, Uncertainty

COAT, OTHER = (LobeSet((one,), (np.array([0.3, 0.04]),)) for one in families(absolute=True)[2:])
MORE = LobeSet((*COAT.families, retro_lobe(absolute=True)), (np.array([0.3, 0.04]), np.array([0.1])))
OBSERVED = 100.0


def one(lobes, loss, order=1):
    return Candidate(order, Prior(0.1, 1.0), lobes, np.full(4, loss))


def test_lobes_that_predict_as_well_share_the_belief_and_those_far_off_have_none():
    chosen = one(COAT, 1.0)
    (rival,) = rivals_of(chosen, [chosen, one(COAT, 1.2, 0), one(OTHER, 1.0), one(OTHER, 3.0, 0)], OBSERVED)
    assert rival[0].lobes is OTHER and rival[0].loss.mean() == 1.0
    assert rival[1] == pytest.approx(0.5)
    assert rivals_of(chosen, [chosen, one(OTHER, 2.0)], OBSERVED) == []


def test_more_lobes_are_a_rival_only_if_they_predict_notably_better():
    chosen = one(COAT, 1.0)
    for nearly in (1.0, 0.95):
        assert rivals_of(chosen, [chosen, one(MORE, nearly)], OBSERVED) == []
    ((rival, weight),) = rivals_of(chosen, [chosen, one(MORE, 0.85)], OBSERVED)
    assert rival.lobes is MORE and weight > 0.5


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
