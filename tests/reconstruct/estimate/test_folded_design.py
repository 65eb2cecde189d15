"""Sums kept a fold apart are those of the weighted rows, with errors that units share too."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.folded_design import Common, FoldedDesign
from tests.drawn.designs import EXACT, problem


def test_sums_are_those_of_the_weighted_rows_of_each_fold():
    design, columns, weight, fold, target = problem(0)
    sums = FoldedDesign(design, weight, fold).statistics(target, columns)
    full = np.hstack([design, columns])
    for f in range(4):
        rows = fold == f
        assert sums.cells[f] == rows.sum()
        for c in range(2):
            x, w, y = full[rows], weight[rows, c], target[rows, c]
            np.testing.assert_allclose(sums.gram[f, c], (x * w[:, None]).T @ x, rtol=0, atol=1e-11 * 300)
            np.testing.assert_allclose(sums.moment[f, c], x.T @ (w * y), rtol=0, atol=1e-11 * 300)
            assert sums.square[f, c] == pytest.approx(np.sum(w * y * y), rel=1e-12)


def test_each_fold_is_said_by_its_own_coefficients():
    design, _, weight, fold, _ = problem(1)
    coefficients = np.random.default_rng(2).normal(size=(4, 2, design.shape[1]))
    said = FoldedDesign(design, weight, fold).said(coefficients)
    np.testing.assert_allclose(said, np.einsum("nm,ncm->nc", design, coefficients[fold]), rtol=0, atol=1e-12)


def test_common_errors_weigh_a_unit_by_its_whole_inverse_covariance():
    design, columns, weight, fold, target = problem(5, n=200)
    rng = np.random.default_rng(6)
    unit = 3 * fold + rng.integers(0, 3, 200)  # three units in each fold
    common = Common(unit, rng.normal(size=(200, 2)))
    sums = FoldedDesign(design, weight, fold, common).statistics(target, columns)
    full = np.hstack([design, columns])
    for f in range(4):
        rows = fold == f
        for c in range(2):
            same = unit[rows, None] == unit[None, rows]
            along = common.pattern[rows, c]
            inverse = np.linalg.inv(np.diag(1 / weight[rows, c]) + same * np.outer(along, along))
            x, y = full[rows], target[rows, c]
            np.testing.assert_allclose(sums.gram[f, c], x.T @ inverse @ x, rtol=EXACT, atol=EXACT * 100)
            np.testing.assert_allclose(sums.moment[f, c], x.T @ inverse @ y, rtol=EXACT, atol=EXACT * 100)
            assert sums.square[f, c] == pytest.approx(y @ inverse @ y, rel=EXACT)
            # what is left of the residual is weighed as if it were independent
            left = (target - common.shared(target, weight))[rows, c]
            np.testing.assert_allclose(x.T @ (weight[rows, c] * left), sums.moment[f, c], atol=EXACT * 100)
