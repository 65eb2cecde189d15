"""Noise of known make is told back, and intervals by rows left out hold as many fresh ones."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.rows.noise_told import NoiseTold, fresh_reading, noise_told
from photogonio.reconstruct.table.cells import Cells

ROWS = 4000


def rows(seed=0):
    rng = np.random.default_rng(seed)
    theta = np.arccos(rng.uniform(np.cos(1.4), 1.0, (2, ROWS)))
    cells = Cells.of_angles(*theta, rng.uniform(0.0, np.pi, ROWS))
    return cells, 0.1 + np.exp(rng.normal(size=(ROWS, 1))), rng


@pytest.mark.parametrize(
    ("constant", "relative", "grazing"),
    [(0.1, 0.0, 0.0), (0.0, 0.05, 0.0), (0.05, 0.05, 0.0), (0.03, 0.0, 0.05)],
)
def test_noise_of_known_parts_is_told_back(constant, relative, grazing):
    """The variance that is told is right within a few of its own relative errors, sqrt(2 / ROWS) for each part."""
    cells, value, rng = rows()
    made = NoiseTold(np.array([constant]), np.array([relative]), np.array([grazing]))
    cells = replace(cells, value=value + made.at(cells, value) * rng.normal(size=value.shape))
    found = noise_told(cells, value, np.zeros(ROWS))
    ratio = found.at(cells, value) / made.at(cells, value)
    assert np.mean(ratio) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / ROWS))
    assert np.quantile(np.abs(ratio - 1.0), 0.9) < 0.15


def test_rows_that_pull_a_fit_to_themselves_are_noisier_than_what_it_misses_of_them():
    cells, value, rng = rows()
    missed = 0.1 * np.sqrt(0.5) * rng.normal(size=value.shape)
    found = noise_told(replace(cells, value=value + missed), value, np.full(ROWS, 0.5))
    assert found.at(cells, value).mean() == pytest.approx(0.1, rel=0.05)


@pytest.mark.parametrize("shape", ["normal", "laplace"])
def test_intervals_hold_what_they_say_whatever_the_distribution_is(shape):
    """Left-out and fresh rows are alike here, so the share is 95 % within its own error."""
    cells, value, rng = rows()
    noise = NoiseTold(np.array([0.1]), np.array([0.0]), np.array([0.0]))
    draw = getattr(rng, shape)
    fresh = fresh_reading(
        replace(cells, value=value + draw(scale=0.3, size=value.shape)), noise, value, 0.0 * value
    )
    half = 1.959964 * fresh.deviation(cells, value, 0.0 * value)
    held = np.mean(np.abs(draw(scale=0.3, size=value.shape)) <= half)
    assert held == pytest.approx(0.95, abs=5.0 * np.sqrt(0.95 * 0.05 / ROWS))
