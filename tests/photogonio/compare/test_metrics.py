"""The measures against values worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.compare import metrics
from photogonio.compare.metrics import Directions, quadrature
from photogonio.reconstruct.modes.angles import unit_vectors

MASK = np.radians(80.0)


def constant(value: float):
    return lambda incident, exit: np.full((len(incident), 1), value)


@pytest.mark.parametrize("isotropic", [True, False])
def test_the_quadrature_covers_both_caps(isotropic):
    at = quadrature(MASK, isotropic=isotropic)
    cap = 2 * np.pi * (1 - np.cos(MASK))
    assert at.weight.sum() == pytest.approx(cap**2, rel=1e-12)
    assert at.cos_i.min() > np.cos(MASK)
    # integral of cos over a cap is pi sin^2
    assert (at.weight * at.cos_i * at.cos_r).sum() == pytest.approx(
        (np.pi * np.sin(MASK) ** 2) ** 2, rel=1e-10
    )
    # a dependence on azimuth integrates to nothing
    assert abs((at.weight * (at.incident * at.exit)[:, :2].sum(1)).sum()) < 1e-12


def test_relative_l2_is_the_formula_of_the_conventions():
    theta = np.radians([[20.0, 40.0], [60.0, 10.0]])
    at = Directions(
        unit_vectors(theta[0], np.zeros(2)),
        unit_vectors(theta[1], np.zeros(2)),
        np.sin(theta[0]) * np.sin(theta[1]),
    )
    a, b = np.array([[1.0], [2.0]]), np.array([[1.5], [1.0]])
    w = [np.prod(np.sin(t) * np.cos(t)) for t in theta.T]
    expected = np.sqrt((w[0] * 0.25 + w[1] * 1.0) / (w[0] * 2.25 + w[1] * 1.0))
    np.testing.assert_allclose(metrics.relative_l2(a, b, at), [expected], rtol=1e-12)


def test_a_scaled_copy():
    at = quadrature(MASK, isotropic=True, polar=24)
    b = np.column_stack([at.cos_i + at.cos_r, 0.1 + at.cos_i * at.cos_r])
    np.testing.assert_allclose(metrics.relative_l2(1.1 * b, b, at), 0.1, rtol=1e-12)
    np.testing.assert_allclose(metrics.maximum(1.1 * b, b), 0.1 * b.max(0), rtol=1e-12)
    for measure in (metrics.ngan_l2, metrics.standard_log, metrics.cube_root):
        assert (measure(b, b, at) == 0).all()
        assert (measure(1.1 * b, b, at) > 0).all()


def test_measures_of_constants():
    at = quadrature(MASK, isotropic=True)
    a, b = np.full((len(at.weight), 1), 0.5), np.full((len(at.weight), 1), 0.2)
    # mean of cos^2 over a cap: (1 - cos^3) / (3 (1 - cos))
    c = np.cos(MASK)
    mean_square = (1 - c**3) / (3 * (1 - c))
    np.testing.assert_allclose(metrics.ngan_l2(a, b, at), 0.3 * np.sqrt(mean_square), rtol=1e-10)
    # mean of cos^(2/3): 3 (1 - cos^(5/3)) / (5 (1 - cos))
    mean_root = 3 * (1 - c ** (5 / 3)) / (5 * (1 - c))
    factor = np.cbrt(0.5) - np.cbrt(0.2)
    np.testing.assert_allclose(metrics.cube_root(a, b, at), factor * np.sqrt(mean_root), rtol=1e-8)
    u = np.linspace(c, 1, 200001)
    mean_log = np.trapezoid((np.log1p(0.5 * u) - np.log1p(0.2 * u)) ** 2, u) / (1 - c)
    np.testing.assert_allclose(metrics.standard_log(a, b, at), np.sqrt(mean_log), rtol=1e-8)


def test_negative_values_are_counted_by_solid_angle():
    at = quadrature(np.pi / 2, isotropic=True, polar=64)
    f = np.where(at.cos_i[:, None] < 0.5, -1.0, 1.0)
    assert metrics.negative_fraction(f, at)[0] == pytest.approx(0.5, abs=0.02)


def test_reciprocity_residual():
    at = quadrature(MASK, isotropic=True)
    assert metrics.reciprocity_residual(constant(0.3), at)[0] == 0
    skew = metrics.reciprocity_residual(lambda i, r: (i[:, 2] + 0.5)[:, None], at)[0]
    w = at.weight * at.cos_i * at.cos_r
    expected = np.sqrt((w * (at.cos_r - at.cos_i) ** 2).sum() / (w * (at.cos_i + 0.5) ** 2).sum())
    assert skew == pytest.approx(expected, rel=1e-12)


def test_directional_albedo():
    angles = np.radians([0.0, 40.0, 70.0])
    np.testing.assert_allclose(metrics.directional_albedo(constant(1 / np.pi), angles), 1.0, rtol=1e-12)
    # f = cos_i cos_r: the integral of cos_r^2 over the hemisphere is 2 pi / 3; as a function of sin^2 its end is
    # a square root, which Gauss nodes follow with an error of about n^-3
    found = metrics.directional_albedo(lambda i, r: (i[:, 2] * r[:, 2])[:, None], angles)
    np.testing.assert_allclose(found[:, 0], 2 * np.pi / 3 * np.cos(angles), rtol=48.0**-3)
