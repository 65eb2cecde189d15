"""Curves as sRGB's and a bend."""

import numpy as np
import pytest

from photogonio.calib.response.curve import ANCHOR, BENDS, Curves, anchors, basis, prior
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


def test_no_bend_is_what_is_expected_and_a_constant_is_free_but_for_the_anchor():
    rows = prior(2)
    constant = np.concatenate([np.ones(BENDS), np.zeros(2 * BENDS)])
    assert rows @ constant == pytest.approx(0.0, abs=1e-9)
    assert anchors(2)[0] @ constant == pytest.approx(1.0)


def test_errors_are_of_ratios():
    spread = np.eye(2 * BENDS)
    curves = Curves(np.zeros((2, BENDS)), spread, (0.0, 1.0))
    error = curves.error_between(CODES, np.full(len(CODES), ANCHOR), 0)
    assert curves.error_between(CODES, CODES, 0) == pytest.approx(0.0)
    apart = basis(CODES) - basis(np.full(len(CODES), ANCHOR))
    assert error == pytest.approx(np.sqrt(2 * (apart**2).sum(1)))
