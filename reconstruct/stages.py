"""The compiled stages of :mod:`reconstruct.kernel`, each for one row of pixels, which stays in the first cache.

All of them are in one file, since a compiled function kept on disk is not renewed when a function of another
file that it calls changes. A stage takes whole tuples of arrays, so it is called for a row, never for a pixel.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from reconstruct.directions import CANONICAL_AZIMUTH, OUTSIDE, USED
from reconstruct.facets import facet_of
from reconstruct.lens import ORDER
from reconstruct.table import LEFT_OUT

INSIDE = 1e-12  # sine of the distance from a facet's edges at which a direction is surely inside
SCATTER = 0x2545F4914F6CDD1D  # odd, of well mixed bits: Vigna's
_OUTLINE, _COVERED, _UNLIT, _GRAZING, _SHADOWED, _SATURATED, _INVALID = range(len(LEFT_OUT))
_COS, _SIN = float(np.cos(CANONICAL_AZIMUTH)), float(np.sin(CANONICAL_AZIMUTH))

_jit = numba.njit(cache=True, nogil=True, error_model="numpy")


class Cells(NamedTuple):
    """A table that grows: an open hash of indices in ``keys``, and the sums of each."""

    slots: np.ndarray  # (4 n,) int32, -1: free
    keys: np.ndarray  # (n,) int64
    sums: np.ndarray  # (n, 11 + 3 c)


@_jit
def reduce_rows(rig, nodes, weights, frame, region, level, edges, row, cells, used, left_out):
    """The cells of the rows of a region, and how many are in use: stage by stage, one row of pixels at a time."""
    x0, y0, _, y1 = region
    for y in range(y0, y1):
        _aim(rig.rotation, nodes, weights, y, x0, row.ray)
        start, stop = _meet(rig, row)
        _cover(rig, row, start, stop)
        _pair(rig, row, start, stop)
        v = y - frame.top
        _screen(frame.valid[v], frame.saturated[v], x0 - frame.left, row.reason, start, stop)
        _find(row, start, stop, edges, level)
        cells, used = _gather(rig, frame, row, y, x0, start, stop, cells, used)
        for x in range(start, stop):
            if row.reason[x] >= 0:
                left_out[row.reason[x]] += 1
    return cells, used


@_jit
def _aim(rotation, nodes, weights, y, x0, ray):
    """Unit world rays (3, w) of the pixels of a row, from the lens's nodes."""
    step, r = len(weights), rotation
    j, v = y // step, y % step
    first = x0 // step
    lines = np.zeros((2, (x0 + ray.shape[1]) // step + ORDER - first))
    for k in range(ORDER):
        for i in range(lines.shape[1]):
            if first + i < nodes.shape[1]:
                lines[0, i] += weights[v, k] * nodes[j + k, first + i, 0]
                lines[1, i] += weights[v, k] * nodes[j + k, first + i, 1]
    i, u = 0, x0 % step
    for x in range(ray.shape[1]):
        a, b = 0.0, 0.0
        for k in range(ORDER):
            a += weights[u, k] * lines[0, i + k]
            b += weights[u, k] * lines[1, i + k]
        dx, dy, dz = r[0] * a + r[3] * b + r[6], r[1] * a + r[4] * b + r[7], r[2] * a + r[5] * b + r[8]
        scale = 1.0 / np.sqrt(dx * dx + dy * dy + dz * dz)
        ray[0, x], ray[1, x], ray[2, x] = dx * scale, dy * scale, dz * scale
        u += 1
        if u == step:
            i, u = i + 1, 0


@_jit
def _meet(rig, row):
    """Depths at which the rays meet the sample, and the range of columns where they do."""
    ray, depth, reason = row.ray, row.depth, row.reason
    start, stop = len(depth), 0
    axis, height = rig.axis, rig.height - rig.eye[2]
    for x in range(len(depth)):
        reason[x] = OUTSIDE
        if rig.spherical:
            b = ray[0, x] * axis[0] + ray[1, x] * axis[1] + ray[2, x] * axis[2]
            rest = b * b - rig.power
            if rest <= 0.0 or b <= 0.0:
                continue
            far, inner = b - np.sqrt(rest), b > rig.edge
        else:
            side = _side(rig.outline, 0, len(rig.outline), ray[0, x], ray[1, x], ray[2, x])
            far, inner = height / ray[2, x], side > rig.margin_sine
            if side <= 0.0 or not far > 0.0:
                continue
        depth[x] = far
        reason[x] = USED if inner else _OUTLINE
        start, stop = min(start, x), x + 1
    return start, stop


@_jit
def _side(normals, first, last, x, y, z):
    """Least of the products of a ray with some of the normals: positive inside their cone."""
    side = np.inf
    for k in range(first, last):
        side = min(side, normals[k, 0] * x + normals[k, 1] * y + normals[k, 2] * z)
    return side


@_jit
def _cover(rig, row, start, stop):
    """Leaves out what mirror balls and white patches cover."""
    ray, depth, reason = row.ray, row.depth, row.reason
    for k in range(len(rig.balls)):
        bx, by, bz, edge = rig.balls[k, 0], rig.balls[k, 1], rig.balls[k, 2], rig.balls[k, 5]
        front = rig.balls[k, 4] - rig.balls[k, 3]
        for x in range(start, stop):
            along = ray[0, x] * bx + ray[1, x] * by + ray[2, x] * bz
            if along > edge and front < depth[x] and reason[x] == USED:
                reason[x] = _COVERED
    first = 0
    for k in range(len(rig.patch_heights)):
        last, height = rig.patch_ends[k], rig.patch_heights[k] - rig.eye[2]
        for x in range(start, stop):
            if reason[x] == USED and height / ray[2, x] <= depth[x] * (1.0 + 1e-9):
                side = _side(rig.patch_normals, first, last, ray[0, x], ray[1, x], ray[2, x])
                if side > -rig.margin_sine:
                    reason[x] = _COVERED
        first = last


@_jit
def _pair(rig, row, start, stop):
    """Directions of the pixels that the lamp shines on and that are not grazing."""
    ray, reason, axis = row.ray, row.reason, rig.axis
    per = 1.0 / rig.radius if rig.spherical else 0.0
    nx, ny, nz = 0.0, 0.0, 1.0
    px, py, pz = rig.place
    falloff, lamp = 1.0, rig.lamp_sine
    for x in range(start, stop):
        if reason[x] != USED:
            continue
        dx, dy, dz, far = ray[0, x], ray[1, x], ray[2, x], row.depth[x]
        if rig.spherical:
            nx, ny, nz = (far * dx - axis[0]) * per, (far * dy - axis[1]) * per, (far * dz - axis[2]) * per
        qx, qy, qz = rig.eye[0] + far * dx, rig.eye[1] + far * dy, rig.eye[2] + far * dz
        tx, ty, tz = px, py, pz
        if rig.near:
            tx, ty, tz = px - qx, py - qy, pz - qz
            falloff = 1.0 / (tx * tx + ty * ty + tz * tz)
            near = np.sqrt(falloff)
            tx, ty, tz, lamp = tx * near, ty * near, tz * near, max(rig.lamp_radius * near, rig.lamp_sine)
        cos_i, cos_r = nx * tx + ny * ty + nz * tz, -(nx * dx + ny * dy + nz * dz)
        if cos_i <= lamp:
            reason[x] = _UNLIT
            continue
        if cos_i < rig.cos_i_min or cos_r < rig.cos_r_min:
            reason[x] = _GRAZING
            continue
        row.point[0, x], row.point[1, x], row.point[2, x] = qx, qy, qz
        row.incident[0, x], row.incident[1, x], row.incident[2, x] = tx, ty, tz
        row.geometry[x] = cos_i * falloff
        if len(rig.balls) and _shadowed(rig.balls, rig.eye, rig.near, qx, qy, qz, tx, ty, tz, falloff, lamp):
            reason[x] = _SHADOWED
        elif rig.isotropic:
            _turn(row, x, nx, ny, nz, cos_i, cos_r)
        else:
            row.exit[0, x], row.exit[1, x], row.exit[2, x] = -dx, -dy, -dz


@_jit
def _shadowed(balls, eye, near, qx, qy, qz, tx, ty, tz, falloff, lamp):
    for k in range(len(balls)):
        x, y, z = balls[k, 0] + eye[0] - qx, balls[k, 1] + eye[1] - qy, balls[k, 2] + eye[2] - qz
        along = x * tx + y * ty + z * tz
        if along > 0.0:
            reach = balls[k, 3] + lamp * along
            before = not near or along - balls[k, 3] < 1.0 / np.sqrt(falloff)
            if before and x * x + y * y + z * z - along * along < reach * reach:
                return True
    return False


@_jit
def _turn(row, x, nx, ny, nz, cos_i, cos_r):
    """Incident and exit of pixel x in the tangent frame, as :func:`reconstruct.directions.canonical` has them."""
    tx, ty, tz = row.incident[0, x], row.incident[1, x], row.incident[2, x]
    dx, dy, dz = row.ray[0, x], row.ray[1, x], row.ray[2, x]
    sin_i = np.sqrt(max(1.0 - cos_i * cos_i, 0.0))
    if sin_i > 1e-9:
        per = 1.0 / sin_i
        along = -(tx * dx + ty * dy + tz * dz + cos_i * cos_r) * per
        triple = nx * (ty * dz - tz * dy) + ny * (tz * dx - tx * dz) + nz * (tx * dy - ty * dx)
        across = abs(triple) * per
    else:
        along, across = np.sqrt(max(1.0 - cos_r * cos_r, 0.0)), 0.0
    row.incident[0, x], row.incident[1, x], row.incident[2, x] = _COS * sin_i, _SIN * sin_i, cos_i
    row.exit[0, x] = _COS * along - _SIN * across
    row.exit[1, x], row.exit[2, x] = _SIN * along + _COS * across, cos_r


@_jit
def _screen(valid, saturated, shift, reason, start, stop):
    """Leaves out pixels that the photo says nothing of; ``shift`` is from the region's columns to the photo's."""
    for x in range(start, stop):
        if reason[x] == USED:
            if saturated[x + shift]:
                reason[x] = _SATURATED
            elif not valid[x + shift]:
                reason[x] = _INVALID


@_jit
def _find(row, start, stop, edges, level):
    """Keys of the pixels' facet pairs."""
    incident, exit_, reason, key = row.incident, row.exit, row.reason, row.key
    facets = len(edges)
    facet_i = facet_r = np.int64(-1)
    for x in range(start, stop):
        key[x] = -1
        if reason[x] != USED:
            continue
        ix, iy, iz = incident[0, x], incident[1, x], incident[2, x]
        rx, ry, rz = exit_[0, x], exit_[1, x], exit_[2, x]
        if facet_i < 0 or not _inside(edges, facet_i, ix, iy, iz):
            facet_i = facet_of(ix, iy, iz, level)
        if facet_r < 0 or not _inside(edges, facet_r, rx, ry, rz):
            facet_r = facet_of(rx, ry, rz, level)
        key[x] = facet_i * facets + facet_r


@_jit
def _inside(edges, facet, x, y, z):
    """Whether a direction is surely in a facet: mostly it is in that of the pixel before."""
    return (
        edges[facet, 0] * x + edges[facet, 1] * y + edges[facet, 2] * z > INSIDE
        and edges[facet, 3] * x + edges[facet, 4] * y + edges[facet, 5] * z > INSIDE
        and edges[facet, 6] * x + edges[facet, 7] * y + edges[facet, 8] * z > INSIDE
    )


@_jit
def _gather(rig, frame, row, y, x0, start, stop, cells, used):
    """Adds the pixels of a row to the cells of their facet pairs. Returns the cells and how many are in use."""
    v, shift, stop_run = y - frame.top, x0 - frame.left, start
    while stop_run < stop:
        first, key = stop_run, row.key[stop_run]
        while stop_run < stop and row.key[stop_run] == key:
            stop_run += 1
        if key < 0:
            continue
        if used == len(cells.keys):
            cells = _grown(cells)
        at = _slot(cells.slots, cells.keys, key)
        if cells.slots[at] < 0:
            cells.slots[at], cells.keys[used] = used, key
            used += 1
        cell = cells.sums[cells.slots[at]]
        _add_light(
            cell,
            rig.per_strength,
            rig.weight,
            frame.value[v],
            frame.variance[v],
            shift,
            row.geometry,
            first,
            stop_run,
        )
        _add_place(cell, 2 + 3 * len(rig.per_strength), rig.weight, row, first, stop_run)
    return cells, used


@_jit
def _add_light(cell, per_strength, weight, value, variance, shift, geometry, first, last):
    """Sums of omega f, omega f^2 and omega^2 var(f) of a run of pixels.

    With omega = weight g, f = s L and s = per_strength / g these are sums of L, L^2 / g and var(L), but for factors.
    """
    c = len(per_strength)
    for k in range(c):
        total, square, noise = 0.0, 0.0, 0.0
        for x in range(first, last):
            radiance = np.float64(value[x + shift, k])
            total += radiance
            square += radiance * radiance / geometry[x]
            noise += variance[x + shift, k]
        scale = weight * per_strength[k]
        cell[2 + k] += scale * total
        cell[2 + c + k] += scale * per_strength[k] * square
        cell[2 + 2 * c + k] += scale * scale * noise


@_jit
def _add_place(cell, base, weight, row, first, last):
    """Count, sum of omega, and sums of omega times directions and place of a run of pixels."""
    geometry, incident, exit_, point = row.geometry, row.incident, row.exit, row.point
    total = 0.0
    for x in range(first, last):
        total += geometry[x]
    cell[0] += last - first
    cell[1] += weight * total
    for k in range(3):
        toward, back, place = 0.0, 0.0, 0.0
        for x in range(first, last):
            toward += geometry[x] * incident[k, x]
            back += geometry[x] * exit_[k, x]
            place += geometry[x] * point[k, x]
        cell[base + k] += weight * toward
        cell[base + 3 + k] += weight * back
        cell[base + 6 + k] += weight * place


@_jit
def _slot(slots, keys, key):
    """Where ``key`` stands, or would, in the open hash."""
    mask = len(slots) - 1
    at = (key * SCATTER >> 20) & mask
    while slots[at] >= 0 and keys[slots[at]] != key:
        at = (at + 1) & mask
    return at


@_jit
def _grown(cells):
    """Room for twice as many cells."""
    n, columns = cells.sums.shape
    slots, keys, sums = np.empty(8 * n, np.int32), np.empty(2 * n, np.int64), np.zeros((2 * n, columns))
    slots[:] = -1
    for k in range(n):
        keys[k] = cells.keys[k]
        for m in range(columns):
            sums[k, m] = cells.sums[k, m]
        slots[_slot(slots, keys, keys[k])] = k
    return Cells(slots, keys, sums)
