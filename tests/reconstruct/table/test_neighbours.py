"""What the rows about a pair say of it: exact where their logarithms are linear, and deaf to single rows."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.neighbours import NEIGHBOURS, apart, expected, places


def rows(n: int = 400) -> np.ndarray:
    rng = np.random.default_rng(0)
    theta_i, theta_r = np.arccos(rng.uniform(0.2, 1.0, (2, n)))
    return places(theta_i, theta_r, rng.uniform(-np.pi, np.pi, n))


def test_distances_of_places_are_about_those_of_directions():
    rng = np.random.default_rng(1)
    theta_i, theta_r, dphi = rng.uniform(0.2, 1.2, (3, 200))
    step = 1e-4 * rng.normal(size=(3, 200))
    apart = np.linalg.norm(
        places(theta_i, theta_r, dphi) - places(theta_i + step[0], theta_r + step[1], dphi + step[2]), axis=1
    )
    exit = unit_vectors(theta_r, dphi) - unit_vectors(theta_r + step[1], dphi + step[2])
    np.testing.assert_allclose(apart, np.hypot(step[0], np.linalg.norm(exit, axis=1)), rtol=1e-3)


def test_both_sides_of_the_plane_of_incidence_are_one_place():
    theta = np.array([0.3, 0.9])
    np.testing.assert_allclose(places(theta, theta, -theta), places(theta, theta, theta), atol=1e-15)
    around = places(theta, theta, theta + 2.0 * np.pi)
    np.testing.assert_allclose(around, places(theta, theta, theta), atol=1e-14)


@pytest.mark.parametrize("own", [False, True])
def test_the_same_everywhere_is_expected_everywhere(own):
    at = rows()
    found = expected(at, np.full(len(at), 0.3), at if own else rows(50) + 1e-3, own=own)
    np.testing.assert_allclose(found.value, 0.3, rtol=1e-9)
    np.testing.assert_allclose(found.straight, 0.3, rtol=1e-9)
    # of values that differ by nothing a spread is told down to what keeps the weights finite
    assert (found.spread < 1e-6).all() and (found.least <= found.value).all()


def test_an_exponential_of_places_is_said_by_its_logarithm_and_not_by_a_plane():
    """Over a neighbourhood it changes by half of itself: a plane misses the bend, the logarithm has none. A ridge of a
    thousandth holds slopes back where neighbours lie all but in a line, which few do."""
    at = rows(2000)
    value = np.exp(at[:, :3] @ [4.0, -3.0, 2.0] - 1.0)
    inside = (at[:, 0] > 0.3) & (at[:, 0] < 1.0) & (at[:, 3] < 0.9) & (at[:, 3] > 0.4)
    found = expected(at, value, at[inside], own=True)
    off, bent = (np.median(np.abs(one / value[inside] - 1.0)) for one in (found.value, found.straight))
    assert off < 0.005
    assert bent > 5.0 * off


def test_a_row_is_judged_by_the_others_alone():
    at = rows()
    value = np.full(len(at), 0.2)
    value[17] = 50.0
    found = expected(at, value, at[17:18], own=True)
    assert found.value[0] == pytest.approx(0.2, rel=1e-6)
    # and does not speak for its neighbours, of which it is one
    near = np.argsort(np.linalg.norm(at - at[17], axis=1))[1 : NEIGHBOURS // 2]
    np.testing.assert_allclose(expected(at, value, at[near], own=True).value, 0.2, rtol=1e-3)


def test_fewer_rows_than_neighbours_do():
    at = rows(6)
    assert np.isfinite(expected(at, np.linspace(0.1, 0.2, 6), at, own=True).value).all()


def test_a_value_counts_once_for_each_place_that_it_comes_at() -> None:
    rng = np.random.default_rng(3)
    number = rng.integers(-2, 3, (400, 4)).astype(float) * [7850.0, 10000.0, 5000.0, 5000.0]
    value = np.round(rng.uniform(-0.5, 0.5, 400), 1)
    one_by_one = np.unique(np.column_stack([value, number]), axis=0)[:, 0]
    assert len(one_by_one) < 400
    np.testing.assert_array_equal(apart(value, number), one_by_one)
