"""Albedos in closed form against quadrature, lobes in the furnace, and the mirror."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import Brdf, Lobe
from photogonio.reconstruct.modes import basis as m
from photogonio.reconstruct.modes import integrals
from photogonio.reconstruct.modes.quadrature import elevation_rule
from photogonio.reconstruct.modes.zernike import elevation_sequence, radial_index, zernike_sequence
from tests import oracles

LISTS = {
    "isotropic": (m.isotropic_modes, 7),
    "reciprocal": (m.reciprocal_modes, 3),
    "general": (m.general_modes, 3),
}


def expansion(symmetry: str, quantity: str) -> Brdf:
    make, order = LISTS[symmetry]
    modes = make(order)
    values = np.random.default_rng(7).normal(size=(len(modes), 2))
    return Brdf(order, ("a", "b"), modes, values, abs(values), quantity=quantity, symmetry=symmetry)


@pytest.mark.parametrize("quantity", ["brdf", "brdf_cos", "brdf_cos_cos"])
@pytest.mark.parametrize("symmetry", LISTS)
def test_directional_albedo_is_the_integral(symmetry, quantity):
    given = expansion(symmetry, quantity)
    theta, weight = elevation_rule(12)
    phi = 2 * np.pi * np.arange(12) / 12
    for theta_i, phi_i in ((0.0, 0.3), (0.8, 1.1), (1.4, 5.0)):
        f = given.evaluate(theta_i, phi_i, theta[:, None], phi[None, :])
        exact = np.einsum("t,tpc->c", weight * np.cos(theta) * 2 * np.pi / 12, f)
        assert given.directional_albedo(theta_i, phi_i) == pytest.approx(exact, rel=1e-11, abs=1e-11)


@pytest.mark.parametrize("quantity", ["brdf", "brdf_cos", "brdf_cos_cos"])
@pytest.mark.parametrize("symmetry", LISTS)
def test_bihemispherical_albedo_is_the_mean_of_the_directional(symmetry, quantity):
    given = expansion(symmetry, quantity)
    theta, weight = elevation_rule(12)
    phi = 2 * np.pi * np.arange(8) / 8
    each = given.directional_albedo(theta[:, None], phi[None, :])
    exact = np.einsum("t,tpc->c", weight * np.cos(theta) * 2 / 8, each)
    assert given.bihemispherical_albedo() == pytest.approx(exact, rel=1e-11, abs=1e-11)


def test_lambert():
    modes = m.isotropic_modes(3)
    values = np.zeros((len(modes), 1))
    values[0] = 2 * 0.6  # albedo / pi over S_000 = 1 / (2 pi)
    lambert = Brdf(3, ("Y",), modes, values, values)
    assert lambert.evaluate(0.3, 0.0, 1.2, 2.0) == pytest.approx([0.6 / np.pi], rel=1e-14)
    assert lambert.directional_albedo(np.array([0.0, 1.0, np.pi / 2]))[:, 0] == pytest.approx(
        [0.6] * 3, rel=1e-13
    )
    assert lambert.bihemispherical_albedo() == pytest.approx([0.6], rel=1e-13)


def test_cosine_moments():
    theta, weight = elevation_rule(10)
    phi = 2 * np.pi * np.arange(12) / 12
    basis = zernike_sequence(5, theta[:, None], phi[None, :])
    for power in (0, 1):
        exact = np.einsum("jtp,t->j", basis, weight * np.cos(theta) ** power * 2 * np.pi / 12)
        for order in (0, 1, 2, 5):
            moments = integrals.cosine_moments(order, power)
            assert np.abs(moments - exact[: len(moments)]).max() < 1e-14
            assert len(moments) == (order + 1) * (order + 2) // 2


def test_a_lobe_never_sends_out_more_than_it_gets():
    """The white furnace: with f0 = 1 single scattering loses light, the less the smoother the surface."""
    theta = np.radians([0, 30, 60])
    each = [
        Lobe(alpha, np.ones(1), np.ones(1)).directional_albedo(theta)[:, 0] for alpha in (0.05, 0.3, 0.6, 1.0)
    ]
    assert (np.diff(each, axis=0) < 0).all() and np.max(each) < 1
    assert (each[0] > 0.99).all()


def test_lobe_albedo_converges_and_knows_its_normal_incidence():
    """alpha = 1 at normal incidence: f = 1 / (2 pi (1 + cos_r)), so the albedo is 1 - ln 2."""
    rough = Lobe(1.0, np.ones(1), np.ones(1))
    assert rough.directional_albedo(0.0)[0] == pytest.approx(1 - np.log(2), rel=1e-7)
    for alpha in (0.03, 0.2):
        lobe = Lobe(alpha, np.array([0.04]), np.ones(1))
        theta = np.radians([5.0, 45, 75])
        fine = integrals.albedo_by_quadrature(lobe.evaluate, theta, alpha / 16)
        assert lobe.directional_albedo(theta) == pytest.approx(fine, rel=1e-6)


def test_lobes_add_to_modes():
    base = expansion("isotropic", "brdf")
    lobe = Lobe(0.4, np.array([0.04, 0.9]), np.array([1.0, 0.5]))
    both = Brdf(
        base.order, base.channels, base.modes, base.coefficients, base.standard_errors, lobes=(lobe, lobe)
    )
    theta = np.array([0.2, 1.0])
    extra = both.directional_albedo(theta) - base.directional_albedo(theta)
    assert extra == pytest.approx(2 * lobe.directional_albedo(theta), rel=1e-12)
    nodes, weight = elevation_rule(16, level=8)
    exact = 2 * (weight * np.cos(nodes)) @ (2 * lobe.directional_albedo(nodes))
    assert both.bihemispherical_albedo() - base.bihemispherical_albedo() == pytest.approx(exact, rel=1e-5)


def test_albedo_of_a_callable():
    def brdf(incident, exit):  # not isotropic, not reciprocal
        return (0.2 + 0.1 * incident[..., 2] * exit[..., 0])[..., None] / np.pi + 0 * exit[..., :1]

    assert integrals.albedo_of(brdf, np.array([0.3, 1.2]), 0.7)[:, 0] == pytest.approx([0.2, 0.2], rel=1e-12)


def test_mirror_has_the_flat_spectrum_of_the_paper():
    modes = m.isotropic_modes(8)
    exact = [oracles.spectrum_of_mirror(*mode) for mode in modes.tolist()]
    assert np.abs(integrals.mirror_coefficients(modes) - exact).max() < 1e-14


@pytest.mark.parametrize(("quantity", "power"), [("brdf_cos", 0), ("brdf_cos_cos", 1)])
def test_mirror_coefficients_are_their_integrals(quantity, power):
    modes = m.isotropic_modes(9)
    n, k, l = modes.T
    theta, weight = elevation_rule(14)
    table = elevation_sequence(9, theta)
    products = table[radial_index(n, l)] * table[radial_index(k, l)] * 2 * m.isotropic_norms(modes)[:, None]
    exact = 2 * np.pi * (-1.0) ** l * (products @ (weight * np.cos(theta) ** power))
    found = integrals.mirror_coefficients(modes, 0.3, quantity)
    assert found == pytest.approx(0.3 * exact, abs=1e-13)
    with pytest.raises(ValueError, match="quantity is 'brdf'"):
        integrals.mirror_coefficients(modes, 1.0, "brdf")


def test_mirror_reflects_what_is_in_its_span():
    """The expansion turns radiance of order N into its mirror image: the integral of q(i, r) g(i) is g(mirror r)."""
    order = 4
    modes = m.isotropic_modes(order)
    mirror = Brdf(
        order, ("Y",), modes, integrals.mirror_coefficients(modes)[:, None], np.zeros((len(modes), 1))
    )
    theta, weight = elevation_rule(8)
    phi = 2 * np.pi * np.arange(10) / 10
    shape = np.random.default_rng(3).normal(size=15)
    light = np.einsum("j,jtp->tp", shape, zernike_sequence(order, theta[:, None], phi[None, :]))
    for theta_r, phi_r in ((0.2, 0.0), (1.1, 2.5)):
        q = mirror.evaluate(theta[:, None], phi[None, :], theta_r, phi_r)[..., 0]
        out = np.einsum("t,tp,tp->", weight * 2 * np.pi / 10, q, light)
        assert out == pytest.approx(shape @ zernike_sequence(order, theta_r, phi_r + np.pi), rel=1e-12)
