"""A rough interface: Fresnel's formula, Smith's masking, and what a coat sends back."""

import numpy as np
import pytest

from photogonio.reconstruct.lobes.interface import coat_albedo, cubic_piece, dielectric_fresnel


@pytest.mark.parametrize("f0", [0.02, 0.04, 0.2])
def test_fresnel_at_normal_grazing_and_brewsters_angle(f0):
    index = (1 + np.sqrt(f0)) / (1 - np.sqrt(f0))
    brewster = np.cos(np.arctan(index))
    normal, grazing, across = dielectric_fresnel(np.array([1.0, 0.0, brewster]), f0)
    assert normal == pytest.approx(f0, rel=1e-12)
    assert grazing == pytest.approx(1.0, rel=1e-12)
    # at Brewster's angle nothing is reflected parallel, and ((n^2 - 1) / (n^2 + 1))^2 across
    assert across == pytest.approx(0.5 * ((index**2 - 1) / (index**2 + 1)) ** 2, rel=1e-12)


def test_fresnel_obeys_snell_both_ways():
    """Light from inside meets the same reflectance at the refracted angle: Stokes' reversibility."""
    f0, cos = 0.04, np.linspace(0.05, 1.0, 50)
    index = (1 + np.sqrt(f0)) / (1 - np.sqrt(f0))
    inside = np.sqrt(1 - (1 - cos**2) / index**2)
    s = (index * inside - cos) / (index * inside + cos)
    p = (inside - index * cos) / (inside + index * cos)
    np.testing.assert_allclose(dielectric_fresnel(cos, f0), 0.5 * (s * s + p * p), rtol=1e-12)


def test_a_nearly_smooth_coat_sends_back_what_fresnel_says():
    theta = np.radians([0.0, 30.0, 60.0])
    sent = coat_albedo(False, False, 0.02, 0.04)
    found = [cubic_piece(sent, cosine) for cosine in np.cos(theta)]
    np.testing.assert_allclose(found, dielectric_fresnel(np.cos(theta), 0.04), rtol=0.02)
