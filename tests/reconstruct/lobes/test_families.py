"""Families of lobes: the file's own lobe, Fresnel's formula, Smith's masking."""

import numpy as np
import pytest

from photogonio.reconstruct.lobes.families import (
    CORRELATED_SCHLICK,
    blinn_phong_lobe,
    families,
    lobe_columns,
    retro_lobe,
    round_lobe,
    second_lobe,
)
from photogonio.reconstruct.lobes.schlick import ggx, slopes_density
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.modes.integrals import albedo_by_quadrature
from photogonio.reconstruct.represent.as_found import lobe_of

ANISOTROPIC = families(absolute=True, turning=True)[0]
TOP = np.radians(85.0)


def pairs(n=4000, seed=0):
    rng = np.random.default_rng(seed)
    return *np.arccos(rng.uniform(np.cos(TOP), 1.0, (2, n))), rng.uniform(0.0, np.pi, n)


def coefficients_of(family, rng):
    return np.minimum(rng.uniform(0.02, 0.9, len(family.coefficient_names)), family.upper_bounds())


def shape_of(family, roughness):
    return np.array([roughness, 0.05][: len(family.shape_names)])


@pytest.mark.parametrize("roughness", [0.03, 0.2, 0.7])
def test_the_files_own_family_is_the_files_lobe(roughness):
    angles = pairs()
    fixed, columns = lobe_columns(CORRELATED_SCHLICK, np.array([roughness]), *angles)
    # 1 - cos^2 of the half vector loses eps / roughness^2 twice
    np.testing.assert_allclose(fixed + columns[:, 0] * 0.3, ggx(*angles, roughness, 0.3), rtol=1e-11)


@pytest.mark.parametrize("absolute", [True, False])
def test_every_family_is_reciprocal_and_not_negative(absolute):
    theta_i, theta_r, dphi = pairs()
    rng = np.random.default_rng(1)
    peaks = (retro_lobe(absolute=absolute), round_lobe(absolute=absolute))
    mirrors = (*families(absolute=absolute), second_lobe(absolute=absolute), *peaks)
    for family in (*mirrors, *(one.with_beckmann for one in mirrors)):
        own = coefficients_of(family, rng)
        there = lobe_columns(family, shape_of(family, 0.2), theta_i, theta_r, dphi)
        back = lobe_columns(family, shape_of(family, 0.2), theta_r, theta_i, dphi)
        value = there[0] + there[1] @ own
        np.testing.assert_allclose(back[0] + back[1] @ own, value, rtol=1e-12)
        assert (value >= 0.0).all()


@pytest.mark.parametrize("roughness", [0.1, 0.4])
def test_facets_project_onto_the_whole_surface(roughness):
    """In retro-reflection the half vector is the direction itself: the integral of D cos is 1."""
    nodes, weights = np.polynomial.legendre.leggauss(400)
    cos = 0.5 * (nodes + 1)
    theta = np.arccos(cos)
    family = families(absolute=False)[0]
    base = lobe_columns(family, np.array([roughness]), theta, theta, 0 * theta)[1][:, 0]
    root = np.sqrt(roughness**2 + (1 - roughness**2) * cos**2)
    density = base * 4 * cos * root  # visibility is 1 / (4 cos root) there
    assert 2 * np.pi * np.sum(0.5 * weights * density * cos) == pytest.approx(1.0, rel=1e-9)


def test_correlated_masking_hides_less_and_the_same_at_the_normal():
    correlated, separable = families(absolute=False)[:2]
    theta_i, theta_r, dphi = pairs()
    shape = np.array([0.3])
    more = lobe_columns(correlated, shape, theta_i, theta_r, dphi)[1][:, 0]
    less = lobe_columns(separable, shape, theta_i, theta_r, dphi)[1][:, 0]
    assert (more >= less * (1 - 1e-12)).all() and (more > 1.2 * less).any()
    zero = np.zeros_like(theta_r)
    np.testing.assert_allclose(
        lobe_columns(correlated, shape, zero, theta_r, dphi)[1],
        lobe_columns(separable, shape, zero, theta_r, dphi)[1],
        rtol=1e-12,
    )


def test_a_relative_scale_leaves_the_weight_free_and_an_absolute_one_does_not():
    for family in families(absolute=True):
        limits = dict(zip(family.coefficient_names, family.upper_bounds(), strict=True))
        assert np.isfinite([limits[name] for name in limits if name != "ground"]).all()
    for family in families(absolute=False):
        assert family.coefficient_names and not np.isfinite(family.upper_bounds()).any()


@pytest.mark.parametrize("distribution", ["ggx", "beckmann"])
@pytest.mark.parametrize("roughness", [0.15, 0.5])
def test_what_a_coat_lets_through_to_its_ground_is_what_its_lobe_does_not_send_back(distribution, roughness):
    coat = next(family for family in families(absolute=True) if family.has_ground)
    coat = coat if distribution == "ggx" else coat.with_beckmann
    shape = np.array([roughness, 0.05])

    def lobe(theta_i, theta_r, dphi):
        angles = np.broadcast_arrays(theta_i, theta_r, dphi)
        value = lobe_columns(coat, shape, *(angle.ravel() for angle in angles))[0]
        return value.reshape(*angles[0].shape, 1)

    theta = np.radians([0.0, 30.0, 60.0, 75.0])
    sent = albedo_by_quadrature(lobe, theta, roughness)[:, 0]
    ground = lobe_columns(coat, shape, theta, theta, theta)[1][:, -1]
    np.testing.assert_allclose(1.0 - np.sqrt(np.pi * ground), sent, atol=2e-3)


