"""Covariance of a penalised fit: against closed forms, and against noise that is drawn again and again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.estimate.folded_design import Common
from photogonio.reconstruct.uncertainty.covariance import SHAPE_SPREAD, Alternative, Problem, covariance

MODES, UNITS, ROWS = 3, 60, 600
SIGMA = 0.05


def problem(seed: int = 0, *, lobes: int = 0, shapes: int = 0, channels: int = 1) -> Problem:
    rng = np.random.default_rng(seed)
    design = rng.normal(size=(ROWS, MODES))
    columns = np.abs(rng.normal(size=(ROWS, lobes)))
    slopes = rng.normal(size=(ROWS, shapes, channels))
    center = np.hstack(
        [
            rng.normal(size=(channels, MODES)),
            rng.uniform(1, 2, (channels, lobes)),
            np.zeros((channels, shapes)),
        ]
    )
    target = design @ center[:, :MODES].T + columns @ center[:, MODES : MODES + lobes].T
    return Problem(
        design=design,
        columns=columns,
        slopes=slopes,
        target=target,
        weight=np.full((ROWS, channels), SIGMA**-2),
        unit=np.arange(ROWS) % UNITS,
        common=None,
        center=center,
        fixed=np.zeros((channels, lobes), bool),
    )


def free(modes: int = MODES, weight: float = 1.0, channels: int = 1) -> Alternative:
    return Alternative(np.full((channels, modes), 1e-9), weight)


def noisy(given: Problem, seed: int) -> Problem:
    rng = np.random.default_rng(seed)
    return replace(given, target=given.target + SIGMA * rng.normal(size=given.target.shape))


def solved(given: Problem) -> np.ndarray:
    return np.linalg.lstsq(np.hstack([given.design, given.columns]), given.target[:, 0], rcond=None)[0]


def test_of_plain_least_squares_it_is_the_noise_over_the_gram_matrix():
    """The jackknife of u units scatters by sqrt(2 / u) of itself about it."""
    given = problem(lobes=1)
    both = np.hstack([given.design, given.columns])
    exact = SIGMA**2 * np.linalg.inv(both.T @ both)
    size = np.sqrt(np.diag(exact))
    several = []
    for seed in range(8):
        one = noisy(given, seed)
        several.append(covariance(replace(one, center=solved(one)[None]), [free()])[0])
    off = (np.mean(several, axis=0) - exact) / np.outer(size, size)
    assert np.abs(off).max() < 5.0 * np.sqrt(2.0 / (8 * UNITS))


def test_what_a_unit_shares_counts_once_a_unit():
    """Errors that all rows of a unit share: rows say no more together than one of them."""
    given, rng = problem(), np.random.default_rng(5)
    given = replace(given, design=np.ones((ROWS, 1)), target=np.ones((ROWS, 1)), center=np.ones((1, 1)))
    shared = SIGMA * rng.normal(size=UNITS)
    one = replace(given, target=given.target + shared[given.unit][:, None])
    one = replace(one, center=np.array([[one.target.mean()]]))
    found = covariance(one, [free(1)])[0, 0, 0]
    assert found == pytest.approx(SIGMA**2 / UNITS, rel=5.0 * np.sqrt(2.0 / UNITS))


def test_without_data_it_is_the_prior():
    given = problem()
    blind = replace(given, weight=1e-12 * given.weight, target=0.0 * given.target, center=0.0 * given.center)
    prior = Alternative(np.array([[4.0, 25.0, 100.0]]), 1.0)
    np.testing.assert_allclose(
        covariance(blind, [prior])[0], np.diag([0.25, 0.04, 0.01]), rtol=1e-4, atol=1e-8
    )


def test_shapes_without_data_are_as_unsure_as_they_are_held_to_be():
    given = problem(shapes=1)
    still = replace(given, slopes=1e-9 * given.slopes)
    assert covariance(still, [free()])[0, -1, -1] == pytest.approx(SHAPE_SPREAD**2, rel=1e-3)


def test_models_that_predict_as_well_and_say_otherwise_are_in_it():
    """Without noise two models, of three modes and of two, are both certain; what they differ by is not."""
    given = problem()
    fewer = np.linalg.lstsq(given.design[:, :2], given.target[:, 0], rcond=None)[0]
    apart = given.center[0] - np.append(fewer, 0.0)
    whole = covariance(given, [free(weight=0.7), free(2, weight=0.3)])[0]
    alone = (
        covariance(given, [free()])[0],
        covariance(replace(given, center=np.append(fewer, 0.0)[None]), [free(2)])[0],
    )
    expected = 0.3 * np.outer(apart, apart) + 0.7 * alone[0] + 0.3 * alone[1]
    np.testing.assert_allclose(whole, expected, rtol=1e-6, atol=1e-12)


def test_coefficients_at_a_bound_stay_there():
    given = noisy(problem(lobes=2), 3)
    held = replace(given, fixed=np.array([[True, False]]))
    found = covariance(held, [free()])[0]
    assert not found[MODES].any() and not found[:, MODES].any()
    assert found[MODES + 1, MODES + 1] > 0.0


def test_channels_that_share_shapes_have_one_variance_of_them_and_all_is_positive():
    given = noisy(problem(lobes=1, shapes=1, channels=2), 4)
    found = covariance(given, [free(channels=2)])
    assert found[0, -1, -1] == pytest.approx(found[1, -1, -1], rel=1e-9)
    for one in found:
        assert np.linalg.eigvalsh(one).min() > -1e-12


def test_very_many_models_that_are_the_same_are_as_one():
    """Of more than a dozen only a sample's noise is found, which then counts for all."""
    given = noisy(problem(), 6)
    one = covariance(given, [free()])
    for count in (5, 40):
        many = covariance(given, [free(weight=1.0 / count) for _ in range(count)])
        np.testing.assert_allclose(many, one, rtol=1e-9)


