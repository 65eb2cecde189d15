"""Neighbouring rows joined."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.goniometer.merged import MOST, merged
from tests.drawn.goniometer import SATIN, measured, satin, scattered


def test_very_many_rows_are_joined():
    """Means of neighbours: values of the mean direction but for the curvature within a cell, noise as of a mean."""
    table = measured(SATIN, scattered(60000), noise=0.02)
    joined = merged(table)
    assert MOST / 4 < len(joined.value) <= MOST and "60000 rows joined" in joined.notes[-1]
    true = satin(joined.incident, joined.exit)[:, 0]
    ratio = joined.value[:, 0] / true
    assert abs(np.mean(ratio) - 1.0) < 0.002 and np.std(ratio) < 0.02
    few = measured(SATIN, scattered(1000))
    assert merged(few) is few


def test_a_mean_of_rows_is_as_sure_as_means_are():
    """Of equal errors s, that of n rows is s / sqrt(n); and rows' sums are kept."""
    table = measured(SATIN, scattered(30000), noise=0.05)
    table = replace(table, sigma=np.full_like(table.value, 0.01))
    joined = merged(table)
    count = (0.01 / joined.sigma) ** 2
    np.testing.assert_allclose(count, np.round(count), rtol=1e-9)
    assert count.sum() == 30000 and count.min() >= 1.0
    assert (count * joined.value).sum() == pytest.approx(table.value.sum(), rel=1e-9)
    assert joined.line is None


def test_a_peak_is_not_made_flat():
    """Where values differ by more than noise, the row nearest to the middle stands for its neighbours."""
    table = measured(SATIN, scattered(30000), noise=0.0)
    joined = merged(table)
    assert len(joined.value) <= MOST
    true = satin(joined.incident, joined.exit)
    np.testing.assert_allclose(joined.value[:, 0], true[:, 0], rtol=2e-3)
