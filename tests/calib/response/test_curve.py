"""Curves as sRGB's and a bend."""

import numpy as np
import pytest

from photogonio.calib.response.curve import ANCHOR, BENDS, Curves, anchors, basis, prior, steepness
from photogonio.capture.linear.encoding import srgb_to_linear

CODES = np.linspace(0.05, 1.0, 40)


def test_functions_sum_to_one_everywhere():
    assert basis(np.linspace(0.0, 1.0, 50)).sum(1) == pytest.approx(1.0)


def test_without_bends_it_is_srgb():
    plain = Curves(np.zeros((3, BENDS)), np.zeros((3 * BENDS, 3 * BENDS)), (0.0, 1.0))
    assert np.exp(plain.log_light(CODES, 1)) == pytest.approx(srgb_to_linear(CODES))
    table = plain.table(511)
    assert table[[0, -1]].tolist() == [[0.0] * 2, [1.0] * 2]
    assert table[::2, 0] == pytest.approx(srgb_to_linear(np.linspace(0, 1, 256)), abs=1e-6)


def test_a_table_rises_whatever_the_bends():
    bends = np.random.default_rng(3).normal(0.0, 0.5, (2, BENDS))
    assert (np.diff(Curves(bends, np.zeros((2 * BENDS,) * 2), (0.0, 1.0)).table(), axis=0) > 0).all()


def test_smooth_bends_are_likelier_than_rough_ones():
    rows = prior(2)
    smooth, rough = np.zeros(3 * BENDS), np.zeros(3 * BENDS)
    smooth[:BENDS] = 0.05 * np.sin(np.linspace(0.0, np.pi, BENDS))
    rough[:BENDS:2] = 0.05
    assert (rows @ rough) @ (rows @ rough) > 10 * (rows @ smooth) @ (rows @ smooth)
    assert (anchors(2) @ smooth)[0] == pytest.approx(0.0, abs=0.5)


def test_beyond_the_codes_that_were_seen_it_is_unsure():
    curves = Curves(np.zeros((2, BENDS)), np.zeros((2 * BENDS, 2 * BENDS)), (0.2, 0.8))
    inside, outside = np.array([0.3]), np.array([0.1])
    assert curves.error_between(inside, np.array([0.7]), 0) == pytest.approx(0.0)
    lost = np.log(srgb_to_linear(0.2) / srgb_to_linear(0.1))
    assert curves.error_between(outside, inside, 0) == pytest.approx(lost / 2)


def test_errors_are_of_ratios():
    spread = np.eye(2 * BENDS)
    curves = Curves(np.zeros((2, BENDS)), spread, (0.0, 1.0))
    error = curves.error_between(CODES, np.full(len(CODES), ANCHOR), 0)
    assert curves.error_between(CODES, CODES, 0) == pytest.approx(0.0)
    slopes = [steepness(c)[:, None] * basis(c) for c in (CODES, np.full(len(CODES), ANCHOR))]
    assert error == pytest.approx(np.sqrt(2 * ((slopes[0] - slopes[1]) ** 2).sum(1)))


def test_what_is_not_known_of_codes_is_a_few_independent_changes():
    covariance = np.linalg.inv(prior(3).T @ prior(3))  # as before any print is seen
    curves = Curves(np.zeros((4, BENDS)), covariance, (0.2, 0.95))
    found = curves.doubts(np.append(CODES, ANCHOR))
    for c in range(3):
        apart = np.sqrt(((found[:, :-1, c] - found[:, -1:, c]) ** 2).sum(0))
        expected = curves.error_between(CODES, np.full(len(CODES), ANCHOR), c)
        assert apart == pytest.approx(expected, rel=0.05, abs=0.002)
