"""Which model is taken: what was asked, what is refused, and which others are believed beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.model_selection import PRIORS, Candidate, Prior
from photogonio.reconstruct.estimate.weights import error_model
from photogonio.reconstruct.lobes.families import second_lobe
from photogonio.reconstruct.model_choice import (
    FEWEST_ROWS,
    HIGHEST_AUTO_TABLE,
    FitOptions,
    asks_for_average,
    beaten,
    predicting_alike,
    rivals,
    select,
)
from photogonio.reconstruct.rows.row_average import average_of
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.goniometer_csv import samples_table
from tests.drawn.fits import cleaned
from tests.drawn.goniometer import matte, measured, scattered

GLOSS = LobeSet((second_lobe(absolute=False),), (np.array([0.23]),))  # between the shapes that averages try
OTHER = LobeSet((second_lobe(absolute=False),), (np.array([0.6]),))


def rows(count: int = 150, channels: int = 1) -> Cells:
    one = cells_of(samples_table(measured(matte(0.5), scattered(count), noise=0.01)))
    value = np.repeat(one.value, channels, axis=1)
    names = tuple(f"{k}" for k in range(channels))
    return replace(one, value=value, variance=np.zeros_like(value), channels=names)


def glossy() -> Cells:
    given = rows()
    _, columns = GLOSS.columns(given)
    value = 0.2 + columns @ np.full((columns.shape[1], 1), 0.3)
    return given.with_value(value * (1.0 + 0.002 * np.random.default_rng(0).normal(size=value.shape)))


def test_an_average_is_of_measured_rows_with_everything_automatic():
    assert asks_for_average(rows(), FitOptions())
    assert asks_for_average(rows(), FitOptions(symmetry="isotropic"))
    for options in (
        FitOptions(order=3),
        FitOptions(lobes=0),
        FitOptions(smooth=False),
        FitOptions(symmetry="reciprocal"),
    ):
        assert not asks_for_average(rows(), options)
    assert not asks_for_average(rows(FEWEST_ROWS - 1), FitOptions())


def test_an_average_is_beaten_by_the_lobe_that_made_the_rows_and_not_by_chance():
    for given, lobes, expected in ((rows(), (), False), (glossy(), (GLOSS,), True)):
        own = average_of(given, error_model(given), 4)
        assert beaten(own, cleaned(given, LobeSet(), *lobes)) == expected


def test_of_a_matte_surface_the_first_mode_is_enough():
    tried, chosen, best = select(cleaned(rows()), FitOptions(), "isotropic")
    assert chosen.order == 0 and best in tried and chosen in tried
    assert chosen.loss.mean() >= best.loss.mean()


def test_the_order_that_was_asked_is_taken():
    tried, chosen, best = select(cleaned(rows()), FitOptions(order=3), "isotropic")
    assert chosen.order == best.order == 3 and {one.order for one in tried} == {3}
    assert {one.prior for one in tried} == set(PRIORS)
    bare, *_ = select(cleaned(rows()), FitOptions(order=1, smooth=False), "isotropic")
    assert [one.prior.strength for one in bare] == [np.inf]


def test_of_spectra_fewer_orders_are_tried():
    def orders(channels: int) -> set[int]:
        tried, *_ = select(cleaned(rows(60, channels)), FitOptions(), "isotropic")
        return {one.order for one in tried}

    assert orders(8) < orders(1) and orders(1) >= set(range(HIGHEST_AUTO_TABLE + 1))


@pytest.mark.parametrize(
    ("order", "symmetry", "said"),
    [
        (49, "isotropic", "to order 48 at most"),
        (17, "reciprocal", "to order 16"),
        (12, "general", "at most 1300"),
    ],
)
def test_orders_beyond_what_can_be_fitted_are_refused(order, symmetry, said):
    with pytest.raises(InputError, match=f"--order {order}: .*{said}"):
        select(cleaned(rows(40)), FitOptions(order=order), symmetry)


def candidate(lobes: LobeSet, loss: float, order: int = 1) -> Candidate:
    return Candidate(order, Prior(0.1, 1.0), lobes, np.full(4, loss))


def test_models_with_the_chosen_lobes_are_believed_by_what_they_predict():
    chosen = candidate(GLOSS, 1.0)
    tried = [chosen, candidate(GLOSS, 1.0, 2), candidate(GLOSS, 9.0, 0), candidate(OTHER, 1.0)]
    found = predicting_alike(tried, chosen, rows())
    assert [one.lobes for one, _ in found] == [GLOSS, GLOSS]
    assert [weight for _, weight in found] == pytest.approx([0.5, 0.5])


def test_rivals_are_fitted_with_lobes_of_their_own():
    work = cleaned(glossy(), GLOSS, OTHER)
    chosen = candidate(GLOSS, 1.0)
    (rival,) = rivals([chosen, candidate(OTHER, 1.0)], chosen, work, "isotropic")
    assert rival.model.lobes == OTHER and 0.0 < rival.weight < 1.0
    assert rival.spread is None  # no more lobes than the chosen has
    assert rivals([chosen], chosen, work, "isotropic") == ()
