"""The file's lobes and errors against an evaluator written from docs/modes.md alone (tests/file_oracle.py)."""

from __future__ import annotations

import json
from itertools import product

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf, load_brdf
from photogonio.reconstruct.brdf.errors import RelativeTable, Uncertain
from photogonio.reconstruct.brdf.mixing import mixed
from photogonio.reconstruct.brdf.parameters import lobe_numbers, mode_names
from photogonio.reconstruct.brdf.words import described
from photogonio.reconstruct.lobes.lobe import DISTRIBUTIONS, MASKINGS, Lobe
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.modes.basis import general_modes, isotropic_modes, reciprocal_modes
from tests import file_oracle

LISTS = {"isotropic": isotropic_modes, "reciprocal": reciprocal_modes, "general": general_modes}
WEIGHT, F0 = np.array([1.0, 0.7, 0.4]), np.array([0.04, 0.5, 0.9])


def directions(count, seed=0, lowest=89.0):
    rng = np.random.default_rng(seed)
    theta = np.arccos(rng.uniform(np.cos(np.radians(lowest)), 1.0, (2, count)))
    phi = rng.uniform(-np.pi, np.pi, (2, count))
    return unit_vectors(theta[0], phi[0]), unit_vectors(theta[1], phi[1])


def brdf_of(*lobes, symmetry="isotropic", order=2, seed=1, quantity="brdf"):
    modes = LISTS[symmetry](order)
    values = np.random.default_rng(seed).normal(size=(len(modes), 3))
    errors = np.full_like(values, np.nan)
    channels = ("R", "G", "B")
    return Brdf(order, channels, modes, values, errors, quantity, symmetry, tuple(lobes))


def mirror(roughness, **kind):
    f0 = np.full(3, 0.05) if kind.get("fresnel") == "dielectric" else F0
    return Lobe(roughness, f0, WEIGHT, **kind)


def coat(roughness, **kind):
    ground = np.array([0.35, 0.2, 0.1])
    return Lobe(roughness, np.full(3, 0.043), WEIGHT, "coat", fresnel="dielectric", ground=ground, **kind)


MIRRORS = [
    mirror(rough, distribution=distribution, masking=masking, fresnel=fresnel, azimuth=0.5)
    for rough, distribution, masking, fresnel in product(
        (0.05, 0.4, (0.45, 0.15)), DISTRIBUTIONS, MASKINGS, ("schlick", "dielectric")
    )
]
RETROS = [Lobe(0.1, np.ones(3), WEIGHT, "retro", distribution=name) for name in DISTRIBUTIONS]
COATS = [
    coat(rough, distribution=distribution, masking=masking)
    for rough, distribution, masking in product((0.06, 0.3), DISTRIBUTIONS, MASKINGS)
]


@pytest.mark.parametrize("symmetry", LISTS)
def test_mirror_lobes_peaks_and_modes_are_the_pages(tmp_path, symmetry):
    incident, exit = directions(2000)
    for k, lobe in enumerate([*MIRRORS, *RETROS]):
        brdf = brdf_of(lobe, symmetry=symmetry, seed=k)
        brdf.save(tmp_path / "b.json")
        page = file_oracle.f_of(tmp_path / "b.json", incident, exit)
        scale = np.abs(page).max(0)  # modes cancel to nothing in places
        assert np.abs(brdf(incident, exit) - page).max() <= 1e-9 * scale.max()
        alone = brdf_of(lobe, symmetry=symmetry, order=0)
        alone = Brdf(0, alone.channels, alone.modes, 0 * alone.coefficients, alone.standard_errors,
                     symmetry=symmetry, lobes=(lobe,))  # fmt: skip
        alone.save(tmp_path / "b.json")
        page = file_oracle.f_of(tmp_path / "b.json", incident, exit)
        some = page > 1e-200
        np.testing.assert_allclose(alone(incident, exit)[some], page[some], rtol=1e-9)


@pytest.mark.parametrize(
    "lobe", COATS, ids=lambda lobe: f"{lobe.roughness} {lobe.distribution} {lobe.masking}"
)
def test_coats_are_the_pages_to_what_their_quadrature_gives(tmp_path, lobe):
    incident, exit = directions(60)
    brdf = brdf_of(lobe, order=0, seed=5)
    brdf = Brdf(0, brdf.channels, brdf.modes, np.abs(brdf.coefficients), brdf.standard_errors, lobes=(lobe,))
    brdf.save(tmp_path / "b.json")
    page = file_oracle.f_of(tmp_path / "b.json", incident, exit)
    np.testing.assert_allclose(brdf(incident, exit), page, rtol=1e-4)


