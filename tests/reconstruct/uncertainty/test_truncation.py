"""Where a series of modes ends that goes on, what is left is about what its last terms are."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.estimate.lobe_search import search_lobes
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.model_selection import Prior
from photogonio.reconstruct.estimate.weights import error_model
from photogonio.reconstruct.table.cells import cells_of
from photogonio.reconstruct.uncertainty.truncation import LEAST_ORDER, last_terms
from photogonio.synthetic.brdf.library import make_brdf, on_grid
from tests.drawn.tables import Plan, simulate

PRIOR = Prior(3.0, 1.0)
PLAN = Plan(views=16, pixels=2000, view_error=0.0, electrons=1e7, spoiled=0.0)


def fitted(order, kind="oren-nayar", **parameters):
    brdf = make_brdf(kind, parameters)
    cells = cells_of(simulate(brdf, PLAN))
    true = on_grid(brdf, np.column_stack([cells.theta_i, cells.theta_r, cells.dphi]))
    deviation = error_model(cells)
    fit = search_lobes(cells, deviation, Basis("isotropic", order), PRIOR, LobeSet(), free=0)
    return fit, cells, deviation, true


@pytest.mark.parametrize("order", [4, 6])
def test_as_much_is_left_of_a_ridge_as_the_last_orders_gave(order):
    fit, cells, deviation, true = fitted(order, sigma=0.6)
    last = last_terms(fit, cells, deviation, PRIOR)
    left = fit.model.evaluate(cells) - true
    # of a series whose squares fall like the square of the order, terms to come add up to a few of the last
    assert 0.4 <= np.sqrt(np.mean(last**2) / np.mean(left**2)) <= 2.5
    # and they are where it is: more of both in the half of the cells that has more of one
    more = np.abs(last).mean(1) > np.median(np.abs(last).mean(1))
    assert np.mean(left[more] ** 2) > 1.5 * np.mean(left[~more] ** 2)


def test_nothing_is_left_of_what_has_no_modes_there():
    fit, cells, deviation, true = fitted(6, "lambert")
    last = last_terms(fit, cells, deviation, PRIOR)
    assert np.sqrt(np.mean(last**2)) <= 2e-3 * true.mean()  # noise of single cells alone


def test_low_orders_and_rows_have_ended_by_themselves():
    fit, cells, deviation, _ = fitted(LEAST_ORDER - 1, sigma=0.6)
    assert last_terms(fit, cells, deviation, PRIOR) is None
    assert last_terms(fitted(LEAST_ORDER)[0], replace(cells, binned=False), deviation, PRIOR) is None
