"""The compiled part of the renderer: rays against the world, shadows, and the light on Lambertian things.

Light on a Lambertian point is exact: a glowing ball wholly above the horizon gives what a point at its centre
would (I cos / d^2), times the fraction of its disc that no other ball covers, times 0 or 1 for the raised sheets.
The sample itself is left to the caller, who gets a request for each ray that ends on it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from synthetic.pattern import Print, paper_at

NOTHING, BOARD, TABLE, SHEET, SAMPLE, BALL, SIDE = range(7)
BOUNCES = 4  # reflections in mirror balls that a ray may take
FAR = 1e30


class World(NamedTuple):
    """Everything that stands in the room, in the world frame, as arrays for the compiled code."""

    page: Print
    paper: np.ndarray  # (c,) reflectance of white paper
    ink: np.ndarray  # (c,)
    table: np.ndarray  # (c,) of the table, the plane z = 0 around the page
    table_radius: float  # about the origin; 0: none
    sphere: np.ndarray  # (4,) the sample's centre and radius; radius 0: no sphere
    balls: np.ndarray  # (n, 5) mirror balls: centre, radius, reflectance
    sheet_outline: np.ndarray  # (p, v, 2) raised sheets: corners counter-clockwise, the last one repeated
    sheet_height: np.ndarray  # (p,)
    sheet_sample: np.ndarray  # (p,) bool: it is the sample
    sheet_reflectance: np.ndarray  # (p, c) of those that are not
    lamp: (
        np.ndarray
    )  # (k, 5) kind (0 point, 1 directional), place (3) or direction, radius (angular if directional)
    intensity: np.ndarray  # (k, c) radiance units x length^2 (point) or irradiance (directional)
    ambient: np.ndarray  # (c,) radiance of the room itself, on all sides


@njit(cache=True, nogil=True)
def inside(outline: np.ndarray, x: float, y: float) -> bool:
    for k in range(len(outline)):
        x0, y0 = outline[k]
        x1, y1 = outline[(k + 1) % len(outline)]
        if (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) < 0.0:
            return False
    return True


@njit(cache=True, nogil=True)
def meet_ball(cx, cy, cz, radius, ox, oy, oz, dx, dy, dz):
    """Distance along the ray to the near side of a ball that its origin is outside of, or FAR."""
    px, py, pz = cx - ox, cy - oy, cz - oz
    along = px * dx + py * dy + pz * dz
    if along <= 0.0:
        return FAR
    qx, qy, qz = px - along * dx, py - along * dy, pz - along * dz
    left = radius * radius - (qx * qx + qy * qy + qz * qz)
    if left < 0.0:
        return FAR
    t = along - math.sqrt(left)
    return t if t > 1e-9 * along else FAR


@njit(cache=True, nogil=True)
def nearest(world: World, ox, oy, oz, dx, dy, dz, skip: int):
    """What a ray meets first: kind, index, distance. ``skip``: the mirror ball it starts from, or -1."""
    kind, index, best = NOTHING, -1, FAR
    if dz < 0.0:
        t = -oz / dz
        x, y = ox + t * dx, oy + t * dy
        extent = world.page.extent
        if extent[0] <= x <= extent[2] and extent[1] <= y <= extent[3] and extent[2] > extent[0]:
            kind, best = BOARD, t
        elif x * x + y * y < world.table_radius**2:
            kind, best = TABLE, t
        for k in range(len(world.sheet_height)):
            if t <= best and inside(world.sheet_outline[k], x, y):
                kind, index, best = SIDE, k, t  # came in below its edge, unless its top is met first
            above = (world.sheet_height[k] - oz) / dz
            if 0.0 < above < best and inside(world.sheet_outline[k], ox + above * dx, oy + above * dy):
                kind, index, best = SHEET, k, above
        if kind == SHEET and world.sheet_sample[index]:
            kind = SAMPLE
    if world.sphere[3] > 0.0:
        s = world.sphere
        t = meet_ball(s[0], s[1], s[2], s[3], ox, oy, oz, dx, dy, dz)
        if t < best:
            kind, index, best = SAMPLE, -1, t
    for k in range(len(world.balls)):
        if k != skip:
            s = world.balls[k]
            t = meet_ball(s[0], s[1], s[2], s[3], ox, oy, oz, dx, dy, dz)
            if t < best:
                kind, index, best = BALL, k, t
    return kind, index, best


@njit(cache=True, nogil=True)
def covered(a: float, b: float, apart: float) -> float:
    """Fraction of a disc of angular radius ``b`` under one of ``a`` at an angle ``apart``, by plane geometry."""
    if apart >= a + b:
        return 0.0
    if apart <= a - b:
        return 1.0
    if apart <= b - a:
        return (a / b) ** 2
    u = (apart * apart + b * b - a * a) / (2.0 * apart * b)
    v = (apart * apart + a * a - b * b) / (2.0 * apart * a)
    u, v = min(1.0, max(-1.0, u)), min(1.0, max(-1.0, v))
    kite = (a + b - apart) * (apart + a - b) * (apart - a + b) * (apart + a + b)
    lens = b * b * math.acos(u) + a * a * math.acos(v) - 0.5 * math.sqrt(max(kite, 0.0))
    return lens / (math.pi * b * b)


@njit(cache=True, nogil=True)
def behind_ball(ball: np.ndarray, x, y, z, lx, ly, lz, distance, size):
    """Fraction of a lamp in unit direction l, of angular radius ``size``, that a ball hides from a point."""
    px, py, pz = ball[0] - x, ball[1] - y, ball[2] - z
    to = math.sqrt(px * px + py * py + pz * pz)
    if to >= distance or to <= ball[3]:
        return 0.0
    a = math.asin(ball[3] / to)
    # the angle between, safe near 0
    cx, cy, cz = py * lz - pz * ly, pz * lx - px * lz, px * ly - py * lx
    apart = math.atan2(math.sqrt(cx * cx + cy * cy + cz * cz), px * lx + py * ly + pz * lz)
    return covered(a, size, apart)


@njit(cache=True, nogil=True)
def lamp_from(world: World, k: int, x, y, z):
    """Unit direction to lamp k from a point, falloff 1/d^2 or 1, distance, angular radius."""
    lamp = world.lamp[k]
    if lamp[0] == 1.0:
        return lamp[1], lamp[2], lamp[3], 1.0, FAR, lamp[4]
    dx, dy, dz = lamp[1] - x, lamp[2] - y, lamp[3] - z
    squared = dx * dx + dy * dy + dz * dz
    d = math.sqrt(squared)
    return dx / d, dy / d, dz / d, 1.0 / squared, d, math.asin(min(lamp[4] / d, 1.0))


@njit(cache=True, nogil=True)
def visible(world: World, k: int, x, y, z, on_sphere: bool, skip: int, on_sheet: int) -> float:
    """Fraction of lamp k that a point sees past balls and sheets, its own horizon apart."""
    lx, ly, lz, _, distance, size = lamp_from(world, k, x, y, z)
    fraction = 1.0
    if world.sphere[3] > 0.0 and not on_sphere:
        fraction -= behind_ball(world.sphere, x, y, z, lx, ly, lz, distance, size)
    for b in range(len(world.balls)):
        if b != skip:
            fraction -= behind_ball(world.balls[b], x, y, z, lx, ly, lz, distance, size)
    if lz > 0.0:
        for p in range(len(world.sheet_height)):
            t = (world.sheet_height[p] - z) / lz
            if p != on_sheet and 0.0 < t < distance:
                if inside(world.sheet_outline[p], x + t * lx, y + t * ly):
                    return 0.0
    return max(fraction, 0.0)


@njit(cache=True, nogil=True)
def irradiance(world: World, x, y, z, on_sheet: int, out: np.ndarray) -> float:
    """Irradiance (c,) of an upward-facing point into ``out``; returns the sum of visible fractions."""
    seen = 0.0
    out[:] = math.pi * world.ambient
    for k in range(len(world.lamp)):
        _, _, lz, falloff, _, _ = lamp_from(world, k, x, y, z)
        if lz > 0.0:
            part = visible(world, k, x, y, z, False, -1, on_sheet)
            seen += part
            for c in range(len(out)):
                out[c] += world.intensity[k, c] * falloff * lz * part
    return seen


@njit(cache=True, nogil=True)
def reflectance_at(world: World, kind: int, index: int, x, y):
    """Lambertian reflectance (c,) of board, table, sheet or its side, and a number that tells its colours."""
    if kind == BOARD:
        shade = paper_at(world.page, x, y)
        return (world.paper if shade == 1 else world.ink), shade
    if kind == TABLE:
        return world.table, 0
    if kind == SIDE:
        return world.ink, 2
    return world.sheet_reflectance[index], 3


@njit(cache=True, nogil=True)
def label_rays(world: World, origin: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """A number (n,) a ray that differs wherever the picture may step: thing, ink, lit, shadow, penumbra."""
    labels = np.empty(len(directions), np.int32)
    light = np.empty(len(world.ambient))
    for n in range(len(directions)):
        dx, dy, dz = directions[n]
        kind, index, t = nearest(world, origin[0], origin[1], origin[2], dx, dy, dz, -1)
        label = kind * 64 + (index + 1)
        if kind == BOARD or kind == TABLE or kind == SHEET or (kind == SAMPLE and index >= 0):
            x, y, z = origin[0] + t * dx, origin[1] + t * dy, origin[2] + t * dz
            shade = 4 if kind == SAMPLE else reflectance_at(world, kind, index, x, y)[1]
            seen = irradiance(world, x, y, z, index, light)
            whole = int(seen)
            label += 1024 * (shade + 1) + 8192 * (2 * whole + (seen > whole))
        labels[n] = label
    return labels


@njit(cache=True, nogil=True)
def shade_rays(
    world, origin, directions, pixel, weight, image, want_pixel, want_weight, want_point, want_exit
):
    """Adds what each ray sees, times its weight, to ``image`` (pixels, c); returns the number of sample requests.

    ``pixel`` (n,), ``weight`` (n,). Requests: pixel, weight, point (world) and unit direction back along the ray.
    """
    count = 0
    light = np.empty(len(world.ambient))
    for n in range(len(directions)):
        ox, oy, oz = origin[0], origin[1], origin[2]
        dx, dy, dz = directions[n]
        through, skip = weight[n], -1
        for _ in range(BOUNCES + 1):
            kind, index, t = nearest(world, ox, oy, oz, dx, dy, dz, skip)
            if kind == NOTHING:
                image[pixel[n]] += through * world.ambient
                break
            ox, oy, oz = ox + t * dx, oy + t * dy, oz + t * dz
            if kind == SAMPLE:
                want_pixel[count], want_weight[count] = pixel[n], through
                want_point[count, 0], want_point[count, 1], want_point[count, 2] = ox, oy, oz
                want_exit[count, 0], want_exit[count, 1], want_exit[count, 2] = -dx, -dy, -dz
                count += 1
                break
            if kind != BALL:
                reflectance, _ = reflectance_at(world, kind, index, ox, oy)
                if kind == SIDE:
                    light[:] = math.pi * world.ambient
                else:
                    irradiance(world, ox, oy, oz, index if kind == SHEET else -1, light)
                image[pixel[n]] += through * reflectance * light / math.pi
                break
            ball = world.balls[index]
            nx, ny, nz = (ox - ball[0]) / ball[3], (oy - ball[1]) / ball[3], (oz - ball[2]) / ball[3]
            turn = 2.0 * (dx * nx + dy * ny + dz * nz)
            dx, dy, dz = dx - turn * nx, dy - turn * ny, dz - turn * nz
            through, skip = through * ball[4], index
    return count


@njit(cache=True, nogil=True)
def see_lamp(world: World, k: int, points: np.ndarray, on_sphere: bool, on_sheet: int) -> np.ndarray:
    """Visible fraction (n,) of lamp k from points (n, 3) of the sample, its own horizon apart."""
    out = np.empty(len(points))
    for n in range(len(points)):
        out[n] = visible(world, k, points[n, 0], points[n, 1], points[n, 2], on_sphere, -1, on_sheet)
    return out


@njit(cache=True, nogil=True)
def light_up(world: World, points: np.ndarray) -> np.ndarray:
    """Irradiance (n, c) of upward-facing points (n, 3) on board or table."""
    out = np.empty((len(points), len(world.ambient)))
    for n in range(len(points)):
        irradiance(world, points[n, 0], points[n, 1], points[n, 2], -1, out[n])
    return out


@njit(cache=True, nogil=True)
def surface_reflectance(world: World, points: np.ndarray) -> np.ndarray:
    """Reflectance (n, c) of what lies at the x, y of points (n, 3): a sheet, the page, the table."""
    out = np.empty((len(points), len(world.ambient)))
    for n in range(len(points)):
        x, y = points[n, 0], points[n, 1]
        extent = world.page.extent
        on_page = extent[2] > extent[0] and extent[0] <= x <= extent[2] and extent[1] <= y <= extent[3]
        kind, index = (BOARD if on_page else TABLE), -1
        for p in range(len(world.sheet_height)):
            if not world.sheet_sample[p] and inside(world.sheet_outline[p], x, y):
                kind, index = SHEET, p
        out[n], _ = reflectance_at(world, kind, index, x, y)
        if kind == TABLE and x * x + y * y >= world.table_radius**2:
            out[n] = 0.0
    return out
