"""Facets: the icosahedron of the oracle, found exactly from any direction."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table import facets as f
from tests import oracles

LEVELS = range(8)


def random_directions(count: int, seed: int = 0) -> np.ndarray:
    vectors = np.random.default_rng(seed).normal(size=(count, 3))
    vectors[:, 2] = np.abs(vectors[:, 2])
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def margins(directions: np.ndarray, facet: np.ndarray, level: int) -> np.ndarray:
    """(n,) sine of the distance inside the nearest edge of the facet named."""
    corners = f.vertices(level)
    normals = np.cross(corners, np.roll(corners, -1, axis=1))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    return np.einsum("nx,nkx->nk", directions, normals[facet]).min(axis=1)


@pytest.mark.parametrize("level", LEVELS)
def test_counts_areas_and_numbering(level):
    count = 10 * 4**level
    assert f.facet_count(level) == count
    assert f.solid_angles(level).sum() == pytest.approx(2 * np.pi, rel=1e-13)
    assert np.array_equal(f.facet_index(f.barycentres(level), level), np.arange(count))
    if level:
        assert np.array_equal(f.facet_index(f.barycentres(level), level - 1), np.arange(count) // 4)
        children = f.solid_angles(level).reshape(-1, 4).sum(1)
        assert children == pytest.approx(f.solid_angles(level - 1), rel=1e-11)


@pytest.mark.parametrize(
    ("level", "ratio", "diameter"), [(1, 1.20, 25.6), (2, 1.27, 12.8), (3, 1.29, 6.4), (4, 1.30, 3.2)]
)
def test_areas_are_only_nearly_equal(level, ratio, diameter):
    areas = f.solid_angles(level)
    assert areas.max() / areas.min() == pytest.approx(ratio, abs=0.005)
    assert np.degrees(np.sqrt(4 / np.pi * areas.mean())) == pytest.approx(diameter, abs=0.05)


@pytest.mark.parametrize("level", [1, 2, 3])
def test_facets_are_those_of_the_icosahedron(level):
    """Each triangle of the oracle above the horizon is one facet, corner for corner."""
    upper = [t for t in oracles.facet_triangles(level) if t.mean(axis=0)[2] > 0]
    assert len(upper) == f.facet_count(level)
    found = f.facet_index(np.array([t.mean(axis=0) for t in upper]), level)
    assert len(np.unique(found)) == len(upper)
    for triangle, corners in zip(upper, f.vertices(level)[found], strict=True):
        gaps = np.linalg.norm(triangle[:, None] - corners[None], axis=2)
        assert gaps.min(axis=1).max() < 1e-14
    assert (f.vertices(level)[..., 2] >= 0).all()  # none straddles the horizon


def test_level_0_is_caps_and_belts():
    assert f.solid_angles(0) == pytest.approx(np.full(10, 2 * np.pi / 10))
    finer = f.barycentres(1)
    assert np.array_equal(f.facet_index(finer, 0), np.arange(40) // 4)
    with pytest.raises(ValueError, match="level is 0"):
        f.vertices(0)


@pytest.mark.parametrize("level", [1, 2, 3])
def test_every_direction_against_brute_force(level):
    upper = np.array([t for t in oracles.facet_triangles(level) if t.mean(axis=0)[2] > 0])
    name = f.facet_index(upper.mean(axis=1), level)
    directions = random_directions(400, seed=level)
    for direction, found in zip(directions, f.facet_index(directions, level), strict=True):
        inside = oracles.facet_margins(upper, direction)
        assert name[inside.argmax()] == found or inside.max() < 1e-14


@pytest.mark.parametrize("level", range(1, 8))
def test_directions_lie_in_their_facets(level):
    directions = random_directions(200_000, seed=10 + level)
    found = f.facet_index(directions, level)
    assert margins(directions, found, level).min() > -4 * np.finfo(float).eps
    assert np.array_equal(f.facet_index(directions, level - 1), found // 4)


@pytest.mark.parametrize("level", [1, 4, 7])
def test_edges_corners_and_meridians(level):
    """Exactly on an edge either facet is right; nothing falls between."""
    corners = f.vertices(level)[:2000]
    middles = corners + np.roll(corners, -1, axis=1)
    meridian = unit_vectors(np.linspace(0, np.pi / 2, 500), 0.0)
    horizon = unit_vectors(np.pi / 2, np.linspace(-7, 7, 500))
    flat = horizon * [1, 1, 0]
    for directions in (corners.reshape(-1, 3), middles.reshape(-1, 3), meridian, horizon, flat):
        found = f.facet_index(directions, level)
        assert (found >= 0).all()
        # an edge's plane is known as well as rounding turns the chord between its ends
        assert margins(directions, found, level).min() > -8 * np.finfo(float).eps * 2**level


def test_a_shift_of_azimuth_by_a_fifth_is_a_shift_of_the_number():
    theta, phi = np.random.default_rng(3).uniform(0, [[1.57], [6.28]], (2, 5000))
    for level in (0, 2, 5):
        size = 4**level
        here = f.facet_index(unit_vectors(theta, phi), level)
        there = f.facet_index(unit_vectors(theta, phi + 2 * np.pi / 5), level)
        ring, fifth, rest = here // (5 * size), here // size % 5, here % size
        assert (
            np.mean(there == (5 * ring + (fifth + 1) % 5) * size + rest) > 0.999
        )  # but for rounding at edges


def test_hard_directions():
    nan, inf = np.nan, np.inf
    bad = [
        (nan, 0, 1),
        (0, nan, 1),
        (0, 0, nan),
        (0, 0, -1),
        (1, 0, -1e-300),
        (0, 0, 0),
        (inf, 0, 1),
        (0, 0, inf),
    ]
    good = [(0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (1, 0, -0.0), (1e-200, 0, 1e-150 * 1e-3)]
    for level in LEVELS:
        assert (f.facet_index(np.array(bad, float), level) == -1).all()
        assert (f.facet_index(np.array(good[:-1], float), level) >= 0).all()
    assert f.facet_index(np.array([(1e-9, 0, 1e-5)]), 3)[0] == f.facet_index(np.array([(1e-4, 0, 1)]), 3)[0]


def test_shapes_and_types():
    assert f.facet_index(np.empty((0, 3)), 4).shape == (0,)
    directions = random_directions(5000)
    single = f.facet_index(directions.astype(np.float32), 4)
    assert single.dtype == np.int32
    assert np.array_equal(single, f.facet_index(directions.astype(np.float32).astype(float), 4))
    assert np.array_equal(f.facet_index(directions[::-1], 4)[::-1], f.facet_index(directions, 4))
    assert np.array_equal(f.facet_index(np.asfortranarray(directions), 4), f.facet_index(directions, 4))
    for wrong in (np.zeros(3), np.zeros((4, 2))):
        with pytest.raises(ValueError, match=r"\(n, 3\)"):
            f.facet_index(wrong, 2)
    for level in (-1, 8):
        with pytest.raises(ValueError, match=f"level is {level}"):
            f.facet_index(directions, level)


def test_same_for_any_number_of_threads():
    directions = random_directions(200_000, seed=4)
    alone = f.facet_index(directions, 5, threads=1)
    assert np.array_equal(f.facet_index(directions, 5, threads=3), alone)


def test_compiled_scalar_is_the_same():
    directions = random_directions(300, seed=6)
    assert [f.facet_of(*d, 3) for d in directions.tolist()] == f.facet_index(directions, 3).tolist()
    assert f.facet_of(0.0, 0.0, -1.0, 3) == -1


@pytest.mark.parametrize("level", [0, 1, 3])
def test_barycentres_are_means(level):
    directions = random_directions(400_000, seed=8)
    facet = f.facet_index(directions, level)
    count = np.bincount(facet, minlength=f.facet_count(level))
    for axis in range(3):
        mean = np.bincount(facet, weights=directions[:, axis], minlength=len(count)) / count
        spread = np.sqrt(2 * np.pi / len(count)) / np.sqrt(count)  # sides over root n: five sigma below
        assert (np.abs(mean - f.mean_directions(level)[:, axis]) < 5 * 0.4 * spread).all()
    assert np.linalg.norm(f.barycentres(level), axis=1) == pytest.approx(1, rel=1e-14)
