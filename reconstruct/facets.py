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

import numba
import numpy as np

from reconstruct.rows import over_rows

FINEST = 7
_RING = np.sqrt(0.2)  # height of the upper ring of vertices
_FIFTH = 2 * np.pi / 5
_COS, _SIN = np.cos(_FIFTH * np.arange(5)), np.sin(_FIFTH * np.arange(5))


def facet_count(level: int) -> int:
    """Number of facets on the hemisphere, 10 * 4^level."""
    if not 0 <= level <= FINEST:
        raise ValueError(f"level is {level}; it is 0 to {FINEST}")
    return 10 * 4**level


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _split(triangles: np.ndarray) -> np.ndarray:
    """(n, 3, 3) corners to (4 n, 3, 3) of the children, each triangle's four in order."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    ab, bc, ca = _unit(a + b), _unit(b + c), _unit(c + a)
    children = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.stack([np.stack(child, 1) for child in children], 1).reshape(-1, 3, 3)


def _ring(azimuth: float, height: float) -> np.ndarray:
    radius = np.sqrt(1 - height**2)
    return np.array([radius * np.cos(azimuth), radius * np.sin(azimuth), height])


@lru_cache(maxsize=16)
def _sector(level: int) -> np.ndarray:
    """(2 * 4^level, 3, 3) corners of cap 0 and belt 0 at ``level`` >= 1."""
    if level > 1:
        return _split(_sector(level - 1))
    pole, v0, v1 = np.array([0.0, 0.0, 1.0]), _ring(0, _RING), _ring(_FIFTH, _RING)
    w_before, w0 = _ring(-_FIFTH / 2, -_RING), _ring(_FIFTH / 2, -_RING)
    cap, down, up = _split(np.stack([[pole, v0, v1], [v0, w0, v1], [v0, w_before, w0]]))[
        np.arange(12).reshape(3, 4)
    ]
    belt = np.stack([down[0], up[0], down[2], down[3]])
    corners = np.concatenate([cap, belt])
    corners[np.abs(corners) < 1e-15] = 0.0  # midpoints on the horizon, and v0 on the x axis
    return corners


@lru_cache(maxsize=16)
def vertices(level: int) -> np.ndarray:
    """(f, 3, 3) unit corners of every facet, anticlockwise seen from outside; level 1 to 7."""
    if facet_count(level) == 10:
        raise ValueError("facets of level 0 are not triangles; 1 to 7 are")
    sector = _sector(level).reshape(2, 4**level, 3, 3)
    turn = np.zeros((5, 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = _COS
    turn[:, 0, 1], turn[:, 1, 0], turn[:, 2, 2] = -_SIN, _SIN, 1.0
    corners = np.einsum("kxy,tfcy->tkfcx", turn, sector).reshape(-1, 3, 3)
    corners.setflags(write=False)
    return corners


def _corner_planes(triangles: np.ndarray) -> np.ndarray:
    """(n, 3, 3) normals of planes that cut off the three corner children; positive on their side."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    ab, bc, ca = _unit(a + b), _unit(b + c), _unit(c + a)
    return np.stack([np.cross(ab, ca), np.cross(bc, ab), np.cross(ca, bc)], 1)


def _descent() -> tuple[np.ndarray, np.ndarray]:
    """Planes of the sector's nodes, levels 1 to FINEST - 1 one after another, and each level's first row."""
    planes = [_corner_planes(_sector(level)) for level in range(1, FINEST)]
    first = np.cumsum([0, 0, *map(len, planes)])
    return np.concatenate(planes), first


def _root_planes() -> np.ndarray:
    """(8, 3) below the cap; left, right of the belt's face; the cap's corners; that face's corners."""
    pole, v0, v1 = np.array([0.0, 0.0, 1.0]), _ring(0, _RING), _ring(_FIFTH, _RING)
    w0 = _ring(_FIFTH / 2, -_RING)
    sides = np.stack([np.cross(v1, v0), np.cross(w0, v0), np.cross(v1, w0)])
    cap, down = _corner_planes(np.stack([[pole, v0, v1], [v0, w0, v1]]))
    return np.concatenate([sides, cap, down[[0, 2]]])


