"""Facets of the hemisphere: the icosahedron with a vertex at the pole, each face split in four, level by
level.

Level L has 10 * 4^L facets, numbered so that ``facet // 4`` is the facet of level L - 1 that holds it: two
tables of one level add, and coarsen by integer division. Facets 0 .. 4 of level 0 are the caps (pole, v_k,
v_k+1), v_k at azimuth 72 k degrees; 5 .. 9 are the belts below them: the upper part of face (v_k, v_k+1,
w_k) with the corner of face (v_k, w_k-1, w_k), which equals the part lost below the horizon in size and
shape. From level 1 on every facet is a spherical triangle above the horizon.

A facet (a, b, c) splits at its edges' midpoints, pushed onto the sphere: 0, 1, 2 at a, b, c and 3 in the
middle. Of a belt 0 is at v_k, 2 at v_k+1, 3 between, and 1 is the corner of the next face at v_k. Source:
Koenderink et al. (1996), section 6; docs/modes.md.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from photogonio.capture.jit import jit
from photogonio.reconstruct.modes.parallel import over_rows
from photogonio.reconstruct.table.icosahedron import (
    AZIMUTHS,
    FIFTH,
    FINEST,
    corner_planes,
    faces,
    fifth,
    unit,
    vertices,
)

__all__ = [
    "FINEST",
    "barycentres",
    "facet_count",
    "facet_index",
    "facet_of",
    "mean_directions",
    "solid_angles",
    "vertices",
]


def facet_count(level: int) -> int:
    """Number of facets on the hemisphere, 10 * 4^level."""
    if not 0 <= level <= FINEST:
        raise ValueError(f"level is {level}; it is 0 to {FINEST}")
    return 10 * 4**level


# A direction is turned by its fifth's azimuth, then reflected to v >= 0: the planes of the first step, by name
_BELOW, _SIDE = np.cross(faces()[0, 2], faces()[0, 1]), np.cross(faces()[0, 2], faces()[1, 1])
_POLE_CORNER, _, _CAP_CORNER = corner_planes(faces()[:1])[0]
_BELT_CORNER = corner_planes(faces()[1:2])[0, 2]
_TURN = np.column_stack([np.cos(AZIMUTHS), np.sin(AZIMUTHS)])
_EDGE = np.array([[np.cos(k * FIFTH), np.sin(k * FIFTH)] for k in (1, 2)])
# Planes between sisters, one row of nine a node, levels 1 to FINEST - 1 after one another. Above a million bytes
# the compiler would no longer keep its work between runs.
_PLANES = np.concatenate([corner_planes(fifth(k)).reshape(-1, 9) for k in range(1, FINEST)])
_FIRST = np.cumsum([0, 0, *[len(fifth(k)) for k in range(1, FINEST - 1)]])
_CHILD = np.array([3, 0, 1, 0, 2, 0, 1, 0])  # by bits: beyond the plane at corner 0, 1, 2


def _first_children() -> np.ndarray:
    """Node at level 1 by bits: in the belt; at the pole, or beside the belt's face; at a corner; v > 0."""
    nodes = np.empty(16, int)
    for bits in range(16):
        belt, top, corner, positive = (bits >> k & 1 for k in range(4))
        first = (1 if belt else 0) if top else (2 if positive else 1 - belt) if corner else 3
        nodes[bits] = 4 * belt + first
    return nodes


_ROOT = _first_children()


