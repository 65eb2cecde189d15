"""Measured rows that turn are told from rows that do not, and their fit turns."""

import numpy as np
import pytest

from benchmarks.symmetry_choice import Turned
from photogonio.reconstruct.fit import fit_table
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table
from photogonio.synthetic.brdf.library import make_brdf

ROWS, NOISE = 205, 0.05
BRUSHED = make_brdf("anisotropic-ggx", {"f0": (0.8,), "roughness_x": 0.37, "roughness_y": 0.25})


def table(surface, seed=0, around=np.pi):
    rng = np.random.default_rng(seed)
    theta_i, theta_r = np.arccos(rng.uniform(0.2, 1.0, (2, ROWS)))
    phi_i, phi_r = rng.uniform(-around, around, (2, ROWS))
    value = surface(unit_vectors(theta_i, phi_i), unit_vectors(theta_r, phi_r))[:, :1]
    value = value + NOISE * value.mean() * rng.normal(size=value.shape)
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


def test_rows_at_one_rotation_prove_nothing():
    assert "one rotation only" in fit_table(table(BRUSHED, around=0.05)).symmetry.reason