_PLANES, _FIRST = _descent()
_ROOTS = _root_planes()


_jit = numba.njit(cache=True, nogil=True, error_model="numpy")


@numba.njit(cache=True, nogil=True, inline="always")
def _plane(row, x, y, z):
    return _ROOTS[row, 0] * x + _ROOTS[row, 1] * y + _ROOTS[row, 2] * z


@_jit
def facet_of(x, y, z, level):
    """Facet of one direction (any length), -1 if it is below the horizon, zero or not finite. For compiled
    loops.

    The direction is turned into the sector of cap 0 and tested there, level by level, against the planes
    between sisters. Choices are selections rather than branches, which random directions would mispredict.
    """
    squared = x * x + y * y + z * z
    if not (z >= 0.0 and squared > 0.0 and squared < np.inf):
        return -1
    past1, past2 = _COS[1] * y >= _SIN[1] * x, _COS[2] * y >= _SIN[2] * x
    past3, past4 = _COS[3] * y >= _SIN[3] * x, _COS[4] * y >= _SIN[4] * x
    fifth = (2 if past2 else 1 if past1 else 0) if y >= 0.0 else (4 if past4 else 3 if past3 else 2)
    u, v = _COS[fifth] * x + _SIN[fifth] * y, _COS[fifth] * y - _SIN[fifth] * x
    belt, left, right = _plane(0, u, v, z) > 0.0, _plane(1, u, v, z) > 0.0, _plane(2, u, v, z) > 0.0
    if belt and right:  # the corner at v_1 of the next face: turn once more, into the next sector
        fifth, left = (fifth + 1 if fifth < 4 else 0), True
        u, v = _COS[1] * u + _SIN[1] * v, _COS[1] * v - _SIN[1] * u
    if level == 0:
        return fifth + 5 if belt else fifth
    if belt:
        child = 1 if left else 0 if _plane(6, u, v, z) > 0.0 else 2 if _plane(7, u, v, z) > 0.0 else 3
    else:
        a, b, c = _plane(3, u, v, z), _plane(4, u, v, z), _plane(5, u, v, z)
        child = 0 if a > 0.0 else 1 if b > 0.0 else 2 if c > 0.0 else 3
    node = child + 4 if belt else child
    for depth in range(1, level):
        p = _PLANES[_FIRST[depth] + node]
        a = p[0, 0] * u + p[0, 1] * v + p[0, 2] * z
        b = p[1, 0] * u + p[1, 1] * v + p[1, 2] * z
        c = p[2, 0] * u + p[2, 1] * v + p[2, 2] * z
        node = 4 * node + (0 if a > 0.0 else 1 if b > 0.0 else 2 if c > 0.0 else 3)
    size = 4**level
    return (fifth + 4) * size + node if belt else fifth * size + node


@_jit
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
    return _unit(mean_directions(level))


@lru_cache(maxsize=16)
def neighbours(level: int) -> np.ndarray:
    """int32 (f, 3) facets across the three edges, -1 across the horizon; edge k runs from corner k to k + 1.

    At level 0 the three are in no set order.
    """
    if facet_count(level) == 10:
        k = np.arange(5)
        caps = np.column_stack([(k + 1) % 5, (k - 1) % 5, k + 5])
        belts = np.column_stack([(k + 1) % 5 + 5, (k - 1) % 5 + 5, k])
        return np.concatenate([caps, belts]).astype(np.int32)
    corners = vertices(level)
    middles = _unit(corners + np.roll(corners, -1, 1)).reshape(-1, 3)
    keys = np.round(middles * 2**24).astype(
        np.int64
    )  # midpoints of distinct edges differ by far more than 2^-24
    order = np.lexsort(keys.T)
    same = np.flatnonzero((keys[order[1:]] == keys[order[:-1]]).all(1))
    across = np.full(len(middles), -1, np.int32)
    across[order[same]], across[order[same + 1]] = order[same + 1] // 3, order[same] // 3
    across = across.reshape(-1, 3)
    across.setflags(write=False)
    return across
