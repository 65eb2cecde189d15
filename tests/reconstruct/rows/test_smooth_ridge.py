"""The smoothest surface that predicts rows: what it leaves free, what it follows, and that it sees no row left out."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model_selection import folds_of
from photogonio.reconstruct.estimate.weights import level
from photogonio.reconstruct.rows.smooth_ridge import STRENGTHS, smooth_ridge
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.goniometer_csv import samples_table
from tests.drawn.goniometer import SATIN, matte, measured, scattered

BASIS = Basis("isotropic", 6)
ONES = np.ones((200, 1))


def cells(surface, *, noise: float = 0.0, seed: int = 1) -> Cells:
    return cells_of(samples_table(measured(surface, scattered(200), noise=noise, seed=seed)))


def ridge(given: Cells, fold=None):
    return smooth_ridge(given, ONES, folds_of(given) if fold is None else fold, BASIS)


def test_a_matte_surface_is_the_first_mode_alone():
    """Lambert's mode is free, so that nothing pulls it down; readings have six digits."""
    found = ridge(cells(matte(0.6)))
    np.testing.assert_allclose(found.said, 0.6 / np.pi, rtol=1e-5)
    np.testing.assert_allclose(found.left_out, 0.6 / np.pi, rtol=1e-5)
    np.testing.assert_allclose(found.coefficients[0], 2.0 * 0.6, rtol=1e-5)
    assert np.abs(found.coefficients[1:]).max() < 1e-5


def test_what_is_said_is_the_sum_of_its_modes():
    given = cells(SATIN)
    found = ridge(given)
    np.testing.assert_allclose(found.said, BASIS.evaluate(given, found.coefficients), rtol=1e-9)
    assert found.prior.strength in STRENGTHS


def test_rows_of_a_fold_do_not_speak_for_themselves(monkeypatch):
    """With one strength on offer, what is said of a fold's rows is the same whatever they are."""
    monkeypatch.setattr("photogonio.reconstruct.rows.smooth_ridge.STRENGTHS", (1.0,))
    given = cells(SATIN)
    fold = folds_of(given)
    own = fold == 1
    # those above the middle value alone, so that the level, and with it the prior, stays
    brighter = own[:, None] & (given.value > np.median(given.value))
    spoilt = given.with_value(np.where(brighter, 1.5 * given.value, given.value))
    assert level(spoilt) == level(given) and brighter.any()
    first, second = (ridge(one, fold) for one in (given, spoilt))
    np.testing.assert_allclose(second.left_out[own], first.left_out[own], rtol=1e-9)
    assert np.abs(second.said[own] / first.said[own] - 1.0).max() > 0.1


def test_the_louder_the_noise_the_stiffer_the_ridge():
    strengths = [ridge(cells(SATIN, noise=noise)).prior.strength for noise in (0.0, 0.03, 0.3)]
    assert strengths == sorted(strengths, reverse=True) and strengths[0] > strengths[-1]
