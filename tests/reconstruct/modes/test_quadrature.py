"""Rules of quadrature: exact where they say so."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.modes.quadrature import azimuth_rule, elevation_rule, panel_rule


@pytest.mark.parametrize("level", [0, 1, 4])
def test_elevation_rule_integrates_powers_of_the_cosine(level):
    theta, weight = elevation_rule(12, level=level, peak=0.6)
    for power in range(6):
        assert weight @ np.cos(theta) ** power == pytest.approx(1 / (power + 1), rel=1e-13)


def test_graded_rules_bear_singularities_and_peaks():
    theta, weight = elevation_rule(12, level=6)
    assert weight @ np.cos(theta) ** -0.5 == pytest.approx(2, rel=1e-6)
    peak, width = 0.9, 1e-3
    theta, weight = elevation_rule(12, level=12, peak=peak)
    lorentz = width / ((theta - peak) ** 2 + width**2) / np.sin(theta)
    exact = np.arctan((np.pi / 2 - peak) / width) + np.arctan(peak / width)
    assert weight @ lorentz == pytest.approx(exact, rel=1e-6)


def test_azimuth_rules_are_exact_for_waves():
    for level in (0, 3):
        dphi, weight = azimuth_rule(12, 8, level=level)
        waves = np.cos(np.outer(np.arange(12), dphi)) @ weight
        assert np.abs(waves - np.pi * (np.arange(12) == 0)).max() < 1e-12
        assert (np.diff(dphi) > 0).all() and dphi[0] > 0 and dphi[-1] < np.pi


def test_panels_cover_their_interval_once():
    nodes, weights = panel_rule(np.array([1.0, 1.25, 2.0]), 3, 8)
    assert weights.sum() == pytest.approx(1, rel=1e-14) and len(nodes) == 3 + 2 + 3 + 6
    assert (np.diff(nodes) > 0).all()
