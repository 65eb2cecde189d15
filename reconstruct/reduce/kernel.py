"""The compiled stages of :mod:`reconstruct.reduce.fused`, each for one row of pixels, which stays in the first cache.

What is summed of a row stands in :mod:`reconstruct.reduce.sums_kernel`. A stage takes whole tuples of arrays, so it is
called for a row, never for a pixel. Columns are unsigned (``start``, ``stop``): an index that may be negative is tested
for it, and keeps a loop out of the vector lanes. Signed and unsigned must not meet, or numba makes a float of them.
"""

from __future__ import annotations

import numpy as np

from photogonio.capture.jit import jit
from photogonio.reconstruct.reduce.directions import CANONICAL_AZIMUTH, OUTSIDE, USED
from photogonio.reconstruct.reduce.ray_grid import ORDER
from photogonio.reconstruct.reduce.sums_kernel import gather
from photogonio.reconstruct.table.facet_table import LEFT_OUT
from photogonio.reconstruct.table.facets import facet_of
from photogonio.reconstruct.table.refinement import FINEST_NEAR, NEAR_SLOPE2

INSIDE = 1e-12  # sine of the distance from a facet's edges at which a direction is surely inside
_OUTLINE, _COVERED, _UNLIT, _GRAZING, _SHADOWED, _SATURATED, _INVALID, _ = range(len(LEFT_OUT))
_COS, _SIN = float(np.cos(CANONICAL_AZIMUTH)), float(np.sin(CANONICAL_AZIMUTH))


@jit
def reduce_rows(rig, nodes, taps, frame, region, level, edges, row, cells, used, left_out):
    """The cells of the rows of a region, and how many are in use: stage by stage, one row of pixels at a time."""
    x0, y0, x1, y1 = region
    first = x0 // taps.shape[1] * taps.shape[1]  # the column at index 0 of a row
    for y in range(y0, y1):
        v, shift = y - frame.top, np.uint64(first - frame.left)  # a negative shift wraps round, and back
        _aim(rig.rotation, nodes, taps, y, first, x1, row.ray)
        start, stop = _meet(rig, row, np.uint64(x0 - first), np.uint64(x1 - first))
        _cover(rig, row, start, stop)
        _pair(rig, row, start, stop)
        _judge(rig, row, start, stop)
        if rig.isotropic:
            _turn(row.ray, row.normal, row.geometry, row.inverse, row.incident, row.exit, start, stop)
        _expose(row.falloff, row.geometry, row.inverse, start, stop)
        _screen(frame.valid[v], frame.saturated[v], shift, row.reason, start, stop)
        _find(row, start, stop, edges, level)
        cells, used = gather(rig, frame.value[v], frame.variance[v], shift, row, start, stop, cells, used)
        for x in range(start, stop):
            if row.reason[x] >= 0:
                left_out[row.reason[x]] += 1
    return cells, used


@jit
def _aim(r, nodes, taps, y, first, last, ray):
    """Unit world rays of the pixels of a row, columns ``first`` to ``last``, from the lens's nodes.

    ``r`` is the pose's rotation, row by row; ``taps`` (6, step) are the lens's weights by node.
    """
    step = taps.shape[1]
    j, v, i0 = y // step, y % step, first // step
    count = (last - first + step - 1) // step
    lines = np.zeros((2, count + ORDER - 1))
    for k in range(ORDER):
        for i in range(lines.shape[1]):
            lines[0, i] += taps[k, v] * nodes[j + k, i0 + i, 0]
            lines[1, i] += taps[k, v] * nodes[j + k, i0 + i, 1]
    width = np.uint64(step)
    for i in range(np.uint64(count)):
        for u in range(width):
            a, b = 0.0, 0.0
            for k in range(np.uint64(ORDER)):
                a += taps[k, u] * lines[0, i + k]
                b += taps[k, u] * lines[1, i + k]
            ray[0, i * width + u], ray[1, i * width + u] = a, b
    for x in range(np.uint64(count) * width):
        a, b = ray[0, x], ray[1, x]
        dx, dy, dz = r[0] * a + r[3] * b + r[6], r[1] * a + r[4] * b + r[7], r[2] * a + r[5] * b + r[8]
        scale = 1.0 / np.sqrt(dx * dx + dy * dy + dz * dz)
        ray[0, x], ray[1, x], ray[2, x] = dx * scale, dy * scale, dz * scale


@jit
def _meet(rig, row, start, stop):
    """Depths at which rays meet the sample, and the range within ``start`` to ``stop`` where they do."""
    if rig.spherical:
        _meet_sphere(row.ray, rig.axis, rig.power, rig.edge, row.depth, row.side, row.reason, start, stop)
    else:
        _sides(rig.outline, 0, len(rig.outline), row.ray, row.side, start, stop)
        height = rig.height - rig.eye[2]
        _meet_plane(row.ray, height, rig.margin_sine, row.depth, row.side, row.reason, start, stop)
    one = np.uint64(1)
    while start < stop and row.side[start] <= 0.0:
        start += one
    while stop > start and row.side[stop - one] <= 0.0:
        stop -= one
    for x in range(start, stop):
        if row.side[x] <= 0.0:
            row.reason[x] = OUTSIDE
    return start, stop


