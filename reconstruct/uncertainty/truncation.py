"""What modes beyond the order of a fit would do to f: kinks and ridges of a surface have modes of every order.

Where folds tell one order from the next no more, the series ends, and all photos miss what is cut off alike, in ripples
about the ridges. What is left of a slowly falling series is about as much as its last terms: what the last two orders,
an even and an odd one, have changed, where they have. It is no noise, and no draw from a prior of the modes there are.
"""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.estimate.lobe_search import Fitted
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model_selection import Prior
from photogonio.reconstruct.estimate.normal_equations import cholesky, cholesky_solve
from photogonio.reconstruct.estimate.weights import independence, level
from photogonio.reconstruct.table.cells import Cells

LEAST_ORDER = 4  # of a series that falls slowly; one of lower order ends because its next terms are nothing
LAST = 2  # orders: of surfaces like Minnaert's every other one is all but empty
RIDGE = 1e-9  # of the mean diagonal


def last_terms(fitted: Fitted, cells: Cells, deviation: np.ndarray, prior: Prior) -> np.ndarray | None:
    """(n, c) what the last orders of the fit change at its ``cells``, 1/sr, beside a fit without them; None of a series
    that has ended by itself. ``deviation`` (n, c) is the cells' error model, ``prior`` that of the fit."""
    model = fitted.model
    if model.turning or not cells.binned or model.basis.order < LEAST_ORDER:
        return None
    own, fewer = len(model.coefficients), len(Basis(model.basis.symmetry, model.basis.order - LAST).modes)
    known = np.hstack([model.basis.design(cells), model.lobes.columns(cells)[1]])
    last, rest = known[:, fewer:own], known[:, np.r_[:fewer, own : known.shape[1]]]
    weight = np.mean(independence(cells) * fitted.weight / (deviation * fitted.scale) ** 2, axis=1)
    weighed = rest.T * weight
    normal = weighed @ rest
    every = np.arange(len(normal))
    normal[every[:fewer], every[:fewer]] += prior.precision(model.basis.degree()[:fewer], level(cells)).mean(
        0
    )
    normal[every, every] += RIDGE * np.trace(normal) / len(normal)
    taken = cholesky_solve(cholesky(normal), weighed @ last)  # what the others would make of the last ones
    return (last - rest @ taken) @ model.coefficients[fewer:]
