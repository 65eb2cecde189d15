"""Sums of several folds, and the bounded solve from them, against direct least squares."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from photogonio.reconstruct.estimate.folded_design import FoldedDesign
from photogonio.reconstruct.estimate.normal_equations import (
    Factors,
    cholesky,
    residual_each,
    solve,
    solve_each,
    without_each,
)
from tests.drawn.designs import EXACT, problem


def test_prefix_total_and_without_each_are_direct_sums():
    design, columns, weight, fold, target = problem(1)
    sums = FoldedDesign(design, weight, fold).statistics(target, columns)
    fewer = FoldedDesign(design[:, :3], weight, fold).statistics(target, columns)
    part = sums.prefix(3)
    np.testing.assert_allclose(part.gram, fewer.gram, atol=1e-10)
    np.testing.assert_allclose(part.moment, fewer.moment, atol=1e-10)
    assert part.modes == 3
    whole = FoldedDesign(design, weight, np.zeros(300, int)).statistics(target, columns)
    np.testing.assert_allclose(sums.total().gram, whole.gram, atol=1e-10)
    np.testing.assert_allclose(sums.total().square, whole.square, rtol=1e-12)
    rest = sums.without_each()
    for f in range(4):
        others = fold != f
        direct = FoldedDesign(design[others], weight[others], np.zeros(others.sum(), int))
        left = direct.statistics(target[others], columns[others])
        np.testing.assert_allclose(rest.gram[f], left.gram[0], atol=1e-10)
        np.testing.assert_allclose(rest.moment[f], left.moment[0], atol=1e-10)
        assert rest.cells[f] == left.cells[0]


@pytest.mark.parametrize("upper", [(np.inf, np.inf), (0.5, np.inf), (0.3, 0.4)])
@pytest.mark.parametrize("seed", range(6))
def test_bounded_solution_is_that_of_a_general_solver(seed, upper):
    design, columns, weight, fold, target = problem(seed)
    rng = np.random.default_rng(100 + seed)
    target = target - columns @ rng.normal(scale=2.0, size=(2, 1))  # some bounds become active, some do not
    penalty = rng.uniform(0.0, 30.0, (2, design.shape[1]))
    sums = FoldedDesign(design, weight, np.zeros(len(fold), int)).statistics(target, columns)
    found = solve(sums, Factors(sums.modes_gram, penalty), np.array(upper))[0]
    low = np.r_[np.full(6, -np.inf), 0.0, 0.0]
    high = np.r_[np.full(6, np.inf), upper]
    for c in range(2):
        root = np.sqrt(weight[:, c, None])
        rows = np.vstack([root * np.hstack([design, columns]), np.eye(6, 8) * np.sqrt(penalty[c])[:, None]])
        wanted = lsq_linear(rows, np.r_[root[:, 0] * target[:, c], np.zeros(6)], (low, high), tol=1e-14)
        np.testing.assert_allclose(found[c], wanted.x, rtol=1e-6, atol=1e-6)
        assert (found[c, 6:] >= 0.0).all() and (found[c, 6:] <= upper).all()


def test_residual_is_the_weighted_sum_of_squares():
    design, columns, weight, fold, target = problem(3)
    sums = FoldedDesign(design, weight, fold).statistics(target, columns)
    x = np.random.default_rng(9).normal(size=(4, 2, 8))
    for f in range(4):
        rows = fold == f
        direct = target[rows] - np.hstack([design, columns])[rows] @ x[f].T
        np.testing.assert_allclose(sums.residual(x)[f], np.sum(weight[rows] * direct**2, axis=0), rtol=EXACT)


def test_sets_of_lobes_tried_together_are_those_tried_alone():
    design, columns, weight, fold, target = problem(7, q=3)
    folded = FoldedDesign(design, weight, fold)
    several = [folded.statistics(target + q, columns[:, :q]) for q in range(4)]
    uppers = [np.full(q, 0.6) for q in range(4)]
    rests = without_each(several)
    factors = Factors(rests[0].modes_gram, np.ones((2, 6)))
    found = solve_each(rests, factors, uppers)
    for one, rest, solution, upper, missed in zip(
        several, rests, found, uppers, residual_each(several, found), strict=True
    ):
        np.testing.assert_array_equal(rest.gram, one.without_each().gram)
        np.testing.assert_allclose(solution, solve(one.without_each(), factors, upper), rtol=EXACT)
        np.testing.assert_allclose(missed, one.residual(solution), rtol=EXACT)


def test_a_matrix_that_is_not_positive_is_refused():
    with pytest.raises(np.linalg.LinAlgError):
        cholesky(np.diag([1.0, -1.0]))


def test_modes_that_the_data_cannot_tell_apart_stay_bounded():
    """Two equal columns under the same prior share the coefficient."""
    rng = np.random.default_rng(4)
    one = rng.normal(size=(80, 1))
    design, weight = np.hstack([one, one]), np.ones((80, 1))
    sums = FoldedDesign(design, weight, np.zeros(80, int)).statistics(3.0 * one, np.empty((80, 0)))
    found = solve(sums, Factors(sums.modes_gram, np.full((1, 2), 1e-6)), np.empty(0))[0, 0]
    np.testing.assert_allclose(found, 1.5, rtol=1e-6)
