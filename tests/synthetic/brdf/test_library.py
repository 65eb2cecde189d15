"""Energy, reciprocity and the closed forms of the model library."""

import functools

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.modes.integrals import albedo_by_quadrature
from photogonio.synthetic.brdf.library import MODELS, angle_grid, directions, make_brdf, on_grid

WHITE = (1.0, 1.0, 1.0)
TILTS = np.radians([0.0, 30.0, 60.0, 80.0])


@functools.cache
def hemisphere(polar: int = 200, turns: int = 160) -> tuple[np.ndarray, np.ndarray]:
    """Directions (n, 3) and weights (n,) of the integral over the hemisphere of f cos dOmega."""
    node, weight = np.polynomial.legendre.leggauss(polar)
    theta = np.arcsin(np.sqrt(0.5 * (node + 1.0)))  # cos dOmega = half d(sin^2 theta) dphi
    phi = (np.arange(turns) + 0.5) * 2.0 * np.pi / turns
    polar_grid, turn_grid = np.meshgrid(theta, phi, indexing="ij")
    return directions(polar_grid.ravel(), turn_grid.ravel()), np.repeat(weight * 0.5 * np.pi / turns, turns)


def directional_albedo(brdf, theta: float) -> np.ndarray:
    exit, weight = hemisphere()
    return weight @ brdf(directions(np.array(theta), np.array(0.3))[None], exit)


def random_directions(n: int, seed: int) -> np.ndarray:
    v = np.random.default_rng(seed).normal(size=(n, 3))
    v[:, 2] = np.abs(v[:, 2])
    return v / np.linalg.norm(v, axis=1, keepdims=True)


@pytest.mark.parametrize("name", MODELS)
def test_reciprocity_is_as_declared(name):
    brdf = make_brdf(name)
    incident, exit = random_directions(2000, 1), random_directions(2000, 2)
    there, back = brdf(incident, exit), brdf(exit, incident)
    assert (np.max(np.abs(there - back) / (there + back)) < 1e-10) == brdf.reciprocal


@pytest.mark.parametrize("name", MODELS)
def test_isotropy_is_as_declared(name):
    brdf, turn = make_brdf(name), np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    incident, exit = random_directions(500, 3), random_directions(500, 4)
    here, turned = brdf(incident, exit), brdf(incident @ turn.T, exit @ turn.T)
    assert np.allclose(here, turned, rtol=1e-8) == brdf.isotropic


@pytest.mark.parametrize("name", MODELS)
def test_nothing_below_the_horizon_and_nothing_negative(name):
    brdf = make_brdf(name)
    incident, exit = random_directions(3000, 5), random_directions(3000, 6)
    assert np.all(brdf(incident, exit) >= 0) and np.all(np.isfinite(brdf(incident, exit)))
    down = exit * [1, 1, -1]
    assert not np.any(brdf(incident, down)) and not np.any(brdf(down, incident))


@pytest.mark.parametrize("name", sorted(set(MODELS) - {"minnaert", "oepik"}))
@pytest.mark.parametrize("theta", TILTS)
def test_no_model_returns_more_than_it_gets(name, theta):
    """With every reflectance at its largest. Minnaert and Oepik do by their nature: see the closed forms."""
    largest = {
        "albedo": (0.8,) if name in ("retro-reflector", "phong", "blinn-phong") else (1.0,),
        "f0": (1.0,),
    }
    microfacet_over_lambert = name in ("blinn", "torrance-sparrow")  # their ground has no Fresnel coat
    brdf = make_brdf(name)
    changes = {k: v for k, v in largest.items() if hasattr(brdf, k)}
    if microfacet_over_lambert:
        changes = {"albedo": (0.0,), "ior": 1e4}
    if name == "glossy-paint":
        changes = {"albedo": (0.98,)}
    if name == "retro-reflector":
        changes = {"albedo": (0.7,)}
    # what coats reflect is tabulated; glossy paint's mirror returns its share at any angle and a little more grazing
    excess = {"plastic": 2e-3, "plastic-schlick": 2e-3, "satin-paint": 2e-3, "glossy-paint": 0.02}
    assert directional_albedo(make_brdf(name, changes), theta).max() <= 1.0 + excess.get(name, 1e-6)


@pytest.mark.parametrize("theta", TILTS)
@pytest.mark.parametrize("k", [0.3, 0.7, 1.0, 2.0])
def test_minnaert_and_oepik_closed_forms(theta, k):
    expected = np.cos(theta) ** (k - 1.0)
    # Gauss-Legendre in sin^2 meets the integrable cos_r^(k-1): the error is about 1/nodes^(k+1)
    assert directional_albedo(make_brdf("minnaert", {"albedo": WHITE, "k": k}), theta) == pytest.approx(
        expected, rel=2e-3
    )
    assert directional_albedo(make_brdf("oepik", {"albedo": WHITE, "k": k}), theta) == pytest.approx(
        expected, rel=1e-9
    )


@pytest.mark.parametrize("name", ["phong", "blinn-phong"])
@pytest.mark.parametrize("power", [5.0, 60.0])
def test_cosine_lobes_hold_their_share_at_normal_incidence(name, power):
    brdf = make_brdf(name, {"albedo": (0.25,), "specular": 0.4, "power": power})
    assert directional_albedo(brdf, 0.0) == pytest.approx(0.65, rel=1e-6)