@jit
def _meet_sphere(ray, axis, power, edge, depth, side, reason, start, stop):
    ax, ay, az = axis
    for x in range(start, stop):
        b = ray[0, x] * ax + ray[1, x] * ay + ray[2, x] * az
        rest = b * b - power
        side[x] = rest if b > 0.0 else -1.0
        depth[x] = b - np.sqrt(max(rest, 0.0))
        reason[x] = USED if b > edge else _OUTLINE


@jit
def _meet_plane(ray, height, margin_sine, depth, side, reason, start, stop):
    for x in range(start, stop):
        far = height / ray[2, x]
        depth[x] = far
        reason[x] = USED if side[x] > margin_sine else _OUTLINE
        side[x] = side[x] if far > 0.0 else -1.0


@jit
def _sides(normals, first, last, ray, side, start, stop):
    """Least of the products of each ray with some of the normals: positive inside their cone."""
    for x in range(start, stop):
        side[x] = np.inf
    for k in range(first, last):
        nx, ny, nz = normals[k, 0], normals[k, 1], normals[k, 2]
        for x in range(start, stop):
            product = nx * ray[0, x] + ny * ray[1, x] + nz * ray[2, x]
            side[x] = product if product < side[x] else side[x]


@jit
def _cover(rig, row, start, stop):
    """Leaves out what mirror balls and white patches cover."""
    ray, depth, side, reason = row.ray, row.depth, row.side, row.reason
    for k in range(len(rig.covering)):
        bx, by, bz = rig.covering[k, 0], rig.covering[k, 1], rig.covering[k, 2]
        front, edge = rig.covering[k, 3], rig.covering[k, 4]
        for x in range(start, stop):
            along = ray[0, x] * bx + ray[1, x] * by + ray[2, x] * bz
            if along > edge and front < depth[x] and reason[x] == USED:
                reason[x] = _COVERED
    first = 0
    for k in range(len(rig.patch_heights)):
        last, height = rig.patch_ends[k], rig.patch_heights[k] - rig.eye[2]
        _sides(rig.patch_normals, first, last, ray, side, start, stop)
        for x in range(start, stop):
            before = height / ray[2, x] <= depth[x] * (1.0 + 1e-9)
            if before and side[x] > -rig.margin_sine and reason[x] == USED:
                reason[x] = _COVERED
        first = last


@jit
def _pair(rig, row, start, stop):
    """Point, normal, direction to the lamp (``incident``) and back (``exit``), falloff, and both cosines.

    cos_i is left in ``geometry`` and cos_r in ``inverse``. Without branches, so that it runs in vector lanes: a
    plane is a sphere of no curvature whose normal is up, a directional light one whose place is not of a point.
    """
    ray, depth, point, normal, incident = row.ray, row.depth, row.point, row.normal, row.incident
    bend, near, up = rig.curvature, rig.near, 0.0 if rig.spherical else 1.0
    ex, ey, ez = rig.eye
    ax, ay, az = rig.axis
    px, py, pz = rig.place
    for x in range(start, stop):
        dx, dy, dz = depth[x] * ray[0, x], depth[x] * ray[1, x], depth[x] * ray[2, x]
        point[0, x], point[1, x], point[2, x] = ex + dx, ey + dy, ez + dz
        normal[0, x], normal[1, x], normal[2, x] = (dx - ax) * bend, (dy - ay) * bend, (dz - az) * bend + up
    for x in range(start, stop):
        tx, ty, tz = px - near * point[0, x], py - near * point[1, x], pz - near * point[2, x]
        falloff = 1.0 / (tx * tx + ty * ty + tz * tz)
        scale = np.sqrt(falloff)
        incident[0, x], incident[1, x], incident[2, x] = tx * scale, ty * scale, tz * scale
        row.falloff[x] = falloff
    for x in range(start, stop):
        nx, ny, nz = normal[0, x], normal[1, x], normal[2, x]
        row.geometry[x] = nx * incident[0, x] + ny * incident[1, x] + nz * incident[2, x]
        row.inverse[x] = -(nx * ray[0, x] + ny * ray[1, x] + nz * ray[2, x])
        row.exit[0, x], row.exit[1, x], row.exit[2, x] = -ray[0, x], -ray[1, x], -ray[2, x]


