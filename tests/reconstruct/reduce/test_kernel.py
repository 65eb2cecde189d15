"""The compiled stages of the reduction, one by one: geometry in closed form."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.reduce import kernel
from photogonio.reconstruct.reduce.directions import USED, canonical
from photogonio.reconstruct.table.facets import facet_index, vertices

N = 200


def unit(n: int, seed: int, least: float = 0.05) -> np.ndarray:
    """(n, 3) above the horizon."""
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(least, 1.0, n), rng.uniform(-np.pi, np.pi, n)
    return np.column_stack([np.sqrt(1.0 - z * z) * np.cos(phi), np.sqrt(1.0 - z * z) * np.sin(phi), z])


def test_a_ray_meets_a_sphere_where_it_should():
    """Rays to known points of a sphere's near side meet it at those points' distances."""
    centre, radius = np.array([3.0, -2.0, 20.0]), 5.0
    normal = unit(N, 0, 0.3) * [
        1.0,
        1.0,
        -1.0,
    ]  # toward the eye, which lies at the origin, and seen from there
    point = centre + radius * normal
    distance = np.linalg.norm(point, axis=1)
    ray = (point / distance[:, None]).T.copy()
    seen = np.einsum("in,ni->n", ray, normal) < -0.05
    depth, side, reason = np.empty(N), np.empty(N), np.empty(N, np.int64)
    power = centre @ centre - radius**2
    kernel._meet_sphere(ray, tuple(centre), power, 0.0, depth, side, reason, np.uint64(0), np.uint64(N))
    np.testing.assert_allclose(depth[seen], distance[seen], rtol=1e-12)
    assert (side[seen] > 0.0).all() and (reason[seen] == USED).all() and seen.sum() > N / 2
    away = np.tile([[0.0], [0.0], [-1.0]], N)
    kernel._meet_sphere(away, tuple(centre), power, 0.0, depth, side, reason, np.uint64(0), np.uint64(N))
    assert (side < 0.0).all()


def test_pairs_are_turned_as_the_plain_form_turns_them():
    normal, toward, back = unit(N, 1, -0.9), unit(N, 2, -0.9), unit(N, 3, -0.9)
    toward *= np.sign(np.sum(toward * normal, axis=1))[:, None]
    back *= np.sign(np.sum(back * normal, axis=1))[:, None]
    toward[0] = normal[0]  # at the pole the azimuth means nothing
    cos_i, cos_r = np.sum(toward * normal, axis=1), np.sum(back * normal, axis=1)
    incident, exit = toward.T.copy(), np.empty((3, N))
    kernel._turn((-back).T.copy(), normal.T.copy(), cos_i, cos_r, incident, exit, np.uint64(0), np.uint64(N))
    plain_i, plain_r = canonical(toward, back, normal)
    np.testing.assert_allclose(incident.T, plain_i, atol=1e-9)
    # where the light is near the normal, its azimuth is as sure as rounding over that angle
    np.testing.assert_allclose(exit.T, plain_r, atol=1e-9)


def test_a_direction_that_is_surely_inside_a_facet_is_found_there():
    """Whatever the test of the pixel before calls inside, the search from the top finds in that facet too."""
    level = 2
    corners = vertices(level)
    edges = np.cross(corners, np.roll(corners, -1, axis=1))
    edges = (edges / np.linalg.norm(edges, axis=2, keepdims=True)).reshape(-1, 9)
    directions = unit(N, 5)
    facet = facet_index(directions, level)
    inside = [kernel._inside(edges, facet[k], *directions[k]) for k in range(N)]
    assert np.mean(inside) == 1.0
    others = [kernel._inside(edges, (facet[k] + 1) % len(edges), *directions[k]) for k in range(N)]
    assert not np.any(others)