def projected(distribution, roughness, theta):
    """Area of all facets seen from ``theta``, each facet once: the integral of D <i, h> over the hemisphere of h."""
    nodes, weights = np.polynomial.legendre.leggauss(300)
    cos, phi = 0.5 * (nodes + 1), np.pi * (np.arange(400) + 0.5) / 400
    density = slopes_density(cos, roughness, distribution)
    facing = np.sin(theta) * np.sqrt(1 - cos**2)[:, None] * np.cos(phi) + np.cos(theta) * cos[:, None]
    return 2 * np.pi * np.sum(0.5 * weights[:, None] * density[:, None] * np.maximum(facing, 0.0)) / 400


@pytest.mark.parametrize("roughness", [0.2, 0.5])
@pytest.mark.parametrize("theta", [0.0, 1.0, 1.4])
def test_beckmanns_masking_is_what_its_facets_hide(roughness, theta):
    """Smith: what is seen is the surface's own area, cos; all facets together have (1 + Lambda) times as much."""
    family = families(absolute=False)[0].with_beckmann
    up = lobe_columns(family, np.array([roughness]), *(np.array([a]) for a in (theta, 0.0, 0.0)))[1][0, 0]
    cos_h = np.array([np.cos(0.5 * theta)])
    seen = up * 4 * np.cos(theta) / slopes_density(cos_h, roughness, "beckmann")[0]  # 1 / (1 + Lambda)
    all_facets = projected("beckmann", roughness, theta)
    assert all_facets * seen == pytest.approx(np.cos(theta), rel=1e-3)  # 400 azimuths of a kinked integrand


@pytest.mark.parametrize("distribution", ["ggx", "beckmann"])
def test_slopes_of_either_distribution_cover_the_surface_once(distribution):
    assert projected(distribution, 0.4, 0.0) == pytest.approx(1.0, rel=1e-6)


def test_a_retro_lobe_of_weight_1_returns_all_at_normal_incidence_and_is_as_high_at_any():
    for family in (retro_lobe(absolute=True), retro_lobe(absolute=True).with_beckmann):
        nodes, weights = np.polynomial.legendre.leggauss(200)
        theta = 0.25 * np.pi * (nodes + 1)
        value = lobe_columns(family, np.array([0.05]), 0 * theta, theta, 0 * theta)[1][:, 0]
        sent = 2 * np.pi * np.sum(0.25 * np.pi * weights * value * np.cos(theta) * np.sin(theta))
        # tails beyond a right angle and the cosine's fall within the peak: of the square of the roughness
        assert sent == pytest.approx(1.0, abs=20 * 0.05**2)
        peak = lobe_columns(family, np.array([0.1]), theta, theta, 0 * theta)[1][:, 0]
        np.testing.assert_allclose(peak, 1 / (4 * np.pi * 0.1**2), rtol=1e-12)


def test_a_round_lobe_is_nearly_a_power_of_the_cosine_to_the_mirror_direction():
    """Beckmann's slopes of half the angle agree with cos^n to its fourth order, at any incidence."""
    theta_i, theta_r, dphi = pairs()
    cos = np.cos(theta_i) * np.cos(theta_r) - np.sin(theta_i) * np.sin(theta_r) * np.cos(dphi)
    power = 50.0
    said = lobe_columns(
        round_lobe(absolute=True).with_beckmann, np.array([(2.0 * power) ** -0.5]), theta_i, theta_r, dphi
    )[1][:, 0]
    true = (power + 2.0) / (2.0 * np.pi) * np.maximum(cos, 0.0) ** power
    np.testing.assert_allclose(said / said.max(), true / true.max(), atol=0.5 / power)
    assert said.max() == pytest.approx(true.max(), rel=2.5 / power)


@pytest.mark.parametrize("power", [4.0, 20.0, 400.0])
def test_a_blinn_phong_lobe_is_a_power_of_the_cosine_between_half_vector_and_normal(power):
    """Against the half vector itself, as a fit tries it and as a BRDF has it."""
    theta_i, theta_r, dphi = pairs()
    incident, exit = unit_vectors(theta_i, 0.0 * dphi), unit_vectors(theta_r, dphi)
    half = incident + exit
    cos = half[:, 2] / np.linalg.norm(half, axis=1)
    true = (power + 2.0) / (8.0 * np.pi) * cos**power
    roughness = np.sqrt(2.0 / (power + 2.0))
    family = blinn_phong_lobe(absolute=True)
    said = lobe_columns(family, np.array([roughness]), theta_i, theta_r, dphi)[1]
    lobe = lobe_of(family, np.array([roughness]), np.ones((1, 1)))
    for found in (said, lobe.evaluate(theta_i, theta_r, dphi)):
        np.testing.assert_allclose(found[:, 0], true, rtol=1e-10, atol=1e-300)
