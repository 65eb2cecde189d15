"""The icosahedron with a vertex at the pole, its faces split in four again and again: corners of the facets.

The fifth of it between azimuths -36 and 36 degrees is built; the rest are turns of it. See reconstruct.table.facets for
the numbering.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

FINEST = 7
RING = np.sqrt(0.2)  # height of the upper ring of vertices; the lower ring is at its negative
FIFTH = 2 * np.pi / 5
AZIMUTHS = FIFTH * (np.arange(5) + 0.5)  # of the middles of the fifths


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) at unit length."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def split(triangles: np.ndarray) -> np.ndarray:
    """(n, 3, 3) corners to (4 n, 3, 3) of the children, each triangle's four in order."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    ab, bc, ca = unit(a + b), unit(b + c), unit(c + a)
    children = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.stack([np.stack(child, 1) for child in children], 1).reshape(-1, 3, 3)


def corner_planes(triangles: np.ndarray) -> np.ndarray:
    """(n, 3, 3) normals of planes that cut off the three corner children; positive on their side."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    ab, bc, ca = unit(a + b), unit(b + c), unit(c + a)
    return np.stack([np.cross(ab, ca), np.cross(bc, ab), np.cross(ca, bc)], 1)


def faces() -> np.ndarray:
    """(3, 3, 3) corners of the cap, of the face below it, and of the next one, whose corner at v_0 joins the belt."""
    pole, v0, v1 = np.array([0.0, 0.0, 1.0]), _ring(-FIFTH / 2, RING), _ring(FIFTH / 2, RING)
    w_before, w0 = _ring(-FIFTH, -RING), _ring(0.0, -RING)
    return np.stack([[pole, v0, v1], [v0, w0, v1], [v0, w_before, w0]])


def _ring(azimuth: float, height: float) -> np.ndarray:
    radius = np.sqrt(1 - height**2)
    return np.array([radius * np.cos(azimuth), radius * np.sin(azimuth), height])


@lru_cache(maxsize=16)
def fifth(level: int) -> np.ndarray:
    """(2 * 4^level, 3, 3) corners of one cap's and one belt's facets at ``level`` >= 1, about azimuth 0."""
    if level > 1:
        return split(fifth(level - 1))
    cap, down, up = split(faces()).reshape(3, 4, 3, 3)
    corners = np.concatenate([cap, down[:1], up[:1], down[2:]])
    corners[np.abs(corners) < 1e-15] = 0.0  # midpoints on the horizon and in the plane of symmetry
    return corners


@lru_cache(maxsize=16)
def vertices(level: int) -> np.ndarray:
    """(f, 3, 3) unit corners of every facet, anticlockwise seen from outside; level 1 to 7."""
    if not 1 <= level <= FINEST:
        raise ValueError(f"level is {level}; facets are triangles at levels 1 to {FINEST}")
    cos, sin = np.cos(AZIMUTHS), np.sin(AZIMUTHS)
    turn = np.zeros((5, 3, 3))
    turn[:, 0, 0], turn[:, 1, 1], turn[:, 2, 2] = cos, cos, 1.0
    turn[:, 0, 1], turn[:, 1, 0] = -sin, sin
    part = fifth(level).reshape(2, 4**level, 3, 3)
    corners = np.einsum("kxy,tfcy->tkfcx", turn, part).reshape(-1, 3, 3)
    corners.setflags(write=False)
    return corners
