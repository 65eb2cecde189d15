"""Measured rows that turn are told from rows that do not, and their fit turns."""

import numpy as np
import pytest

from benchmarks.symmetry_choice import Turned
from photogonio.reconstruct.estimate.weights import error_model
from photogonio.reconstruct.fit import fit_table
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.rows.row_average import average_of
from photogonio.reconstruct.rows.row_noise import with_noise
from photogonio.reconstruct.symmetry import row_turns
from photogonio.reconstruct.symmetry.row_turns import LEAST_SHARE, SHARE, judge_rows
from photogonio.reconstruct.symmetry.verdict import CONVINCING
from photogonio.reconstruct.table.cells import cells_of
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table
from photogonio.synthetic.brdf.library import make_brdf

ROWS, NOISE, ORDER = 205, 0.05, 12
BRUSHED = make_brdf("anisotropic-ggx", {"f0": (0.8,), "roughness_x": 0.37, "roughness_y": 0.25})


def table(surface, seed=0, around=np.pi, noise=NOISE):
    rng = np.random.default_rng(seed)
    theta_i, theta_r = np.arccos(rng.uniform(0.2, 1.0, (2, ROWS)))
    phi_i, phi_r = rng.uniform(-around, around, (2, ROWS))
    value = surface(unit_vectors(theta_i, phi_i), unit_vectors(theta_r, phi_r))[:, :1]
    value = value + noise * value.mean() * rng.normal(size=value.shape)
    return samples_table(GoniometerSamples(theta_i, phi_i, theta_r, phi_r, value, None, ("Y",)))


@pytest.mark.parametrize("azimuth", [0.0, 50.0])
def test_roughnesses_in_the_ratio_of_three_to_two_are_found_with_their_axis(azimuth):
    surface = Turned(BRUSHED, np.radians(azimuth))
    fit = fit_table(table(surface))
    assert fit.symmetry.symmetry == "reciprocal" and fit.brdf.turning
    other = table(surface, seed=1)
    angles = other.incident, other.exit
    said, plain = fit.brdf(*angles), make_brdf("ggx-conductor", {"f0": (0.8,), "roughness": 0.3})(*angles)
    true = surface(*angles)[:, :1]
    assert np.mean((said - true) ** 2) < 0.5 * np.mean((plain[:, :1] - true) ** 2)


@pytest.mark.parametrize(
    ("name", "parameters"),
    [
        ("plastic", {"albedo": (0.3,), "roughness": 0.3}),
        ("blinn-phong", {"albedo": (0.3,), "power": 20.0}),
        ("oren-nayar", {}),
    ],
)
def test_a_peak_of_another_shape_is_not_taken_for_one_that_turns(name, parameters):
    fit = fit_table(table(make_brdf(name, parameters)))
    assert fit.symmetry.symmetry == "isotropic" and not fit.brdf.turning


def judged(surface, noise=NOISE):
    rows = with_noise(cells_of(table(surface, noise=noise)))
    return judge_rows(rows, average_of(rows, error_model(rows), ORDER))


def test_what_is_not_seen_to_turn_is_told_to_be_tested_or_not():
    """A gloss among little noise would have shown another roughness, among much it would not, and without one none."""
    gloss = make_brdf("plastic", {"albedo": (0.3,), "roughness": 0.3})
    told, untold, matte = (
        judged(*one)[0] for one in ((gloss,), (gloss, 0.5), (make_brdf("oren-nayar", {}),))
    )
    assert [one.symmetry for one in (told, untold, matte)] == 3 * ["isotropic"]
    assert told.could_show > CONVINCING > untold.could_show and matte.could_show is None
    assert "at least" in told.reason and "assumed" in untold.reason and "no gloss" in matte.reason


@pytest.mark.parametrize(
    ("name", "parameters", "seed", "noise"),
    [
        ("phong", {"albedo": (0.3,), "power": 3.0}, 0, NOISE),
        ("phong", {"albedo": (0.3,), "power": 3.0}, 1, NOISE),
        ("oren-nayar", {}, 2, 0.3),
    ],
)
def test_a_fit_without_a_mirror_lobe_claims_nothing_of_roughnesses(name, parameters, seed, noise):
    """The test's own lobes were likely; the average that is told has none."""
    fit = fit_table(table(make_brdf(name, parameters), seed=seed, noise=noise))
    assert not fit.brdf.lobes and fit.symmetry.tested
    assert "would" not in fit.symmetry.reason and fit.symmetry.could_show is None
    told = fit.diagnostics["symmetry"] | fit.brdf.fit["symmetry"]
    assert not [key for key, value in told.items() if "would show" in key and value is not None]


def test_rows_that_turn_do_so_whatever_neighbourhoods_left_out_say(monkeypatch):
    """An average by left-out neighbourhoods may be of the ridge alone; what the rows say of turning is no less sure."""

    def first_of_none(cells, deviation, order, lobes, least=0.0):
        return average_of(cells, deviation, order, lobes if least else [], least)

    monkeypatch.setattr(row_turns, "average_of", first_of_none)
    verdict, found = judged(Turned(BRUSHED, 0.5))
    assert verdict.symmetry == "reciprocal" and "neighbourhoods left out gain nothing" in verdict.reason
    turning = [one.weight for one in found.members if one.lobes.turning]
    assert found.model.turning and sum(turning) > 0.5 * LEAST_SHARE * SHARE


def test_rows_at_one_rotation_prove_nothing():
    assert "one rotation only" in fit_table(table(BRUSHED, around=0.05)).symmetry.reason