@jit
def facet_of(x: float, y: float, z: float, level: int) -> int:
    """Facet of one direction (any length); -1 below the horizon, for zero and for what is not finite.

    For compiled loops. The direction is turned into one fifth of the icosahedron and tested there, level by
    level, against the planes between sisters. Choices are made by arithmetic, since a processor would
    mispredict branches.
    """
    squared = x * x + y * y + z * z
    if not (z >= 0.0 and squared > 0.0 and squared < np.inf):
        return -1
    past = int(_EDGE[0, 0] * abs(y) >= _EDGE[0, 1] * x) + int(_EDGE[1, 0] * abs(y) >= _EDGE[1, 1] * x)
    part = past if y >= 0.0 else 4 - past
    u, v = _TURN[part, 0] * x + _TURN[part, 1] * y, _TURN[part, 0] * y - _TURN[part, 1] * x
    across, positive = abs(v), int(v > 0.0)
    belt = int(_BELOW[0] * u + _BELOW[2] * z > 0.0)
    beside = int(_SIDE[0] * u + _SIDE[1] * across + _SIDE[2] * z > 0.0)
    pole = int(_POLE_CORNER[0] * u + _POLE_CORNER[2] * z > 0.0)
    at_cap = int(_CAP_CORNER[0] * u + _CAP_CORNER[1] * across + _CAP_CORNER[2] * z > 0.0)
    at_belt = int(_BELT_CORNER[0] * u + _BELT_CORNER[1] * across + _BELT_CORNER[2] * z > 0.0)
    top, corner = (beside, at_belt) if belt else (pole, at_cap)
    node = _ROOT[belt + 2 * top + 4 * corner + 8 * positive]
    part += belt & beside & positive  # the corner at v_1 is the next fifth's
    part = 0 if part == 5 else part
    if level == 0:
        return part + 5 * belt
    u, v = _TURN[part, 0] * x + _TURN[part, 1] * y, _TURN[part, 0] * y - _TURN[part, 1] * x
    for depth in range(1, level):
        row = _FIRST[depth] + node
        a = _PLANES[row, 0] * u + _PLANES[row, 1] * v + _PLANES[row, 2] * z
        b = _PLANES[row, 3] * u + _PLANES[row, 4] * v + _PLANES[row, 5] * z
        c = _PLANES[row, 6] * u + _PLANES[row, 7] * v + _PLANES[row, 8] * z
        node = 4 * node + _CHILD[int(a > 0.0) + 2 * int(b > 0.0) + 4 * int(c > 0.0)]
    return ((part + 4 * belt) << (2 * level)) + node


@jit
def _fill(directions, level, index):
    for k in range(len(directions)):
        index[k] = facet_of(directions[k, 0], directions[k, 1], directions[k, 2], level)


def facet_index(directions: np.ndarray, level: int, *, threads: int | None = None) -> np.ndarray:
    """int32 (n,) facet of each direction (n, 3), which need not be of unit length.

    -1 for NaN, infinite or zero vectors and below the horizon (z < 0); z = 0 is on the hemisphere. Exact to
    within rounding of an edge. Inverse (one way) of :func:`barycentres`.
    """
    facet_count(level)
    directions = np.asarray(directions)
    if directions.ndim != 2 or directions.shape[1] != 3:
        raise ValueError(f"directions have shape {directions.shape}; (n, 3) is needed")
    index = np.empty(len(directions), np.int32)

    def task(start: int, stop: int) -> None:
        _fill(np.array(directions[start:stop], dtype=float, order="C"), level, index[start:stop])

    over_rows(task, len(index), threads)
    return index


@lru_cache(maxsize=16)
def solid_angles(level: int) -> np.ndarray:
    """(f,) true solid angles, sr; they sum to 2 pi. Van Oosterom & Strackee (1983)."""
    if facet_count(level) == 10:
        return np.full(10, np.pi / 5)
    a, b, c = np.moveaxis(vertices(level), 1, 0)
    triple = np.einsum("fx,fx->f", a, np.cross(b, c))
    dots = [np.einsum("fx,fx->f", *pair) for pair in ((a, b), (b, c), (c, a))]
    areas = 2 * np.arctan2(triple, 1 + sum(dots))
    areas.setflags(write=False)
    return areas


@lru_cache(maxsize=16)
def mean_directions(level: int) -> np.ndarray:
    """(f, 3) mean of the unit vector over each facet (shorter than 1), in closed form.

    Over a spherical polygon the integral of the unit vector is half the sum over edges of arc times inward
    normal.
    """
    if facet_count(level) == 10:
        finer = mean_directions(1) * solid_angles(1)[:, None]
        return finer.reshape(10, 4, 3).sum(1) / solid_angles(0)[:, None]
    corners = vertices(level)
    normal = np.cross(corners, np.roll(corners, -1, 1))
    sine = np.linalg.norm(normal, axis=2)
    arc = np.arctan2(sine, np.einsum("fcx,fcx->fc", corners, np.roll(corners, -1, 1)))
    means = np.einsum("fc,fcx->fx", arc / sine, normal) / (2 * solid_angles(level)[:, None])
    means.setflags(write=False)
    return means


def barycentres(level: int) -> np.ndarray:
    """(f, 3) unit vectors of the facets' barycentres. ``facet_index`` takes them to 0, 1, 2 ..."""
    return unit(mean_directions(level))
