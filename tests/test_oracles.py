"""The oracle itself, against the paper's explicit formulas and against integrals."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import quad

from tests import oracles


def test_radial_polynomials_known_by_heart():
    rho = mp.mpf("0.3")
    known = {
        (0, 0): 1,
        (1, 1): rho,
        (2, 0): 2 * rho**2 - 1,
        (3, 1): 3 * rho**3 - 2 * rho,
        (4, 0): 6 * rho**4 - 6 * rho**2 + 1,
        (5, 3): 5 * rho**5 - 4 * rho**3,
        (6, 2): 15 * rho**6 - 20 * rho**4 + 6 * rho**2,
    }
    for (n, l), value in known.items():
        assert abs(oracles.radial(n, l, rho) - value) < mp.mpf(10) ** -300


@pytest.mark.parametrize(("n", "m", "l"), oracles.isotropic_list(4))
def test_radial_orthogonality(n, m, l):
    value, _ = quad(lambda r: float(oracles.radial(n, l, r) * oracles.radial(m, l, r)) * r, 0, 1)
    assert value == pytest.approx((n == m) / (2 * (n + 1)), abs=1e-12)


def test_explicit_modes_of_the_paper():
    rng = np.random.default_rng(1)
    for theta_i, theta_r, dphi in rng.uniform(0, [1.57, 1.57, 6.28], (20, 3)):
        for (n, m, l), printed in oracles.paper_listing(theta_i, theta_r, dphi).items():
            c = np.sqrt((2 if n != m else 4) * (1.0 if l == 0 else 0.5))
            assert oracles.isotropic(n, m, l, theta_i, theta_r, dphi) * c == pytest.approx(printed, abs=1e-14)


def test_counts_of_the_paper():
    for order, count in ((0, 1), (2, 5), (4, 14), (6, 30), (8, 55), (16, 285)):
        assert len(oracles.isotropic_list(order)) == count == oracles.count_isotropic(order)


@pytest.mark.parametrize(
    ("one", "other"), [((2, 0, 0), (2, 0, 0)), ((3, 1, 1), (3, 1, 1)), ((3, 1, 1), (3, 3, 1))]
)
def test_isotropic_modes_are_orthonormal(one, other):
    nodes, weights = np.polynomial.legendre.leggauss(5)
    theta, weight = np.arccos((nodes + 1) / 2), weights / 2  # exact: polynomials of degree 6 in cos(theta)
    dphi = (np.arange(8) + 0.5) * np.pi / 4
    total = 0.0
    for ti, wi in zip(theta, weight, strict=True):
        for tr, wr in zip(theta, weight, strict=True):
            for d in dphi:
                total += wi * wr * oracles.isotropic(*one, ti, tr, d) * oracles.isotropic(*other, ti, tr, d)
    assert total * 2 * np.pi * np.pi / 4 == pytest.approx(float(one == other), abs=1e-13)


def test_hemisphere_mode_is_normalised():
    nodes, weights = np.polynomial.legendre.leggauss(6)
    theta = np.arccos((nodes + 1) / 2)
    phi = (np.arange(12) + 0.5) * np.pi / 6
    total = sum(
        w / 2 * float(oracles.hemisphere(4, -2, t, p)) ** 2
        for t, w in zip(theta, weights, strict=True)
        for p in phi
    )
    assert total * np.pi / 6 == pytest.approx(1, abs=1e-13)


def test_ggx_closed_forms():
    # at normal incidence and exit: D = 1 / (pi alpha^2), G2 = 1
    assert oracles.ggx(0.0, 0.0, 0.0, 0.3, 0.5) == pytest.approx(0.5 / (4 * np.pi * 0.09), rel=1e-14)
    # alpha = 1: D = 1 / pi whatever h; G2 / (4 cos cos) = 1 / (2 (cos_i + cos_r))
    value = oracles.ggx(0.5, 1.1, 2.0, 1.0, 1.0)
    assert value == pytest.approx(1 / (2 * np.pi * (np.cos(0.5) + np.cos(1.1))), rel=1e-13)


def test_facets_of_the_whole_sphere():
    for level in (0, 1, 2):
        triangles = oracles.facet_triangles(level)
        assert len(triangles) == 20 * 4**level
        a, b, c = np.moveaxis(triangles, 1, 0)
        triple = np.abs(np.einsum("tx,tx->t", a, np.cross(b, c)))
        dots = sum(np.einsum("tx,tx->t", p, q) for p, q in ((a, b), (b, c), (c, a)))
        assert (2 * np.arctan2(triple, 1 + dots)).sum() == pytest.approx(4 * np.pi, rel=1e-13)
    inside = oracles.facet_margins(triangles, oracles.direction(0.7, 0.4)) > 0
    assert inside.sum() == 1


def test_mirror_spectrum_is_the_papers_integral():
    for n, m, l in oracles.isotropic_list(4):
        value, _ = quad(lambda t, k=(n, m, l): oracles.isotropic(*k, t, t, np.pi) * np.sin(t), 0, np.pi / 2)
        assert 2 * np.pi * value == pytest.approx(oracles.spectrum_of_mirror(n, m, l), abs=1e-10)
