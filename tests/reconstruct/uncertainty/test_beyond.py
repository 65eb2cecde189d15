"""Tables of what no parameter says: small, on the high side, the same for twins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import qmc

from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.beyond import HIGHEST, MOST, NOTHING, Sampled, halton, tables_of

N = 400
CERTAIN = np.zeros((1, 1, 1))
F = 0.3  # 1/sr


def cells() -> Cells:
    unit = qmc.Halton(3, scramble=False).random(N)
    return Cells.of_angles(*np.radians(HIGHEST) * unit[:, :2].T, np.pi * unit[:, 2])


def sampled(missed: np.ndarray | float, total: np.ndarray | float, scale: float = 0.0) -> Sampled:
    """Errors relative to f, of a surface that is the same everywhere and of one parameter that is certain."""
    one = np.full((N, 1), F)
    return Sampled(cells(), one, one, one * missed, one * total, scale, np.zeros((N, 1, 1)))


def said(table, where: Cells) -> np.ndarray:
    return table.at(where.theta_i, where.theta_r, where.dphi)[:, None]


def test_evenly_spread_numbers_are_scipys():
    ours = np.stack([halton(N, base) for base in (2, 3, 5)], axis=1)
    assert ours == pytest.approx(qmc.Halton(3, scramble=False).random(N), abs=1e-15)


def test_of_nothing_there_is_no_table():
    missed, unseen = tables_of(sampled(0.0, 0.0), CERTAIN, 1.0)
    assert missed is None and unseen is None
    assert tables_of(sampled(0.5 * NOTHING, 0.0), CERTAIN, 1.0)[0] is None


def test_what_is_the_same_everywhere_is_one_number():
    missed, unseen = tables_of(sampled(0.031, 0.0), CERTAIN, 1.0)
    assert missed.relative.shape == (1, 1, 1) and unseen is None
    assert missed.relative.item() == pytest.approx(0.031)
    wider = tables_of(sampled(0.031, 0.0), CERTAIN, 2.0)[0]
    assert wider.relative.item() == pytest.approx(0.062)


def test_what_parameters_say_is_not_said_again_and_the_scale_is_apart():
    """The rest of the variance: 0.05^2 less 0.03^2 of the parameters is 0.04^2."""
    _, unseen = tables_of(sampled(0.0, 0.05, scale=0.02), CERTAIN, 1.0)
    assert unseen.relative.item() == pytest.approx(0.05)
    known = replace(sampled(0.0, 0.05), change=np.ones((N, 1, 1)))
    _, unseen = tables_of(known, np.full((1, 1, 1), (F * 0.03) ** 2), 1.0)
    assert unseen.relative.item() == pytest.approx(0.04)
    _, unseen = tables_of(known, np.full((1, 1, 1), (F * 0.06) ** 2), 1.0)
    assert unseen is None


def test_what_grows_toward_grazing_is_said_on_the_high_side_and_alike_for_twins():
    where = cells()
    steep = 0.01 + 0.1 * np.maximum(where.theta_i, where.theta_r)[:, None] ** 2
    missed, _ = tables_of(sampled(steep, 0.0), CERTAIN, 1.0)
    np.testing.assert_array_equal(missed.relative, np.swapaxes(missed.relative, 0, 1))
    off = said(missed, where) - steep
    assert np.mean(off) > 0.0 and np.mean(off > -0.1 * steep) > 0.75
    assert np.mean(np.abs(off)) < 0.5 * steep.mean()


def test_where_f_is_all_but_nothing_its_error_is_so_many_times_as_large_at_most():
    missed, _ = tables_of(sampled(100.0, 0.0), CERTAIN, 1.0)
    assert missed.relative.max() == pytest.approx(MOST)
