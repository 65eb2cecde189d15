"""Modes that were asked for, alone, beside plain least squares."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.model_selection import NO_PRIOR, Candidate, Prior
from photogonio.reconstruct.fit import FitOptions, fit_table
from photogonio.reconstruct.rows.well_determined import ROWS_A_MODE, WORSE, close_to_rows
from photogonio.reconstruct.table.cells import cells_of
from tests.drawn.goniometer import rows_of, table_of_rows


@pytest.mark.parametrize("order", [4, 8])
@pytest.mark.parametrize(
    ("name", "parameters"),
    [("ggx-conductor", {"f0": (0.8,), "roughness": 0.3}), ("oren-nayar", {}), ("phong", {"power": 20.0})],
)
def test_modes_alone_follow_the_rows_as_least_squares_do(name, parameters, order):
    value, *angles = rows_of(name, parameters)
    table = table_of_rows(value, *angles)
    cells, basis = cells_of(table), Basis("isotropic", order)
    design = basis.design(cells)
    plain = np.linalg.lstsq(design, value, rcond=None)[0]
    least = np.linalg.norm(design @ plain - value)
    asked = FitOptions(order=order, lobes=0, symmetry="isotropic", physics="off")
    found = fit_table(table, asked)
    assert np.linalg.norm(found.predicted - value) <= 1.1 * least
    bare = FitOptions(order=order, lobes=0, symmetry="isotropic", physics="off", robust=False, smooth=False)
    np.testing.assert_allclose(
        fit_table(table, bare).model.coefficients, plain, atol=1e-6 * np.abs(plain).max()
    )


STRENGTHS = (1e-4, 1e-2, 1.0, 1e2, np.inf)


def candidates(order: int) -> list[Candidate]:
    return [Candidate(order, Prior(one, 1.0), LobeSet(), np.ones(3)) for one in STRENGTHS]


def test_priors_that_cost_what_the_rows_show_are_let_go():
    """Those are left whose misfit, found here from the rows themselves, is near that of least squares."""
    value, *angles = rows_of("oren-nayar", {})
    cells, basis = cells_of(table_of_rows(value, *angles)), Basis("isotropic", 4)
    kept = close_to_rows(candidates(4), cells, np.ones_like(value), "isotropic")
    design, size = basis.design(cells), np.median(np.abs(value))

    def misfit(prior: Prior) -> float:
        root = basis.degree() ** prior.decay / (prior.strength * size)
        both = np.vstack([design, np.diag(root)])
        own = np.linalg.lstsq(both, np.append(value[:, 0], np.zeros(len(root))), rcond=None)[0]
        return float(np.linalg.norm(design @ own - value[:, 0]))

    least = misfit(NO_PRIOR)
    expected = [one.prior for one in candidates(4) if misfit(one.prior) <= WORSE * least]
    assert [one.prior for one in kept] == expected and 0 < len(expected) < len(STRENGTHS)


def test_rows_that_do_not_determine_the_modes_choose_nothing():
    value, *angles = rows_of("oren-nayar", {})
    few = ROWS_A_MODE * len(Basis("isotropic", 4).modes) - 1
    cells = cells_of(table_of_rows(value, *angles)).take(np.arange(few))
    tried = candidates(4)
    assert close_to_rows(tried, cells, np.ones((few, 1)), "isotropic") == tried
