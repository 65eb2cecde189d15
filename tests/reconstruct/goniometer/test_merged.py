"""Neighbouring rows joined."""

from __future__ import annotations

import numpy as np

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
