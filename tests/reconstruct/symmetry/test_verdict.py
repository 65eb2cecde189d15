"""Isotropic, reciprocal or general: chosen by test, and only from data that can tell."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.symmetry_choice import Turned
from photogonio.capture.errors import InputError
from photogonio.reconstruct.estimate.pilot import clean
from photogonio.reconstruct.fit import FitOptions, fit_table
from photogonio.reconstruct.symmetry.verdict import asked, judge, one_rotation, twins
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.uncertainty.in_file import UNTOLD
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.tables import TURNED_PLANE, Plan, simulate

BRUSHED = {"f0": (0.8,), "roughness_x": 0.3, "roughness_y": 0.2}
LIMIT = np.radians(70.0)


def verdict_on(surface, plan=TURNED_PLANE, seed=1):
    return judged(cells_of(simulate(surface, plan, seed=seed)))


def judged(cells):
    errors = np.full(len(cells.groups), 0.005)
    return judge(cells, errors, clean(cells, errors, lobes=None, absolute=True), absolute=True)


def test_brushed_metal_is_found_to_turn_with_its_axis():
    verdict = verdict_on(Turned(make_brdf("anisotropic-ggx", BRUSHED), np.radians(30.0)))
    assert verdict.symmetry == "reciprocal"
    assert verdict.log_odds > np.log(1e6) and verdict.chance <= 0.001
    assert "along 30 degrees" in verdict.reason and "p < 0.001" in verdict.reason


def test_plastic_is_isotropic_and_the_test_could_have_told():
    verdict = verdict_on(make_brdf("plastic", {"albedo": (0.4,), "roughness": 0.25}))
    assert verdict.symmetry == "isotropic"
    assert verdict.could_show > np.log(1e6)
    assert "would have had 10^" in verdict.reason


def test_a_peak_that_no_lobe_follows_is_not_taken_for_brushing():
    verdict = verdict_on(make_brdf("blinn-phong", {"albedo": (0.4,), "power": 40.0}), seed=4)
    assert verdict.symmetry == "isotropic"


@pytest.mark.parametrize("surface", [make_brdf("anisotropic-ggx", BRUSHED), make_brdf("plastic")])
def test_one_rotation_proves_nothing_and_the_report_says_so(surface):
    plan = replace(TURNED_PLANE, camera="fixed", views=8)
    verdict = verdict_on(surface, plan)
    assert verdict.symmetry == "isotropic" and verdict.log_odds is None
    assert "one rotation only, which cannot prove it" in verdict.reason


def test_a_lamp_and_a_camera_that_go_around_are_many_rotations_and_an_arc_of_either_is_one():
    n = 50
    around, arc = np.linspace(-np.pi, np.pi, n), np.linspace(0.1, 0.5, n)
    slant = np.full(n, 0.7)
    assert not one_rotation(Cells.of_directions(slant, around, slant, 2.0 * around))
    assert one_rotation(Cells.of_directions(slant, around, slant, arc))
    assert one_rotation(Cells.of_directions(slant, arc + np.pi * (np.arange(n) % 2), slant, around))


def goniometer(reflectance, seed=0):
    """Readings of pairs all around, with their exchanged twins, and half a per cent of noise."""
    rng = np.random.default_rng(seed)
    theta = np.arccos(rng.uniform(np.cos(1.2), 1.0, (2, 300)))
    phi = rng.uniform(-np.pi, np.pi, (2, 300))
    theta, phi = (np.concatenate([both, both[::-1]], axis=1) for both in (theta, phi))
    cells = Cells.of_directions(theta[0], phi[0], theta[1], phi[1])
    value = reflectance(theta[0], theta[1])[:, None]
    noisy = value * (1.0 + 0.005 * rng.normal(size=value.shape))
    return replace(cells, value=noisy, variance=(0.005 * value) ** 2, channels=("Y",))


def test_what_is_not_the_same_when_exchanged_is_general():
    cells = goniometer(lambda i, r: 0.2 * (1.0 + 0.2 * (np.cos(i) - np.cos(r))))
    verdict = judged(cells)
    assert verdict.symmetry == "general" and verdict.reciprocity == "broken"
    assert verdict.reason.startswith("incidence and exit cannot be exchanged")


def test_what_is_the_same_when_exchanged_keeps_reciprocity():
    cells = goniometer(lambda i, r: 0.2 * (1.0 + 0.2 * (np.cos(i) + np.cos(r))))
    verdict = judged(cells)
    assert verdict.symmetry == "isotropic" and verdict.reciprocity == "held"


def test_twins_are_the_pairs_seen_the_other_way_round():
    once = Cells.of_directions(np.full(9, 0.2), np.zeros(9), np.linspace(0.9, 1.4, 9), np.ones(9))
    assert twins(once) == 0.0
    cells = goniometer(lambda i, r: i + r)
    far = np.mean(np.abs(cells.theta_i - cells.theta_r) > np.radians(15.0))
    assert twins(cells) == pytest.approx(far)


def test_what_cannot_be_obeyed_is_refused():
    ball = cells_of(simulate(make_brdf("lambert"), Plan(views=3, pixels=300, level=2)))
    with pytest.raises(InputError, match="no azimuths"):
        asked("reciprocal", ball)
    assert asked("auto", ball).symmetry == "isotropic"
    plane = simulate(make_brdf("lambert"), replace(TURNED_PLANE, views=4, pixels=300, level=2))
    with pytest.raises(InputError, match="general modes to that order"):
        fit_table(plane, FitOptions(symmetry="general", order=12, lobes=0))


def relative_error(brdf, truth):
    """The project's relative error below 70 degrees, by random pairs of cosine weight."""
    rng = np.random.default_rng(5)
    theta = np.arcsin(np.sin(LIMIT) * np.sqrt(rng.uniform(size=(2, 4000))))
    phi = rng.uniform(-np.pi, np.pi, (2, 4000))
    where = [
        np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], 1)
        for t, p in zip(theta, phi, strict=True)
    ]
    true = truth(*where)
    return float(np.sqrt(np.sum((brdf(*where) - true) ** 2) / np.sum(true**2)))


def test_brushed_metal_is_fitted_and_said_in_the_files_terms():
    truth = make_brdf("anisotropic-ggx", {"f0": (0.8,), "roughness_x": 0.5, "roughness_y": 0.3})
    fit = fit_table(simulate(truth, replace(TURNED_PLANE, level=2, lamp_error=0.0)), FitOptions())
    assert fit.brdf.symmetry == "reciprocal"
    assert relative_error(fit.brdf, truth) <= 0.05
    assert fit.diagnostics["symmetry"]["chosen"] == "reciprocal"


@pytest.mark.parametrize("symmetry", ["reciprocal", "general"])
def test_a_symmetry_that_is_asked_for_is_obeyed(symmetry):
    table = simulate(make_brdf("oren-nayar", {"albedo": (0.4,)}), replace(TURNED_PLANE, views=12, level=2))
    fit = fit_table(table, FitOptions(symmetry=symmetry, lobes=0, order=2))
    assert fit.brdf.symmetry == symmetry and fit.brdf.order == 2
    assert fit.symmetry.reason == "asked for"
    cells = fit.cells
    # as many digits are in the file as change f by that share of its error, at pairs that lie between the cells, where
    # the error is some times that at the cells
    rounded = 3.0 * UNTOLD * fit.standard_error(cells)
    assert (np.abs(fit.predicted - fit.model.evaluate(cells)) <= rounded).all()
    assert np.median(np.abs(fit.predicted / cells.value - 1.0)) <= 0.02
    assert (fit.brdf.standard_errors > 0.0).all()