def test_of_few_units_it_is_no_wider_than_the_noise():
    """Of six units, each of which tells a sixth of all: leaving them out one by one alone gives 1 / (1 - 1 / 6) times
    the variance, more of parameters that one unit tells more of."""
    units, draws = 6, 400
    given = problem()
    given = replace(given, unit=np.arange(ROWS) * units // ROWS)
    design = given.design * np.where(given.unit == 0, 2.0, 1.0)[:, None]
    given = replace(given, design=design, target=design @ given.center.T)
    exact = SIGMA**2 * np.linalg.inv(design.T @ design)
    size = np.sqrt(np.diag(exact))
    found = []
    for seed in range(draws):
        one = noisy(given, seed)
        found.append(covariance(replace(one, center=solved(one)[None]), [free()])[0])
    off = (np.mean(found, axis=0) - exact) / np.outer(size, size)
    chance = np.std(found, axis=0) / np.outer(size, size) / np.sqrt(draws)
    assert (np.abs(off) < 5.0 * chance).all()


def test_where_one_unit_tells_a_parameter_it_is_never_far_too_sure():
    """One unit alone tells the second parameter: its own residuals are fitted away, so that left out alone it says
    anything between nothing and several times the truth. Of many draws the least is a good part of the truth."""
    units, draws = 12, 200
    given = problem()
    unit = np.arange(ROWS) * units // ROWS
    design = np.column_stack([np.ones(ROWS), np.where(unit == 0, np.linspace(0.9, 1.1, ROWS), 0.0)])
    given = replace(given, design=design, unit=unit, target=0.0 * given.target, center=np.zeros((1, 2)))
    shared = Common(unit, np.full((ROWS, 1), SIGMA))
    given = replace(given, common=shared)
    exact, found = 0.0, []
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        error = SIGMA * rng.normal(size=ROWS) + SIGMA * rng.normal(size=units)[unit]
        one = replace(given, target=error[:, None])
        best = _generalised(one)
        exact += best[1] ** 2 / draws
        found.append(covariance(replace(one, center=best[None]), [free(2)])[0, 1, 1])
    assert np.mean(found) == pytest.approx(exact, rel=5.0 * np.sqrt(2.0 / draws))
    assert np.min(found) > 0.7 * exact


def _generalised(given: Problem) -> np.ndarray:
    """(m,) the fit whose units' rows are weighed by their whole inverse covariance."""
    assert given.common is not None
    same = given.common.unit[:, None] == given.common.unit
    inverse = np.linalg.inv(np.diag(1.0 / given.weight[:, 0]) + SIGMA**2 * same)
    return np.linalg.solve(
        given.design.T @ inverse @ given.design, given.design.T @ inverse @ given.target[:, 0]
    )


def test_what_is_considered_moves_the_parameters_as_it_would_move_the_data():
    """Two things that the fit does not seek, of data without noise: however many rows there are, none is averaged
    away, and channels have their own."""
    given = problem(lobes=1, channels=2)
    moved = 0.1 * np.random.default_rng(7).normal(size=(ROWS, 2, 2)) + 0.05 * given.design[:, :1, None]
    found = covariance(replace(given, considered=moved), [free(channels=2)])
    without = covariance(given, [free(channels=2)])
    both = np.hstack([given.design, given.columns])
    for c in range(2):
        changes = np.linalg.lstsq(both, moved[:, :, c], rcond=None)[0]
        # the ridge and the least penalty
        assert found[c] - without[c] == pytest.approx(changes @ changes.T, rel=1e-6, abs=1e-9)


def test_what_is_considered_is_told_by_no_data():
    """It lies beside all that the parameters can be, so that data would tell it: as a shape they do, considered not."""
    given = problem(seed=3, shapes=1)
    sought = covariance(given, [free()])[0]
    plain = replace(given, slopes=np.zeros((ROWS, 0, 1)), center=given.center[:, :MODES])
    found = covariance(replace(plain, considered=given.slopes), [free()])[0]
    assert np.trace(found) > 5.0 * np.trace(sought[:MODES, :MODES])
