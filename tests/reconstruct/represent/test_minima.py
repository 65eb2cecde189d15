"""Where a BRDF is least: grids, their neighbours, and valleys followed beside them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.reconstruct.represent.minima import (
    HALVINGS,
    Surface,
    dark_values,
    directions,
    followed,
    lowest_directions,
    lowest_pairs,
    moved_by,
    pairs,
    values,
)
from tests.drawn.brdfs import brdf_of, coat, mirror

GRID = directions(1.3, 7, 12)


def of_one_channel(symmetry: str, *lobes):
    return brdf_of(*lobes, symmetry=symmetry).only([0])


def test_neighbours_are_mutual_and_a_step_away():
    place = np.arange(len(GRID.theta))
    sides = GRID.neighbours(place)
    away_from_pole = GRID.theta[place] > GRID.steps[0] + 1e-9
    for k in range(4):
        back = GRID.neighbours(sides[k])
        last = sides[k] == place  # beyond the last one stays
        assert ((back == place).any(0) | last | ~away_from_pole).all()
        turn = np.abs((GRID.phi[sides[k]] - GRID.phi + np.pi) % (2 * np.pi) - np.pi)
        apart = np.array([np.abs(GRID.theta[sides[k]] - GRID.theta), turn])
        step = GRID.steps[0 if k < 2 else 1]
        moved = apart[0 if k < 2 else 1]
        np.testing.assert_allclose(moved[away_from_pole & ~last], step, rtol=1e-9)
    # of the pole: four directions of the first ring, a quarter apart
    np.testing.assert_allclose(np.sort(GRID.phi[sides[:, 0]]), 0.5 * np.pi * np.arange(4), atol=1e-12)
    assert GRID.distinct.sum() == len(GRID.theta) - GRID.azimuths + 1


@pytest.mark.parametrize("symmetry", ["reciprocal", "general"])
def test_values_on_the_grid_are_those_of_the_brdf(symmetry):
    brdf = brdf_of(mirror(0.4), mirror((0.5, 0.3), azimuth=0.4), symmetry=symmetry)
    found = values(brdf, GRID)
    rng = np.random.default_rng(0)
    i, r = rng.integers(0, len(GRID.theta), (2, 200))
    where = pairs(GRID, i, r)
    expected = brdf.evaluate(where.theta_i, where.phi_i, where.theta_r, where.phi_r)
    np.testing.assert_allclose(found[:, i, r].T, expected, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("symmetry", ["isotropic", "reciprocal", "general"])
def test_where_modes_are_dark_values_are_those_of_the_grid_and_nowhere_less(symmetry):
    brdf = brdf_of(mirror(0.4), mirror((0.5, 0.3), azimuth=0.4), symmetry=symmetry)
    every, dark = values(brdf, GRID), dark_values(brdf, GRID)
    below = (values(replace(brdf, lobes=()), GRID) < 0.0).any(0)
    assert 0.1 < below.mean() < 1.0
    np.testing.assert_allclose(dark[:, below], every[:, below], rtol=1e-9, atol=1e-9)
    assert ((dark >= 0.0) | below).all() and (dark <= every + 1e-9).all()


@pytest.mark.parametrize("symmetry", ["isotropic", "reciprocal", "general"])
def test_under_a_coat_that_turns_values_below_0_are_those_of_the_grid(symmetry):
    brdf = brdf_of(coat((0.5, 0.3), azimuth=0.4), symmetry=symmetry)
    lambert = np.array([1.0, *np.zeros(len(brdf.modes) - 1)])[:, None]
    brdf = replace(brdf, coefficients=brdf.coefficients - brdf.coefficients.max() * lambert)
    every, dark = values(brdf, GRID), dark_values(brdf, GRID)
    below = (every < 0.0).any(0)
    assert 0.1 < below.mean() < 1.0
    np.testing.assert_array_equal((dark < 0.0).any(0), below)
    np.testing.assert_allclose(dark[:, below], every[:, below], rtol=1e-9, atol=1e-9)
    assert (dark <= every + 1e-9).all()


def test_a_lobe_that_takes_light_away_is_looked_at_everywhere():
    brdf = brdf_of(replace(mirror((0.5, 0.3)), weight=-np.ones(3)), symmetry="reciprocal")
    np.testing.assert_array_equal(dark_values(brdf, GRID), values(brdf, GRID))


def test_a_surface_beside_pairs_is_the_brdf_there():
    brdf = of_one_channel("reciprocal", mirror((0.5, 0.3), azimuth=0.4))
    place = np.column_stack([GRID.theta[20:30], GRID.phi[20:30], GRID.theta[40:50], GRID.phi[40:50]])
    moves = 0.05 * np.vstack([np.zeros((1, 4)), np.eye(4), -np.eye(4)])
    found = Surface.of(brdf, 1.3)(place, moves)
    for k, where in enumerate(moved_by(place, moves, 1.3)):
        np.testing.assert_allclose(found[k], brdf.evaluate(*where.T)[:, 0], rtol=1e-10, atol=1e-10)


def test_the_lowest_direction_of_the_grid_is_among_its_valleys():
    rng = np.random.default_rng(2)
    value = 1.0 + 0.1 * rng.normal(size=len(GRID.theta))
    value[: GRID.azimuths] = value[0]  # the pole is one direction
    lowest = int(value.argmin())
    found = lowest_directions(value, GRID, limit=value.min() + 1e-9)
    assert [GRID.theta[lowest], GRID.phi[lowest]] == pytest.approx(found[0])
    assert len(lowest_directions(np.ones_like(value), GRID, limit=0.5)) == 0


def test_the_lowest_pair_of_the_grid_is_among_its_valleys():
    value = values(of_one_channel("reciprocal"), GRID)[0]
    found = lowest_pairs(value, GRID, limit=value.min() + 1e-6, symmetric=True)
    f = of_one_channel("reciprocal").evaluate(*found.T)[:, 0]
    assert f.min() == pytest.approx(value.min(), abs=1e-9)
    twins = lowest_pairs(value, GRID, limit=value.min() + 1e-6, symmetric=False)
    assert len(found) < len(twins)


def test_a_valley_is_followed_to_its_bottom():
    """Of a slanting bowl, to about the last step, half a grid's step halved again and again."""
    bottom, shape = np.array([0.61, 1.9]), np.array([[2.0, 0.6], [0.6, 1.0]])

    def value(place, moves):
        off = moved_by(place, moves, 1.3) - bottom
        return np.einsum("qna,ab,qnb->qn", off, shape, off)

    start = bottom + np.array([[0.08, -0.06], [-0.05, 0.09], [0.0, 0.0]])
    step = 0.2
    place, lowest = followed(value, start, step * np.eye(2), 1.3)
    last = step * 0.5**HALVINGS
    assert np.abs(place - bottom).max() < 4.0 * last
    np.testing.assert_allclose(lowest, value(place, np.zeros((1, 2)))[0], rtol=1e-12)
    assert (lowest <= value(start, np.zeros((1, 2)))[0]).all()
    edge, _ = followed(value, np.array([[1.29, 1.9]]), np.array([[1.0, 0.0]]), 1.3)
    assert 0.0 <= edge[0, 0] <= 1.3
