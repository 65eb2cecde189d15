"""Evidence and left-out rows from sums, beside what whole covariance matrices and fits anew say."""

import numpy as np
import pytest

from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.lobes.families import second_lobe
from photogonio.reconstruct.rows.row_evidence import NOISE, RowEvidence
from photogonio.reconstruct.rows.smooth_ridge import DECAY
from photogonio.reconstruct.table.cells import cells_of
from tests.drawn.goniometer import rows_of, table_of_rows

ORDER = 4


@pytest.fixture(scope="module")
def rows():
    value, *angles = rows_of("plastic", {"albedo": (0.3,), "roughness": 0.3})
    few = np.arange(0, len(value), 9)
    noisy = value[few] * (1.0 + 0.05 * np.random.default_rng(0).normal(size=(len(few), 1)))
    cells = cells_of(table_of_rows(noisy, *(angle[few] for angle in angles)))
    lobes = LobeSet((second_lobe(absolute=False),), (np.array([0.3]),))
    deviation = np.where(cells.theta_i > 0.7, 1.0, 2.0)[:, None] * np.ones_like(cells.value)
    return RowEvidence.of(cells, deviation, ORDER, (LobeSet(), lobes))


def by_whole_matrices(rows, k, ratio):
    """Restricted log likelihood, its scale profiled out, but for a constant of the rows alone."""
    root = np.sqrt(rows.weight)
    smooth = root * rows.design[:, 1:] * rows.degree[1:] ** -DECAY
    free = root * np.hstack([rows.design[:, :1], rows.columns[k]])
    y, inverse = root * rows.value, np.linalg.inv(smooth @ smooth.T + ratio * np.eye(len(rows.value)))
    inner = free.T @ inverse @ free
    rest = y - free @ np.linalg.solve(inner, free.T @ inverse @ y)
    freedom = len(y) - free.shape[1]
    logs = -np.linalg.slogdet(inverse)[1] + np.linalg.slogdet(inner)[1]
    return float(-0.5 * freedom * np.log((rest.T @ inverse @ rest)[0, 0] / freedom) - 0.5 * logs)


def test_evidence_is_that_of_the_whole_covariance(rows):
    found, ratio = rows.evidence()
    for k, (one, at) in enumerate(zip(found, ratio, strict=True)):
        assert one == pytest.approx(by_whole_matrices(rows, k, at), abs=1e-3)
        near = NOISE[[max(np.argmin(np.abs(NOISE - at)) - 1, 0)]]
        assert by_whole_matrices(rows, k, near[0]) <= one + 1e-3


def test_rows_left_out_are_those_of_a_fit_without_them(rows):
    ratio = 0.01
    said, penalty = rows.left_out(0, ratio), np.diag(ratio * rows.degree ** (2.0 * DECAY))
    spread, _ = rows.spread(ratio)
    for f in range(rows.fold.max() + 1):
        out = rows.fold == f
        design, weight = rows.design[~out], rows.weight[~out]
        gram = design.T @ (weight * design) + penalty
        own = np.linalg.solve(gram, design.T @ (weight * rows.value[~out]))
        np.testing.assert_allclose(said[out], rows.design[out] @ own, rtol=1e-6, atol=1e-9)
        variance = np.einsum("np,pq,nq->n", rows.design[out], np.linalg.inv(gram), rows.design[out])
        np.testing.assert_allclose(spread[out], variance, rtol=1e-4)


def test_each_row_is_predicted_by_a_fit_of_all_others(rows):
    ratio, k = 0.01, 1
    every = np.hstack([rows.design, rows.columns[k]])
    penalty = np.zeros(every.shape[1])
    penalty[: len(rows.degree)] = ratio * rows.degree ** (2.0 * DECAY)
    missed, spread = np.empty(len(every)), np.empty(len(every))
    for i in range(len(every)):
        rest = np.arange(len(every)) != i
        gram = every[rest].T @ (rows.weight[rest] * every[rest]) + np.diag(penalty)
        own = np.linalg.solve(gram, every[rest].T @ (rows.weight[rest, 0] * rows.value[rest, 0]))
        missed[i] = rows.value[i, 0] - every[i] @ own
        spread[i] = 1.0 / rows.weight[i, 0] + every[i] @ np.linalg.solve(gram, every[i])
    found = rows.each_by_others(k, ratio)
    size = np.mean(missed**2 / spread)
    # densities of readings, but for the constant and the weights, which are those of every candidate
    expected = -0.5 * (np.log(size * spread * rows.weight[:, 0]) + missed**2 / (size * spread))
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6)


def test_rows_that_the_others_do_not_tell_are_told_infinitely_ill_and_nothing_overflows():
    """A table whose angles are hours: all directions within a degree or two, but for a few rows."""
    value, *angles = rows_of("plastic", {"albedo": (0.3,), "roughness": 0.3})
    few = np.arange(0, len(value), 9)
    cells = cells_of(table_of_rows(value[few], *(angle[few] for angle in angles)))
    evidence = RowEvidence.of(cells, np.ones_like(cells.value), ORDER, (LobeSet(),))
    evidence.design[0] = 1e200
    assert not np.isnan(evidence.spread(1e-3)).any()
