"""Rows of weighted least squares, drawn."""

import numpy as np

EXACT = 1e-9  # relative; normal equations of condition about 1e3 lose this much of double precision


def problem(seed, n=300, m=6, q=2, channels=2, folds=4):
    rng = np.random.default_rng(seed)
    design, columns = rng.normal(size=(n, m)), np.abs(rng.normal(size=(n, q)))
    weight, fold = rng.uniform(0.2, 3.0, (n, channels)), rng.integers(0, folds, n)
    target = rng.normal(size=(n, channels)) + columns.sum(1)[:, None]
    return design, columns, weight, fold, target
