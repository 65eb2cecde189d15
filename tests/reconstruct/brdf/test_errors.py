"""What a file's errors are at a pair of directions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.brdf.brdf import load_brdf
from photogonio.reconstruct.brdf.errors import RelativeTable, Uncertain
from tests import file_oracle
from tests.drawn.brdfs import RETROS, brdf_of, coat, directions, mirror, uncertain

LOBES = [
    mirror(0.3),
    mirror(0.3, distribution="beckmann", masking="separable", fresnel="dielectric"),
    mirror((0.45, 0.2), azimuth=0.5),
    mirror((0.3, 0.2), azimuth=0.5, distribution="beckmann", masking="separable", fresnel="dielectric"),
    coat(0.3, distribution="beckmann"),
    coat(0.3, masking="separable"),
    coat((0.4, 0.2), azimuth=0.7),
    *RETROS,
]


@pytest.mark.parametrize("lobe", LOBES, ids=lambda one: f"{one.model} {one.roughness} {one.distribution}")
def test_errors_of_f_are_what_the_page_says(tmp_path, lobe):
    brdf = uncertain(brdf_of(lobe, symmetry="reciprocal" if lobe.turning else "isotropic", order=1))
    brdf.save(tmp_path / "b.json")
    count = 6 if lobe.model == "coat" else 25  # each albedo of the page's is a quadrature
    incident, exit = directions(count, lowest=80.0)
    page = file_oracle.standard_error(tmp_path / "b.json", incident, exit)
    back = load_brdf(tmp_path / "b.json")
    angles = [np.arccos(incident[:, 2]), np.arctan2(incident[:, 1], incident[:, 0])]
    angles += [np.arccos(exit[:, 2]), np.arctan2(exit[:, 1], exit[:, 0])]
    # both take differences, of other steps
    np.testing.assert_allclose(back.standard_error(*angles), page, rtol=1e-3)


NODES = (np.array([20.0, 40.0, 70.0]), np.array([10.0, 60.0]), np.array([45.0, 135.0]))


def table(of) -> RelativeTable:
    return RelativeTable(*NODES, of(*np.meshgrid(*NODES, indexing="ij")))


def test_a_table_is_exact_for_what_is_linear_between_nodes_and_constant_outside():
    def plane(i, r, d):
        return 0.5 + 0.01 * i - 0.004 * r + 0.002 * d

    found = table(plane)
    rng = np.random.default_rng(0)
    angles = [rng.uniform(axis[0], axis[-1], 200) for axis in NODES]
    np.testing.assert_allclose(found.at(*np.radians(angles)), plane(*angles), rtol=1e-12)
    beyond = [np.array([0.0, 85.0]), np.array([0.0, 89.0]), np.array([0.0, 180.0])]
    ends = [np.array([axis[0], axis[-1]]) for axis in NODES]
    np.testing.assert_allclose(found.at(*np.radians(beyond)), plane(*ends), rtol=1e-12)


def test_a_table_is_the_same_on_both_sides_of_the_plane_of_incidence_and_after_a_whole_turn():
    found = table(lambda i, r, d: d + 0.0 * i)
    i, r, d = np.radians([[30.0] * 5, [30.0] * 5, [50.0, 90.0, 120.0, 150.0, 20.0]])
    expected = found.at(i, r, d)
    for turn in (-d, d + 2.0 * np.pi, 2.0 * np.pi - d):
        np.testing.assert_allclose(found.at(i, r, turn), expected, rtol=1e-12)


def test_without_a_covariance_errors_know_nothing_of_one_another():
    errors = np.array([[0.1, 0.2], [0.3, 0.4], [np.nan, 0.5]])
    known = Uncertain(("a", "b", "c"), errors)
    spread = known.spread()
    np.testing.assert_allclose(spread[1], np.diag([0.04, 0.16, 0.25]))
    assert np.isnan(spread[0, 2, 2])
    np.testing.assert_array_equal(known.only([1]).spread(), spread[1:])


def test_what_is_beyond_parameters_adds_in_squares():
    one = RelativeTable(*(np.array([45.0]) for _ in range(3)), np.full((1, 1, 1), 0.04))
    known = Uncertain(("a",), np.zeros((1, 1)), scale=0.03, misfit=one)
    angle = np.array([0.4, 1.0])
    np.testing.assert_allclose(known.relative(angle, angle, angle), 0.05, rtol=1e-12)


def test_errors_are_0_below_the_horizon_where_f_is_and_unknown_of_no_direction():
    brdf = uncertain(brdf_of(mirror(0.3), order=1))
    theta_i = np.array([0.3, 2.0, np.nan, 0.3])
    error = brdf.standard_error(theta_i, 0.0, [0.2, 0.2, 0.2, -2.0], 0.5)
    f = brdf.evaluate(theta_i, 0.0, [0.2, 0.2, 0.2, -2.0], 0.5)
    assert (error[0] > 0.0).all() and np.isnan(error[2]).all()
    assert (error[[1, 3]] == 0.0).all() and (f[[1, 3]] == 0.0).all()


def test_of_a_brdf_that_knows_no_errors_none_are_worked_out():
    brdf = brdf_of(mirror(0.3), order=1)
    brdf = replace(brdf, standard_errors=np.full_like(brdf.coefficients, np.nan), uncertainty=None)
    error = brdf.standard_error([0.3, 2.0], 0.0, 0.2, 0.5)
    assert np.isnan(error[0]).all() and (error[1] == 0.0).all()
