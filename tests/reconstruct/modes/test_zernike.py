"""The hemisphere basis against the oracle, and the identities it must keep."""

from __future__ import annotations

from functools import reduce
from math import comb

import mpmath as mp
import numpy as np
import pytest

from photogonio.reconstruct.modes import zernike as z
from photogonio.reconstruct.modes.quadrature import elevation_rule
from tests import oracles


@pytest.mark.parametrize("n", [45, 100, 200])
def test_radial_polynomials_to_high_order(n):
    """Within 1e-12 of the polynomial's maximum, which is 1, at rho = 1."""
    rho = np.concatenate([[1e-6, 1e-3], np.linspace(0.03, 0.99, 17), 1 - np.logspace(-3, -12, 4)])
    sequence = z.radial_sequence(n, rho)
    squares = [mp.mpf(float(r)) ** 2 for r in rho]
    for l in range(n % 2, n + 1, 2):
        k = (n - l) // 2
        terms = [(-1) ** s * comb(n - s, s) * comb(n - 2 * s, k - s) for s in range(k + 1)]
        sums = [reduce(lambda total, term, q=q: total * q + term, terms, mp.mpf(0)) for q in squares]
        exact = [float(mp.mpf(float(r)) ** l * value) for r, value in zip(rho, sums, strict=True)]
        assert np.abs(sequence[z.radial_index(n, l)] - exact).max() < 1e-12


def test_printed_sum_and_recurrence_agree():
    rho = np.linspace(0, 1, 7)
    for n in range(9):
        for l in range(n % 2, n + 1, 2):
            exact = [float(oracles.radial(n, l, r)) for r in rho]
            assert np.abs(z.radial(n, l, rho) - exact).max() < 1e-14


def test_exact_at_both_ends():
    ends = z.radial_sequence(200, np.array([0.0, 1.0]))
    n = z.recurrence(200).n
    l = z.recurrence(200).l
    assert (ends[:, 1] == 1.0).all()
    assert (ends[l > 0, 0] == 0.0).all()
    assert np.abs(ends[l == 0, 0] - np.where(n[l == 0] % 4 == 0, 1.0, -1.0)).max() < 1e-13


def test_sequence_equals_single_and_prefix():
    rho = np.linspace(0, 1, 11)
    whole = z.radial_sequence(9, rho)
    assert np.array_equal(whole[: z.radial_count(6)], z.radial_sequence(6, rho))
    for n in range(10):
        for l in range(n % 2, n + 1, 2):
            assert np.array_equal(whole[z.radial_index(n, l)], z.radial(n, l, rho))


def test_hemisphere_against_the_oracle():
    rng = np.random.default_rng(2)
    for theta, phi in rng.uniform([0, -4], [np.pi / 2, 9], (6, 2)):
        got = z.zernike_sequence(6, theta, phi)
        for j, value in enumerate(got):
            n, l = z.zernike_orders(j)
            assert value == pytest.approx(float(oracles.hemisphere(int(n), int(l), theta, phi)), abs=2e-14)


def test_indices_go_both_ways():
    j = np.arange(z.zernike_count(30))
    n, l = z.zernike_orders(j)
    assert np.array_equal(z.zernike_index(n, l), j)
    assert (np.abs(l) <= n).all() and ((n - l) % 2 == 0).all() and n.max() == 30


def test_hemisphere_gram_matrix_to_order_64():
    order = 64
    theta, weight = elevation_rule(order + 1)
    phi = 2 * np.pi * np.arange(2 * order + 1) / (2 * order + 1)
    basis = z.zernike_sequence(order, theta[:, None], phi[None, :]).reshape(z.zernike_count(order), -1)
    weights = np.repeat(weight, len(phi)) * 2 * np.pi / len(phi)
    gram = (basis * weights) @ basis.T
    assert np.abs(gram - np.eye(len(gram))).max() <= 1e-11


def test_shapes_scalars_and_nothing():
    assert z.zernike_sequence(3, 0.1, 0.2).shape == (10,)
    assert z.zernike_sequence(3, np.zeros((4, 1)), np.zeros(5)).shape == (10, 4, 5)
    assert z.radial_sequence(4, np.empty(0)).shape == (z.radial_count(4), 0)
    single = z.zernike_sequence(4, np.float32(0.5), np.float32(1.0))
    assert single.dtype == np.float64
    assert np.abs(single - z.zernike_sequence(4, 0.5, 1.0)).max() < 1e-6


def test_modes_that_do_not_exist():
    for n, l in ((2, 1), (1, 3), (3, -5)):
        with pytest.raises(ValueError, match=f"n = {n}, l = {l}"):
            z.radial(n, l, 0.5)
    with pytest.raises(ValueError, match="order is -1"):
        z.radial_sequence(-1, 0.5)
