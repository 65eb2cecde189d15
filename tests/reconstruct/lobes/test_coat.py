"""What a coat sends back: of a mirror, of any azimuth, and under even light."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.lobes.coat import Interface, coat_albedo_of
from photogonio.reconstruct.lobes.interface import dielectric_fresnel
from photogonio.reconstruct.lobes.lobe_sums import mirror_values

COSINES = np.cos(np.radians([0.0, 25.0, 50.0, 70.0, 80.0]))
PLAIN = Interface(0.3, 0.3, 0.0, False, False, 0.05)
BRUSHED = Interface(0.5, 0.25, 0.4, False, False, 0.05)


@pytest.mark.parametrize("beckmann", [False, True])
def test_a_smooth_coat_sends_back_what_fresnel_says(beckmann):
    """Half angles spread by the roughness change it by its square times the slope: little below 60 degrees."""
    smooth = coat_albedo_of(Interface(0.02, 0.02, 0.0, beckmann, False, 0.04))
    cos = np.cos(np.radians([0.0, 30.0, 55.0]))
    np.testing.assert_allclose(smooth.at(cos), dielectric_fresnel(cos, 0.04), rtol=0.01)


@pytest.mark.parametrize("interface", [PLAIN, BRUSHED], ids=["plain", "brushed"])
def test_what_is_sent_back_is_the_integral_of_the_lobe(interface):
    """Over the exit hemisphere, by 300 x 300 midpoints that are even in projected solid angle."""
    cos_r = np.sqrt((np.arange(300) + 0.5) / 300)
    theta_r, phi_r = (
        g.ravel() for g in np.meshgrid(np.arccos(cos_r), 2 * np.pi * (np.arange(300) + 0.5) / 300)
    )
    own = (interface.along, interface.across, interface.azimuth, False, False, interface.f0)
    for theta, phi in ((0.2, 0.0), (0.9, 1.1)):
        angles = [np.full_like(theta_r, theta), np.full_like(theta_r, phi), theta_r, phi_r]
        sent = np.pi * mirror_values(own, angles).mean()
        assert coat_albedo_of(interface).at(np.cos(theta), phi) == pytest.approx(sent, rel=2e-3)


def test_the_mean_is_that_of_even_light():
    """Twice the integral of E cos dcos, by another rule."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    cos = 0.5 * (nodes + 1.0)
    found = coat_albedo_of(PLAIN)
    assert found.mean == pytest.approx(np.sum(weights * found.at(cos) * cos), rel=1e-6)


def test_a_brushed_coat_is_the_same_after_half_a_turn_and_with_its_axes_exchanged_after_a_quarter():
    found = coat_albedo_of(BRUSHED)
    other = coat_albedo_of(Interface(0.25, 0.5, 0.4 + 0.5 * np.pi, False, False, 0.05))
    assert found.turning and not coat_albedo_of(PLAIN).turning
    for phi in (0.0, 0.7, 2.0):
        np.testing.assert_allclose(found.at(COSINES, phi + np.pi), found.at(COSINES, phi), rtol=1e-12)
        np.testing.assert_allclose(other.at(COSINES, phi), found.at(COSINES, phi), rtol=1e-4)
    assert np.abs(found.at(COSINES, 0.4) - found.at(COSINES, 0.4 + 0.5 * np.pi)).max() > 1e-3


def test_no_more_enters_than_comes_and_both_ways_alike():
    rng = np.random.default_rng(0)
    theta, phi = rng.uniform(0.0, 1.55, (2, 50)), rng.uniform(-3.0, 3.0, (2, 50))
    for interface in (PLAIN, BRUSHED):
        found = coat_albedo_of(interface)
        there = found.entered(theta[0], phi[0], theta[1], phi[1])
        assert ((there > 0.0) & (there < 1.0)).all()
        np.testing.assert_allclose(found.entered(theta[1], phi[1], theta[0], phi[0]), there, rtol=1e-14)