def test_a_coat_of_two_roughnesses_is_the_pages(tmp_path):
    incident, exit = directions(40, lowest=85.0)
    brdf = brdf_of(coat((0.4, 0.2), azimuth=0.7), symmetry="reciprocal", order=0, seed=2)
    brdf.save(tmp_path / "b.json")
    page = file_oracle.f_of(tmp_path / "b.json", incident, exit)
    np.testing.assert_allclose(brdf(incident, exit), page, rtol=1e-4)


@pytest.mark.parametrize("lobe", [*MIRRORS[::3], *RETROS, *COATS[::2], coat((0.4, 0.2), azimuth=0.7)])
def test_lobes_are_reciprocal_positive_and_send_out_no_more_than_comes_in(lobe):
    incident, exit = directions(500)
    brdf = Brdf(0, ("R", "G", "B"), np.empty((0, 3), int), np.empty((0, 3)), np.empty((0, 3)), lobes=(lobe,))
    f = brdf(incident, exit)
    assert (f >= 0.0).all()
    np.testing.assert_allclose(f, brdf(exit, incident), rtol=1e-9, atol=1e-300)
    assert (brdf.directional_albedo(np.radians([0.0, 40.0, 75.0, 85.0]), 0.3) <= 1.0 + 1e-6).all()


def test_nothing_is_sent_from_below_the_surface_or_to_it():
    incident, exit = directions(50)
    brdf = brdf_of(*COATS[:1], *MIRRORS[:1], *RETROS[:1])
    below = exit * [1.0, 1.0, -1.0]
    assert (brdf(incident, below) == 0.0).all() and (brdf(below, incident) == 0.0).all()
    assert (brdf.evaluate(1.6, 0.0, 0.3, 0.0) == 0.0).all()
    assert np.isnan(brdf.evaluate(np.nan, 0.0, 0.3, 0.0)).all()


def test_albedos_are_the_integrals_of_f():
    """Against a plain rule over the exit hemisphere: 300 x 300 midpoints, even in cos^2 theta."""
    brdf = brdf_of(coat(0.4), mirror((0.5, 0.3), azimuth=0.4), order=0)
    cos = np.sqrt((np.arange(300) + 0.5) / 300)
    phi = 2 * np.pi * (np.arange(300) + 0.5) / 300
    theta_r, phi_r = (grid.ravel() for grid in np.meshgrid(np.arccos(cos), phi))
    for theta_i, phi_i in ((0.1, 0.0), (0.9, 1.0)):
        sent = np.pi * brdf.evaluate(theta_i, phi_i, theta_r, phi_r).mean(0)
        np.testing.assert_allclose(brdf.directional_albedo(theta_i, phi_i), sent, rtol=2e-3)


def uncertain(brdf, seed=3):
    """Errors of every number, which know of one another, and both tables."""
    names = mode_names(brdf.symmetry, brdf.modes)
    names += [f"lobe {k} {what}" for k, lobe in enumerate(brdf.lobes) for what in lobe_numbers(lobe)]
    rng = np.random.default_rng(seed)
    root = 0.003 * rng.normal(size=(len(brdf.channels), len(names), len(names)))
    covariance = root @ np.swapaxes(root, 1, 2)
    errors = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).T
    table = RelativeTable(
        np.array([20.0, 60.0]),
        np.array([20.0, 60.0]),
        np.array([45.0, 135.0]),
        rng.uniform(0, 0.1, (2, 2, 2)),
    )
    one = RelativeTable(np.array([45.0]), np.array([45.0]), np.array([90.0]), np.full((1, 1, 1), 0.02))
    known = Uncertain(tuple(names), errors, covariance, 0.005, table, one)
    return Brdf(brdf.order, brdf.channels, brdf.modes, brdf.coefficients, errors[: len(brdf.modes)],
                symmetry=brdf.symmetry, lobes=brdf.lobes, uncertainty=known)  # fmt: skip


@pytest.mark.parametrize(
    "lobe", [mirror(0.3), mirror((0.45, 0.2), azimuth=0.5), coat(0.3, distribution="beckmann"), RETROS[0]]
)
def test_errors_of_f_are_what_the_page_says(tmp_path, lobe):
    brdf = uncertain(brdf_of(lobe, symmetry="reciprocal" if lobe.turning else "isotropic", order=1))
    brdf.save(tmp_path / "b.json")
    incident, exit = directions(25, lowest=80.0)
    page = file_oracle.standard_error(tmp_path / "b.json", incident, exit)
    back = load_brdf(tmp_path / "b.json")
    angles = [np.arccos(incident[:, 2]), np.arctan2(incident[:, 1], incident[:, 0])]
    angles += [np.arccos(exit[:, 2]), np.arctan2(exit[:, 1], exit[:, 0])]
    # both take differences, of other steps
    np.testing.assert_allclose(back.standard_error(*angles), page, rtol=1e-3)


