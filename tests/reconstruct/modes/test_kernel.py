"""Compiled sums over modes: lanes know nothing of one another, and their sine is to rounding."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.modes import basis as m
from photogonio.reconstruct.modes.kernel import HALF_PI_REST, LANES, TURN, TURN_REST, short_sine


def angles(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    return *rng.uniform(0.0, np.pi / 2, (2, n)), rng.uniform(-40.0, 40.0, n)


def test_the_short_sine_is_the_sine_to_rounding():
    x = np.linspace(-np.pi / 2, np.pi / 2, 2001)
    np.testing.assert_allclose([short_sine(one) for one in x], np.sin(x), rtol=4 * np.finfo(float).eps)
    assert short_sine(np.pi / 2) == pytest.approx(1.0, abs=2e-16)


def test_what_constants_leave_of_pi_is_what_they_say():
    """In long arithmetic: pi = 3.14159265358979323846264338327950288."""
    import mpmath as mp

    with mp.workdps(40):
        assert abs(mp.mpf(np.pi / 2) + mp.mpf(HALF_PI_REST) - mp.pi / 2) < mp.mpf(10) ** -32
        assert abs(mp.mpf(TURN) + mp.mpf(TURN_REST) - 2 * mp.pi) < mp.mpf(10) ** -22
        assert all(float(k * TURN) == k * mp.mpf(TURN) for k in range(1, 2**20, 9973))  # exact multiples


@pytest.mark.parametrize("count", [1, LANES - 1, LANES, LANES + 1, 3 * LANES + 5])
def test_a_pairs_value_does_not_depend_on_its_company(count):
    modes = m.isotropic_modes(5)
    own = np.random.default_rng(1).normal(size=(len(modes), 4))
    every = angles(4 * LANES)
    whole = m.evaluate_isotropic(modes, own, *every)
    np.testing.assert_array_equal(
        m.evaluate_isotropic(modes, own, *(a[:count] for a in every)), whole[:count]
    )
    design = m.isotropic_design(5, *every)
    np.testing.assert_array_equal(m.isotropic_design(5, *(a[:count] for a in every)), design[:count])


def test_a_pair_that_is_no_number_spoils_no_other():
    modes = m.isotropic_modes(3)
    own = np.ones((len(modes), 1))
    i, r, d = angles(LANES)
    whole = m.evaluate_isotropic(modes, own, i, r, d)
    for spoilt in ((i, 7), (r, 11), (d, 13)):
        spoilt[0][spoilt[1]] = np.nan
    found = m.evaluate_isotropic(modes, own, i, r, d)
    bad = np.isin(np.arange(LANES), [7, 11, 13])
    assert np.isnan(found[bad]).all()
    np.testing.assert_array_equal(found[~bad], whole[~bad])
