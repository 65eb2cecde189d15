"""Codes to light and back."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.linear.encoding import (
    Encoding,
    gamma_to_linear,
    linear_to_gamma,
    linear_to_srgb,
    srgb_to_linear,
)

CODES = np.linspace(-0.05, 1.2, 501)


def test_srgb_comes_back():
    # the standard's rounded constants leave a step of 3e-8 at the knee
    assert np.abs(linear_to_srgb(srgb_to_linear(CODES)) - CODES).max() < 1e-6


@pytest.mark.parametrize("gamma", [0.7, 1.0, 1.8, 2.2])
def test_gamma_comes_back(gamma):
    assert np.abs(linear_to_gamma(gamma_to_linear(CODES, gamma), gamma) - CODES).max() < 1e-12


def test_srgb_is_the_standards():
    """IEC 61966-2-1: linear below 0.04045, else ((v + 0.055) / 1.055)^2.4; middle gray 0.5 is 0.21404."""
    assert srgb_to_linear(np.array([0.02, 0.5, 1.0])) == pytest.approx(
        [0.02 / 12.92, 0.2140411, 1.0], abs=1e-7
    )


@pytest.mark.parametrize(("kind", "gamma"), [("linear", 1.0), ("srgb", 1.0), ("gamma", 2.2)])
def test_levels_become_0_and_1(kind, gamma):
    encoding = Encoding(kind, gamma, black=0.1, white=0.8)
    ends = np.array([[0.1, 0.1, 0.1], [0.8, 0.8, 0.8]])
    assert encoding.linear(ends, 3) == pytest.approx(np.array([[0.0] * 3, [1.0] * 3]), abs=1e-15)


def test_lookup_is_the_curve_and_its_steps():
    """Quantisation's variance against that of uniformly spread signal rounded to codes."""
    encoding = Encoding("srgb")
    value, variance = encoding.lookup(255, 1)
    assert np.allclose(value[:, 0], srgb_to_linear(np.arange(256) / 255), atol=1e-7)
    signal = np.random.default_rng(0).uniform(0.0, 1.0, 2_000_000)
    code = np.round(linear_to_srgb(signal) * 255).astype(int)
    square = np.bincount(code, (signal - value[code, 0]) ** 2, 256) / np.bincount(code, minlength=256)
    # the relative scatter of a mean square of n uniform errors is sqrt(0.8 / n); n is 600 at least
    assert np.abs(square / variance[:, 0] - 1)[1:255].max() < 5 * np.sqrt(0.8 / 600)


def test_a_table_is_read_between_its_codes():
    table = np.column_stack([np.linspace(0, 1, 256) ** 2, np.linspace(0, 1, 256)])
    found = Encoding("table", table=table).linear(np.array([[0.5, 0.5]]), 2)
    assert found == pytest.approx(np.array([[0.25, 0.5]]), abs=1e-5)
