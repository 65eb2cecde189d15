"""The GGX lobe against the oracle, and where formulas usually break."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from photogonio.reconstruct.lobes.schlick import ggx
from tests import oracles


@pytest.mark.parametrize("alpha", [0.05, 0.3, 1.0])
def test_against_the_oracle(alpha):
    rng = np.random.default_rng(0)
    for theta_i, theta_r, dphi in rng.uniform(0, [1.5, 1.5, 6.3], (60, 3)):
        for f0 in (0.04, 1.0):
            exact = oracles.ggx(theta_i, theta_r, dphi, alpha, f0)
            assert ggx(theta_i, theta_r, dphi, alpha, f0) == pytest.approx(
                exact, rel=1e-9
            )  # oracle: 1 - cos^2


def test_reciprocal_and_even():
    theta_i, theta_r, dphi = np.random.default_rng(1).uniform(0, [[1.57], [1.57], [7]], (3, 500))
    f = ggx(theta_i, theta_r, dphi, 0.1, 0.04)
    assert f == pytest.approx(ggx(theta_r, theta_i, -dphi, 0.1, 0.04), rel=1e-12)
    assert (f > 0).all()


def test_narrow_lobes_keep_their_digits():
    """alpha = 1e-4, a ten-thousandth of a radian off the mirror direction: 1 - cos^2 would leave 8 digits."""
    theta, off, alpha = mp.mpf("0.8"), mp.mpf("1e-4"), mp.mpf("1e-4")
    i = mp.matrix([mp.sin(theta), 0, mp.cos(theta)])
    r = mp.matrix([-mp.sin(theta + off), 0, mp.cos(theta + off)])
    h = (i + r) / mp.norm(i + r)
    d = alpha**2 / (mp.pi * (h[2] ** 2 * (alpha**2 - 1) + 1) ** 2)

    def smith(v):
        return (mp.sqrt(1 + alpha**2 * (1 - v[2] ** 2) / v[2] ** 2) - 1) / 2

    exact = d / (1 + smith(i) + smith(r)) / (4 * i[2] * r[2])
    got = ggx(0.8, float(theta + off), np.pi, 1e-4, 1.0)
    # rounding of the angles themselves moves them by 1e-16, of the lobe's width 1e-12
    assert got == pytest.approx(float(exact), rel=1e-11)


def test_shapes():
    theta = np.linspace(0, 1.5, 6)
    assert ggx(theta[:, None], theta[None], 0.1, 0.3, 0.04).shape == (6, 6)
    assert ggx(theta[:, None], theta[None], 0.1, 0.3, np.array([0.04, 0.1])).shape == (6, 6, 2)
    assert ggx(0.1, 0.2, 0.3, 0.3, 0.04).shape == ()
    assert ggx(np.empty(0), 0.2, 0.3, 0.3, [0.04]).shape == (0, 1)
    colour = ggx(theta, 0.4, 1.0, 0.3, np.array([0.04, 0.9]))
    assert np.array_equal(colour[:, 0], ggx(theta, 0.4, 1.0, 0.3, 0.04))


def test_normal_and_grazing():
    right = np.pi / 2
    assert ggx(0.0, 0.0, 0.0, 0.2, 1.0) == pytest.approx(1 / (4 * np.pi * 0.04), rel=1e-14)
    one = ggx(np.array([right, 0.3]), np.array([0.3, right]), 1.0, 0.2, 0.04)
    assert np.isfinite(one).all() and one[0] == pytest.approx(one[1], rel=1e-12)
    for dphi in (0.0, 1.0, np.pi):
        both = ggx(right, right, dphi, 0.2, 0.04)
        assert np.isfinite(both) and both > 1e10  # unbounded there; large, not NaN
    near = ggx(right - 1e-6, right - 1e-6, np.pi, 0.2, 0.04)
    # h is the normal, F is 1 (i.h = 1e-6), G2 / (4 cos cos) = 1 / (4 alpha 1e-6)
    assert near == pytest.approx(1 / (np.pi * 0.04) / (4 * 0.2 * 1e-6), rel=2e-5)
