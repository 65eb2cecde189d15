"""What medians tell: as normal errors' standard deviations, whatever a third of the values does."""

import numpy as np
import pytest

from photogonio.capture import robust

COUNT = 20_000
RNG = np.random.default_rng(3)


def test_normal_errors_are_told_by_their_middle():
    values = 5.0 + 2.0 * RNG.normal(size=(COUNT, 2))
    # a median's size has a standard error of 1.17 / sqrt(n)
    assert robust.scatter(values, axis=0) == pytest.approx(2.0, rel=4 * 1.17 / np.sqrt(COUNT))
    assert robust.deviation(values[:, 0] - 5.0) == pytest.approx(2.0, rel=4 * 1.17 / np.sqrt(COUNT))


def test_wild_values_hardly_count():
    values = RNG.normal(size=COUNT)
    values[: COUNT // 20] = 1e6
    assert robust.scatter(values) < 1.15


def test_a_median_is_as_sure_as_is_said():
    medians = np.median(RNG.normal(size=(2000, 101)), axis=1)
    assert medians.std() == pytest.approx(robust.median_error(1.0, 101), rel=4 / np.sqrt(2 * 2000) + 0.01)


def test_losses_are_squares_near_nothing_and_end():
    small = np.array([1e-4, -1e-4])
    np.testing.assert_allclose(robust.rooted_cauchy(small, 2.0), small, rtol=1e-6)
    assert robust.rooted_cauchy(np.array([1e6]), 2.0)[0] < 12.0
    assert robust.tukey_weight(np.array([0.0, 5.0, 9.0]), 5.0).tolist() == [1.0, 0.0, 0.0]


def test_median_is_numpys():
    """Of odd and even counts, of any shape and type; NaN where one is, or where there is none."""
    rng = np.random.default_rng(5)
    for shape in ((1,), (2,), (7,), (40,), (3, 4)):
        for kind in (np.float64, np.float32):
            values = rng.normal(size=shape).astype(kind)
            assert robust.median(values) == np.median(values)
            assert robust.median(values).dtype == kind
    assert robust.median(np.array([3, 1, 4, 2])) == 2.5
    assert np.isnan(robust.median(np.array([1.0, np.nan, 2.0]))) and np.isnan(robust.median(np.empty(0)))