def test_a_round_trip_keeps_every_bit(tmp_path):
    brdf = uncertain(brdf_of(coat(0.3), mirror((0.45, 0.2), azimuth=0.5), RETROS[1], symmetry="reciprocal"))
    brdf.save(tmp_path / "a.json")
    load_brdf(tmp_path / "a.json").save(tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    assert json.loads((tmp_path / "a.json").read_text())["version"] == 2


def test_many_parameters_have_their_covariance_beside_the_file(tmp_path):
    brdf = uncertain(brdf_of(mirror(0.3), order=14))
    assert len(brdf.uncertainty.parameters) > 150
    brdf.save(tmp_path / "coefficients.json")
    assert "channels" not in json.loads((tmp_path / "coefficients.json").read_text())["covariance"]
    back = load_brdf(tmp_path / "coefficients.json")
    np.testing.assert_array_equal(back.uncertainty.covariance, brdf.uncertainty.covariance)
    uncertain(brdf_of(mirror(0.3), order=14), seed=9).save(tmp_path / "other.json")
    with pytest.raises(InputError, match=r"covariance: covariance\.npz beside it is of other coefficients"):
        load_brdf(tmp_path / "coefficients.json")
    (tmp_path / "covariance.npz").unlink()
    assert load_brdf(tmp_path / "coefficients.json").uncertainty.covariance is None


def test_version_1_is_read_and_written_back_as_it_was(tmp_path):
    lobes = [
        {"model": "ggx", "roughness": 0.31, "f0": [0.04], "weight": [1.0]},
        {"model": "retro-beckmann", "roughness": 0.2, "f0": [1.0], "weight": [0.3]},
    ]
    page = {"format": "surface-scattering-modes", "version": 1, "quantity": "brdf", "symmetry": "isotropic",
            "order": 0, "channels": ["Y"], "modes": [[0, 0, 0]], "coefficients": [[0.5]], "standard_errors": [[0.1]],
            "lobes": lobes, "scale": "absolute", "valid": {}, "fit": {}, "source": {}}  # fmt: skip
    (tmp_path / "one.json").write_text(json.dumps(page))
    brdf = load_brdf(tmp_path / "one.json")
    incident, exit = directions(300)
    page_f = file_oracle.f_of(tmp_path / "one.json", incident, exit)
    np.testing.assert_allclose(brdf(incident, exit), page_f, rtol=1e-9)
    brdf.save(tmp_path / "back.json")
    assert json.loads((tmp_path / "back.json").read_text()) == page


GOOD = {"format": "surface-scattering-modes", "version": 2, "channels": ["Y"], "modes": [[0, 0, 0]],
        "coefficients": [[1.0]]}  # fmt: skip
MIRROR = {"model": "mirror", "roughness": 0.3, "f0": [0.04], "weight": [1.0]}
COAT = {"model": "coat", "roughness": 0.3, "f0": 0.04, "weight": [1.0], "ground": [0.3]}
TABLE = {"theta_i": [45], "theta_r": [45], "dphi": [90], "relative": [[[0.1]]]}
WRONG = {
    "lobes[0].model": {"lobes": [MIRROR | {"model": "phong"}]},
    "lobes[0].distribution": {"lobes": [MIRROR | {"distribution": "gauss"}]},
    "lobes[0].masking": {"lobes": [MIRROR | {"masking": "none"}]},
    "lobes[0].fresnel": {"lobes": [COAT | {"fresnel": "schlick"}]},
    "lobes[0].roughness": {"lobes": [MIRROR | {"roughness": [0.3, 0.0]}]},
    "lobes[0].azimuth": {"lobes": [MIRROR | {"roughness": [0.3, 0.2], "azimuth": "north"}]},
    "lobes[0].f0": {"lobes": [COAT | {"f0": [0.04]}]},
    "lobes[0].ground": {"lobes": [{key: value for key, value in COAT.items() if key != "ground"}]},
    "parameters": {"parameters": ["S 0 0 0", "lobe 0 roughness"]},
    "parameters ": {"lobes": [MIRROR], "parameters": ["S 0 0 0", "lobe 0 ground"]},
    "parameters  ": {"parameters": []},
    "standard_errors": {"parameters": ["S 0 0 0"], "standard_errors": [[0.1], [0.2]]},
    "covariance": {"parameters": ["S 0 0 0"], "covariance": [1.0]},
    "covariance.channels": {"parameters": ["S 0 0 0"], "covariance": {"channels": [[1.0, 2.0]]}},
    "beyond": {"beyond": 0.1},
    "beyond.scale": {"beyond": {"scale": -0.1}},
    "beyond.misfit.theta_i": {"beyond": {"misfit": TABLE | {"theta_i": [50, 40]}}},
    "beyond.unseen.relative": {"beyond": {"unseen": TABLE | {"relative": [0.1, 0.2]}}},
}


@pytest.mark.parametrize("key", WRONG)
def test_what_is_refused_names_the_key(tmp_path, key):
    path = tmp_path / "bad.json"
    path.write_text(json.dumps(GOOD | {"lobes": [MIRROR, COAT]}))
    load_brdf(path)
    path.write_text(json.dumps(GOOD | WRONG[key]))
    with pytest.raises(InputError) as refused:
        load_brdf(path)
    message = str(refused.value)
    assert message.startswith(f"{path}: {key.strip()}: ") and "\n" not in message


def test_defaults_are_the_pages(tmp_path):
    lobes = [{"model": "ggx"} | {key: MIRROR[key] for key in ("roughness", "f0", "weight")}, MIRROR, COAT]
    (tmp_path / "b.json").write_text(json.dumps(GOOD | {"lobes": lobes}))
    first, second, third = load_brdf(tmp_path / "b.json").lobes
    assert (first.model, first.distribution, first.masking, first.fresnel) == (
        "mirror", "ggx", "correlated", "schlick",
    )  # fmt: skip
    assert first.evaluate(0.3, 0.4, 2.0) == pytest.approx(second.evaluate(0.3, 0.4, 2.0), rel=1e-15)
    assert third.fresnel == "dielectric"


def test_channels_are_mixed_as_their_values_and_errors_are():
    """Errors against draws of the parameters, the lobes' shapes being shared by the channels and all else their own."""
    matrix = np.array([[0.7, 0.2, 0.1], [0.1, 0.8, 0.1]])
    brdf = brdf_of(coat(0.3), mirror(0.4), order=1)
    incident, exit = directions(200)
    both = mixed(brdf, matrix, ("A", "B"))
    np.testing.assert_allclose(both(incident, exit), brdf(incident, exit) @ matrix.T, rtol=1e-9, atol=1e-9)
    known = uncertain(brdf)
    shared = [k for k, name in enumerate(known.uncertainty.parameters) if name.endswith("roughness")]
    shared += [known.uncertainty.parameters.index("lobe 0 f0")]
    covariance = known.uncertainty.covariance.copy()
    for k in range(3):  # shapes alike, and of no effect on the rest
        covariance[k, shared], covariance[k, :, shared] = 0.0, 0.0
        covariance[k, shared, shared] = 1e-6
    alike = Uncertain(
        known.uncertainty.parameters, np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).T, covariance
    )
    known = Brdf(known.order, known.channels, known.modes, known.coefficients, known.standard_errors,
                 lobes=known.lobes, uncertainty=alike)  # fmt: skip
    error = mixed(known, matrix, ("A", "B")).standard_error(0.4, 0.0, 0.7, 2.5)
    still = np.ix_(shared, shared)
    moved = covariance.copy()
    moved[0][still] = moved[1][still] = moved[2][still] = 0.0
    free = Uncertain(alike.parameters, alike.standard_errors, moved)
    only = Brdf(known.order, known.channels, known.modes, known.coefficients, known.standard_errors,
                lobes=known.lobes, uncertainty=free).standard_error(0.4, 0.0, 0.7, 2.5)  # fmt: skip
    own = np.sqrt(only**2 @ (matrix**2).T)
    rest = np.sqrt(np.maximum(known.standard_error(0.4, 0.0, 0.7, 2.5) ** 2 - only**2, 0.0))
    assert (error >= own * 0.999).all()
    assert (error**2 <= own**2 * 1.001 + (rest @ matrix.T) ** 2 * 1.01).all()


def test_words_are_those_of_the_page():
    plain = Brdf(0, ("Y",), np.zeros((1, 3), int), np.ones((1, 1)), np.ones((1, 1)))
    one = np.ones(1)
    coated = Lobe(0.25, 0.04 * one, one, "coat", fresnel="dielectric", ground=0.3 * one)
    brushed = Lobe((0.45, 0.15), one, one, azimuth=np.radians(30.0))

    def said(*lobes):
        return described(Brdf(0, ("Y",), plain.modes, plain.coefficients, plain.standard_errors, lobes=lobes))

    assert said() == "order 0, no lobe"
    assert said(coated) == "order 0 and a coat of roughness 0.25 over a diffuse ground"
    assert said(brushed) == "order 0 and a mirror lobe of roughness 0.45 along 30 degrees, 0.15 across"
    assert said(coated, Lobe(0.1, one, one, "retro")).endswith(
        "ground and a retro-reflective peak of roughness 0.1"
    )
