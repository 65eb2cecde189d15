"""The icosahedron and its facets' corners: unit, anticlockwise, the hemisphere once, alike in all fifths."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.reconstruct.table.icosahedron import (
    FIFTH,
    FINEST,
    RING,
    corner_planes,
    faces,
    fifth,
    split,
    unit,
    vertices,
)


def areas(triangles: np.ndarray) -> np.ndarray:
    """Solid angles (n,), by van Oosterom and Strackee's formula."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    triple = np.einsum("nx,nx->n", a, np.cross(b, c))
    dots = sum(np.einsum("nx,nx->n", p, q) for p, q in ((a, b), (b, c), (c, a)))
    return 2.0 * np.arctan2(triple, 1.0 + dots)


def test_the_faces_are_those_of_a_regular_icosahedron():
    edges = np.linalg.norm(faces() - np.roll(faces(), -1, axis=1), axis=2)
    np.testing.assert_allclose(edges, 1.0 / np.sin(0.4 * np.pi), rtol=1e-13)  # of circumradius 1
    np.testing.assert_allclose(np.linalg.norm(faces(), axis=2), 1.0, rtol=1e-15)
    np.testing.assert_allclose(areas(faces()), 4.0 * np.pi / 20.0, rtol=1e-12)
    assert faces()[0, 1, 2] == pytest.approx(RING)


@pytest.mark.parametrize("level", [1, 2, 4])
def test_facets_cover_the_hemisphere_once_and_are_seen_anticlockwise(level):
    corners = vertices(level)
    assert corners.shape == (10 * 4**level, 3, 3)
    np.testing.assert_allclose(np.linalg.norm(corners, axis=2), 1.0, rtol=1e-14)
    assert (areas(corners) > 0.0).all() and (corners[..., 2] >= 0.0).all()
    assert areas(corners).sum() == pytest.approx(2.0 * np.pi, rel=1e-12)


def test_children_cover_their_parent():
    parents = fifth(2)
    children = split(parents)
    np.testing.assert_allclose(areas(children).reshape(-1, 4).sum(1), areas(parents), rtol=1e-12)
    np.testing.assert_allclose(fifth(3), children, atol=1e-15)


def test_the_fifths_are_turns_of_one_another():
    corners = vertices(2).reshape(2, 5, -1, 3)
    for k in range(4):
        cos, sin = np.cos(FIFTH), np.sin(FIFTH)
        turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        np.testing.assert_allclose(corners[:, k] @ turn.T, corners[:, k + 1], atol=1e-14)


def test_corner_planes_part_the_corners_from_the_middle():
    triangles = vertices(1)
    planes, children = corner_planes(triangles), split(triangles).reshape(-1, 4, 3, 3)
    middles = unit(children.sum(2))
    side = np.einsum("ncx,nkx->nck", planes, middles)
    for corner in range(3):
        assert (side[:, corner, corner] > 0.0).all()
        assert (np.delete(side[:, corner], corner, axis=1) < 0.0).all()


@pytest.mark.parametrize("level", [0, FINEST + 1])
def test_levels_without_triangles_are_refused(level):
    with pytest.raises(ValueError, match=f"level is {level}"):
        vertices(level)
