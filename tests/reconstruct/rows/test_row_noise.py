"""Fits of measured rows that state no errors."""

import numpy as np
import pytest

from photogonio.reconstruct.fit import FitOptions, fit_table
from tests.drawn.goniometer import ROWS, rows_of, table_of_rows

MATTE = 0.05


@pytest.mark.parametrize("relative", [0.1, 0.3])
def test_noise_that_is_the_same_everywhere_pulls_nothing_down(relative):
    """The mean of so many rows is known to ``relative / sqrt(ROWS)``; weights by readings are off by the square of
    ``relative``, twice."""
    value, *angles = rows_of("lambert", {"albedo": (MATTE,)})
    noise = relative * value.mean() * np.random.default_rng(1).standard_normal(value.shape)
    found = fit_table(table_of_rows(value + noise, *angles), FitOptions(symmetry="isotropic")).brdf
    assert found.bihemispherical_albedo()[0] == pytest.approx(MATTE, rel=4.0 * relative / np.sqrt(ROWS))