def test_retro_lobe_points_back():
    brdf = make_brdf("retro-reflector", {"albedo": (0.25,), "retro": 0.4, "power": 60.0})
    assert directional_albedo(brdf, 0.0) == pytest.approx(0.65, rel=1e-6)
    angles = angle_grid()
    back = angles[np.argmax(on_grid(brdf, angles)[:, 0])]
    assert back[0] == back[1] and back[2] == angles[:, 2].min()


def test_oren_nayar_without_roughness_is_lambert_and_with_it_is_brighter_backward():
    pairs = angle_grid()
    for name in ("oren-nayar", "oren-nayar-qualitative"):
        assert on_grid(make_brdf(name, {"sigma": 0.0}), pairs) == pytest.approx(0.5 / np.pi, rel=1e-12)
    back, forward = np.radians([[60.0, 60.0, 0.0], [60.0, 60.0, 180.0]])
    full = make_brdf("oren-nayar")
    assert on_grid(full, back[None])[0, 0] > 1.5 * on_grid(full, forward[None])[0, 0]


def test_oren_nayar_full_at_a_hand_worked_point():
    """sigma^2 = 0.25, albedo 0.5, theta_i = 60, theta_r = 30, dphi = 90 degrees: no C2 terms."""
    alpha, beta = np.pi / 3, np.pi / 6
    c1, c3 = 1 - 0.125 / 0.58, 0.125 * (0.25 / 0.34) * (4 * alpha * beta / np.pi**2) ** 2
    expected = 0.5 / np.pi * (c1 + c3 * np.tan(np.pi / 4)) + 0.17 * 0.25 / np.pi * 0.25 / 0.38
    found = on_grid(make_brdf("oren-nayar"), np.array([[alpha, beta, np.pi / 2]]))
    assert found == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("roughness", [0.2, 0.5, 0.9])
def test_ggx_slopes_are_normalised(roughness):
    """At normal incidence 4 cos_r f / G1(r) is D; within 45 degrees D cos integrates to 1 / (1 + alpha^2)."""
    brdf = make_brdf("ggx-conductor", {"f0": (1.0,), "roughness": roughness})
    node, weight = np.polynomial.legendre.leggauss(200)
    cos = 0.5 * (node + 1.0)
    exit = directions(np.arccos(cos), np.zeros(200))
    g1 = 2 * cos / (cos + np.sqrt(roughness**2 + (1 - roughness**2) * cos**2))
    value = brdf(np.array([0.0, 0.0, 1.0]), exit)[:, 0]
    assert np.sum(np.pi * weight * cos * value / g1) == pytest.approx(1 / (1 + roughness**2), rel=1e-6)


def test_smooth_metal_returns_what_its_fresnel_says():
    brdf = make_brdf("ggx-conductor", {"f0": (0.4,), "roughness": 0.1})
    assert directional_albedo(brdf, np.radians(20.0)) == pytest.approx(0.4, rel=0.02)


def test_blinn_and_torrance_sparrow_slopes_are_normalised():
    """At normal incidence V-grooves of a small slope neither shadow nor mask: all the light returns."""
    wide = {"albedo": (0.0,), "ior": 1e6}
    assert directional_albedo(make_brdf("torrance-sparrow", wide | {"width": 0.1}), 0.0) == pytest.approx(
        1.0, rel=1e-4
    )
    c3 = 0.1  # Trowbridge-Reitz is GGX: 1 / (1 + c3^2) lies within 45 degrees, and G < 1 beyond 30
    assert directional_albedo(make_brdf("blinn", wide | {"c3": c3}), 0.0) == pytest.approx(
        1 / (1 + c3**2), abs=0.02
    )


@pytest.mark.parametrize("name", ["plastic", "plastic-schlick"])
@pytest.mark.parametrize("roughness", [0.1, 0.4])
@pytest.mark.parametrize("theta", TILTS)
def test_white_ground_returns_all_that_enters_the_coat(name, roughness, theta):
    """What a white ground adds is what the coat alone, integrated by another rule, does not send back."""
    white, coat = (make_brdf(name, {"albedo": (a,), "roughness": roughness}) for a in (1.0, 0.0))

    def lobe(*angles):
        theta_i, theta_r, dphi = np.broadcast_arrays(*angles)
        return coat(directions(theta_i, 0.0 * theta_i), directions(theta_r, dphi))

    added = directional_albedo(white, theta)[0] - directional_albedo(coat, theta)[0]
    assert added == pytest.approx(1.0 - albedo_by_quadrature(lobe, theta, 0.5 * roughness)[0], abs=1e-3)


def test_brushed_metal_is_streaked_across_the_strokes():
    brdf, up = make_brdf("brushed-metal"), np.array([0.0, 0.0, 1.0])
    along, across = (directions(np.array(0.5), np.array(phi)) for phi in (0.0, np.pi / 2))
    assert brdf(up, across)[0] > 5 * brdf(up, along)[0]


@pytest.mark.parametrize(
    "bad",
    [
        {"albedo": "red"},
        {"roughness": 0.0},
        {"albedo": []},
        {"ior": float("nan")},
        {"roughness": [0.1, 0.2, 0.3]},
    ],
)
def test_parameters_that_no_plastic_has_are_refused(bad):
    with pytest.raises(InputError, match=next(iter(bad))):
        make_brdf("plastic", bad)


def test_unknown_names_are_refused_with_what_there_is():
    with pytest.raises(InputError, match="lambert"):
        make_brdf("lambertt")
    with pytest.raises(InputError, match="sigma"):
        make_brdf("oren-nayar", {"roughness": 0.2})