@jit
def _judge(rig, row, start, stop):
    """Leaves out what the lamp does not wholly shine on, grazing pixels, and those in a mirror ball's shadow."""
    reason, cos_i, cos_r, falloff = row.reason, row.geometry, row.inverse, row.falloff
    shaded, across = len(rig.shading) > 0, rig.near * rig.lamp_radius
    for x in range(start, stop):
        if reason[x] == USED:
            if cos_i[x] < rig.cos_i_min or cos_r[x] < rig.cos_r_min or shaded:
                lamp = max(across * np.sqrt(falloff[x]), rig.lamp_sine)
                if cos_i[x] <= lamp:
                    reason[x] = _UNLIT
                elif cos_i[x] < rig.cos_i_min or cos_r[x] < rig.cos_r_min:
                    reason[x] = _GRAZING
                elif _shadowed(rig.shading, rig.near, row.point, row.incident, x, falloff[x], lamp):
                    reason[x] = _SHADOWED


@jit
def _shadowed(balls, near, point, toward, x, falloff, lamp):
    for k in range(len(balls)):
        dx, dy, dz = balls[k, 0] - point[0, x], balls[k, 1] - point[1, x], balls[k, 2] - point[2, x]
        along = dx * toward[0, x] + dy * toward[1, x] + dz * toward[2, x]
        if along > 0.0:
            reach = balls[k, 3] + lamp * along
            before = near == 0.0 or along - balls[k, 3] < 1.0 / np.sqrt(falloff)
            if before and dx * dx + dy * dy + dz * dz - along * along < reach * reach:
                return True
    return False


@jit
def _turn(ray, normal, cos_i, cos_r, incident, exit_, start, stop):
    """Incident and exit in the tangent frame, as :func:`reconstruct.reduce.directions.canonical` has them."""
    for x in range(start, stop):
        nx, ny, nz = normal[0, x], normal[1, x], normal[2, x]
        tx, ty, tz = incident[0, x], incident[1, x], incident[2, x]
        dx, dy, dz = ray[0, x], ray[1, x], ray[2, x]
        sin_i = np.sqrt(max(1.0 - cos_i[x] * cos_i[x], 0.0))
        sin_r = np.sqrt(max(1.0 - cos_r[x] * cos_r[x], 0.0))
        oblique = sin_i > 1e-9
        per = 1.0 / (sin_i if oblique else 1.0)
        triple = nx * (ty * dz - tz * dy) + ny * (tz * dx - tx * dz) + nz * (tx * dy - ty * dx)
        along = -(tx * dx + ty * dy + tz * dz + cos_i[x] * cos_r[x]) * per
        across = -triple * per
        along, across = along if oblique else sin_r, across if oblique else 0.0
        exit_[0, x], exit_[1, x] = _COS * along - _SIN * across, _SIN * along + _COS * across
        exit_[2, x] = cos_r[x]
        incident[0, x], incident[1, x], incident[2, x] = _COS * sin_i, _SIN * sin_i, cos_i[x]


@jit
def _expose(falloff, geometry, inverse, start, stop):
    """``geometry`` from cos_i to cos_i * falloff, and its inverse."""
    for x in range(start, stop):
        geometry[x] *= falloff[x]
        inverse[x] = 1.0 / geometry[x]


@jit
def _screen(valid, saturated, shift, reason, start, stop):
    """Leaves out pixels that the photo says nothing of; ``shift`` is from a row's index to the photo's columns."""
    for x in range(start, stop):
        if reason[x] == USED:
            if saturated[x + shift]:
                reason[x] = _SATURATED
            elif not valid[x + shift]:
                reason[x] = _INVALID


@jit
def _find(row, start, stop, edges, level):
    """Keys of the pixels' facet pairs, finer toward the mirror direction."""
    incident, exit_, reason, key = row.incident, row.exit, row.reason, row.key
    finer = max(FINEST_NEAR - level, 0)
    shift = 2 * finer
    facets = len(edges) << shift
    facet_i = facet_r = np.int64(-1)
    for x in range(start, stop):
        key[x] = -1
        if reason[x] != USED:
            continue
        ix, iy, iz = incident[0, x], incident[1, x], incident[2, x]
        rx, ry, rz = exit_[0, x], exit_[1, x], exit_[2, x]
        if (ix + rx) ** 2 + (iy + ry) ** 2 < NEAR_SLOPE2 * (iz + rz) ** 2:
            fine_i, fine_r = facet_of(ix, iy, iz, level + finer), facet_of(rx, ry, rz, level + finer)
            key[x] = np.int64(fine_i) * facets + fine_r
            continue
        if facet_i < 0 or not _inside(edges, facet_i, ix, iy, iz):
            facet_i = facet_of(ix, iy, iz, level)
        if facet_r < 0 or not _inside(edges, facet_r, rx, ry, rz):
            facet_r = facet_of(rx, ry, rz, level)
        key[x] = (facet_i << shift) * facets + (facet_r << shift)


@jit
def _inside(edges, facet, x, y, z):
    """Whether a direction is surely in a facet: mostly it is in that of the pixel before."""
    return (
        edges[facet, 0] * x + edges[facet, 1] * y + edges[facet, 2] * z > INSIDE
        and edges[facet, 3] * x + edges[facet, 4] * y + edges[facet, 5] * z > INSIDE
        and edges[facet, 6] * x + edges[facet, 7] * y + edges[facet, 8] * z > INSIDE
    )
