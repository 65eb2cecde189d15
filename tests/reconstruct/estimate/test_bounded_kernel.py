"""Small bounded problems, against a general solver, and the elimination they take."""

import itertools

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from photogonio.reconstruct.estimate.bounded_kernel import bounded, solved


@pytest.mark.parametrize("q", [1, 3])
def test_bounded_is_the_least_within_bounds(q):
    """Whatever bounds are active: each of them is in some of the problems."""
    rng = np.random.default_rng(q)
    rows, target = rng.normal(size=(40, 6, q)), rng.normal(size=(40, 6))
    upper = np.array([0.4, np.inf, 0.2])[:q]
    gram, moment = np.einsum("nki,nkj->nij", rows, rows), np.einsum("nki,nk->ni", rows, target)
    patterns = np.array(sorted(itertools.product(range(3), repeat=q), key=lambda one: -one.count(0)))
    patterns = patterns[(patterns != 2)[:, np.isinf(upper)].all(1)]
    found = np.empty((40, q))
    bounded(gram, moment, upper, patterns, found)
    for n in range(40):
        wanted = lsq_linear(rows[n], target[n], (np.zeros(q), upper), tol=1e-14).x
        np.testing.assert_allclose(found[n], wanted, atol=1e-6)
    assert (found == 0.0).any() and (found == upper).any() and ((found > 0.0) & (found < upper)).any()


def test_solved_takes_the_largest_pivot():
    matrix = np.array([[0.0, 2.0, 9.0], [1.0, 1.0, 9.0], [9.0, 9.0, 9.0]])
    right = np.array([4.0, 5.0, 7.0])
    solved(matrix, right, 2)
    np.testing.assert_allclose(right, [3.0, 2.0, 7.0])
