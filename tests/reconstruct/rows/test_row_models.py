"""Whether a single model beats the average of rows, and the average as a fit."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.model_selection import Candidate, Prior
from photogonio.reconstruct.estimate.weights import error_model
from photogonio.reconstruct.rows.row_average import average_of
from photogonio.reconstruct.rows.row_models import (
    MUCH,
    ORDER,
    beats,
    best_average,
    fitted_of,
    loss_of,
    losses_of,
    uncertainty_of_average,
)
from photogonio.reconstruct.table.cells import cells_of
from photogonio.reconstruct.table.goniometer_csv import samples_table
from tests.drawn.goniometer import SATIN, glossy, measured, scattered

CELLS = cells_of(samples_table(measured(SATIN, scattered(120), noise=0.02)))
LOSSES = np.random.default_rng(0).uniform(0.5, 2.0, 5)


def test_a_single_model_must_be_much_better_in_all_folds():
    assert beats(0.9 * MUCH * LOSSES, LOSSES)
    assert not beats(LOSSES, LOSSES)
    assert not beats(1.1 * MUCH * LOSSES, LOSSES)
    lucky = LOSSES * [0.001, 1.0, 1.0, 1.0, 1.0]  # one fold alone proves nothing
    assert not beats(lucky, LOSSES)
    assert not beats(np.zeros(1), np.ones(1))


def test_losses_are_squares_of_residuals_in_their_errors_fold_by_fold():
    fold = np.arange(len(CELLS)) % 3
    error = error_model(CELLS)
    off = CELLS.with_value(CELLS.value + error * (1.0 + fold[:, None]))
    found = loss_of(off, CELLS.value, fold)
    # errors of rows without their own are all alike, of the level, and that may have changed with the values
    ratio = (error / error_model(off)) ** 2
    expected = np.bincount(fold, (1.0 + fold) ** 2 * ratio[:, 0])
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_a_candidates_loss_is_counted_as_the_averages():
    """Its mean weighted square a value, of errors ``scale`` times as large, back to a sum of squares."""
    fold = np.arange(len(CELLS)) % 4
    missed = np.random.default_rng(1).normal(size=CELLS.value.shape) * error_model(CELLS)
    scale, counts = 1.7, np.bincount(fold)
    mean = np.bincount(fold, ((missed / (scale * error_model(CELLS))) ** 2)[:, 0]) / counts
    candidate = Candidate(2, Prior(1.0, 1.0), LobeSet(), mean)
    said = losses_of(candidate, CELLS, fold, scale)
    np.testing.assert_allclose(said, loss_of(CELLS, CELLS.value - missed, fold), rtol=1e-9)


def test_the_average_is_a_fit_whose_shapes_are_held():
    average = average_of(CELLS, error_model(CELLS), 2)
    fit = fitted_of(average, CELLS)
    np.testing.assert_allclose(fit.residual, CELLS.value - average.model.evaluate(CELLS), rtol=1e-12)
    assert fit.scale > 0.0 and (fit.weight == 1.0).all()
    spread = uncertainty_of_average(average, 0.01)
    shapes, own = len(average.model.lobes.flat()), average.covariance.shape[1]
    assert spread.covariance.shape[1:] == (own + shapes, own + shapes)
    np.testing.assert_array_equal(spread.covariance[:, :own, :own], average.covariance)
    assert not spread.covariance[:, own:].any() and spread.scale_error == 0.01
    error = spread.standard_error(average.model, CELLS)
    own_error = uncertainty_of_average(average).standard_error(average.model, CELLS)
    said = average.model.evaluate(CELLS)
    np.testing.assert_allclose(error, np.hypot(own_error, 0.01 * said), rtol=1e-9)


def test_higher_orders_are_tried_only_of_many_rows_and_kept_only_if_they_predict_better():
    assert best_average(CELLS).model.basis.order == ORDER
    sharp = cells_of(samples_table(measured(glossy(0.1, 0.3, 60.0), scattered(560), noise=0.001)))
    found = best_average(sharp)
    usual = average_of(sharp, error_model(sharp), ORDER)
    losses = [loss_of(sharp, one.left_out, one.fold).sum() for one in (found, usual)]
    assert found.model.basis.order > ORDER and losses[0] < losses[1]
