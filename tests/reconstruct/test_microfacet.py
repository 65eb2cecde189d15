"""Families of lobes: the file's own lobe, Fresnel's formula, Smith's masking."""

import numpy as np
import pytest

from reconstruct.angles import unit_vectors
from reconstruct.lobes import ggx, slopes_density
from reconstruct.microfacet import (
    CORRELATED_SCHLICK,
    dielectric_fresnel,
    families,
    lobe_columns,
    retro_lobe,
    second_lobe,
    turned_roughness,
)
from synthetic.brdf import make_brdf

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
    mirrors = (*families(absolute=absolute), second_lobe(absolute=absolute), retro_lobe(absolute=absolute))
    for family in (*mirrors, *(one.with_beckmann for one in mirrors)):
        own = coefficients_of(family, rng)
        there = lobe_columns(family, shape_of(family, 0.2), theta_i, theta_r, dphi)
        back = lobe_columns(family, shape_of(family, 0.2), theta_r, theta_i, dphi)
        value = there[0] + there[1] @ own
        np.testing.assert_allclose(back[0] + back[1] @ own, value, rtol=1e-12)
        assert (value >= 0.0).all()


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


def test_what_a_coat_lets_through_to_its_ground_is_what_it_does_not_reflect():
    coat = next(family for family in families(absolute=True) if family.has_ground)
    theta = np.radians([0.0, 30.0, 60.0, 80.0])
    ground = lobe_columns(coat, np.array([0.3, 0.05]), theta, theta, theta)[1][:, -1]
    np.testing.assert_allclose(
        np.sqrt(np.pi * ground), 1.0 - dielectric_fresnel(np.cos(theta), 0.05), rtol=1e-12
    )


def turning_pairs(n=4000):
    theta_i, theta_r, dphi = pairs(n)
    rng = np.random.default_rng(3)
    return theta_i, theta_r, dphi * rng.choice([-1.0, 1.0], n), rng.uniform(-np.pi, np.pi, n)


@pytest.mark.parametrize("azimuth", [0.0, 0.6, 2.0])
def test_a_turning_lobe_is_the_brushed_metal_of_the_renderer(azimuth):
    theta_i, theta_r, dphi, phi_i = turning_pairs()
    truth = make_brdf("anisotropic-ggx", {"f0": (0.3,), "roughness_x": 0.4, "roughness_y": 0.16})
    stretch = 0.5 * np.log(0.4 / 0.16) * np.array([np.cos(2 * azimuth), np.sin(2 * azimuth)])
    shape = np.array([np.sqrt(0.4 * 0.16), *np.exp(stretch)])
    fixed, columns = lobe_columns(ANISOTROPIC, shape, theta_i, theta_r, dphi, phi_i)
    # the sample turned by the azimuth: its own axes see the directions turned back
    incident = unit_vectors(theta_i, phi_i - azimuth)
    exit = unit_vectors(theta_r, phi_i + dphi - azimuth)
    np.testing.assert_allclose(fixed + 0.3 * columns[:, 0], truth(incident, exit)[:, 0], rtol=1e-9)
    assert turned_roughness(shape) == pytest.approx((0.4, 0.16, azimuth), abs=1e-12)


@pytest.mark.parametrize("absolute", [True, False])
def test_a_turning_lobe_without_stretch_is_the_isotropic_one(absolute):
    theta_i, theta_r, dphi, phi_i = turning_pairs()
    both = zip(families(absolute=absolute), families(absolute=absolute, turning=True), strict=True)
    for plain, turning in both:
        shape = shape_of(plain, 0.2)
        expected = lobe_columns(plain, shape, theta_i, theta_r, dphi)
        found = lobe_columns(turning, np.array([*shape, 1.0, 1.0]), theta_i, theta_r, dphi, phi_i)
        np.testing.assert_allclose(found[0], expected[0], rtol=1e-9)
        np.testing.assert_allclose(found[1], expected[1], rtol=1e-9)


def test_a_turning_lobe_is_reciprocal():
    theta_i, theta_r, dphi, phi_i = turning_pairs()
    for family in families(absolute=True, turning=True):
        own = coefficients_of(family, np.random.default_rng(1))
        shape = np.array([*shape_of(family, 0.2)[: len(family.shape_names) - 2], 1.4, 0.8])
        there = lobe_columns(family, shape, theta_i, theta_r, dphi, phi_i)
        back = lobe_columns(family, shape, theta_r, theta_i, -dphi, phi_i + dphi)
        np.testing.assert_allclose(back[0] + back[1] @ own, there[0] + there[1] @ own, rtol=1e-10)


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
