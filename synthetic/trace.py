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
INK, PAPER, TABLETOP, WALL, FIRST_SHEET = range(5)  # rows of World.colors
BOUNCES = 4  # reflections in mirror balls that a ray may take
FAR = 1e30


class World(NamedTuple):
    """Everything that stands in the room, in the world frame, as arrays for the compiled code."""

    page: Print
    colors: np.ndarray  # (4 + p, c) reflectances: ink, paper, table, walls of sheets, each sheet
    table_radius: float  # of the table, the plane z = 0 about the origin; 0: none
    balls: (
        np.ndarray
    )  # (1 + n, 5) centre, radius, reflectance; the sample first, radius 0 where it is no ball
    outlines: np.ndarray  # (p, v, 2) raised sheets: corners counter-clockwise, the last one repeated
    heights: np.ndarray  # (p,)
    sample_sheet: int  # the sheet that is the sample, or -1
    lamps: (
        np.ndarray
    )  # (k, 5) kind (0 point, 1 directional), place or direction, radius (angular if directional)
    intensity: np.ndarray  # (k, c) radiance units x length^2 (point) or irradiance (directional)
    ambient: np.ndarray  # (c,) radiance of the room itself, on all sides


@njit(cache=True, nogil=True, error_model="numpy")
def inside(outlines: np.ndarray, p: int, x: float, y: float) -> bool:
    """Whether a point is within outline ``p``, convex and counter-clockwise."""
    last = outlines.shape[1] - 1
    x0, y0 = outlines[p, last, 0], outlines[p, last, 1]
    for k in range(last + 1):
        x1, y1 = outlines[p, k, 0], outlines[p, k, 1]
        if (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) < 0.0:
            return False
        x0, y0 = x1, y1
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def meet_ball(balls, k, ox, oy, oz, dx, dy, dz):
    """Distance along the ray to the near side of ball ``k`` that its origin is outside of, or FAR."""
    px, py, pz = balls[k, 0] - ox, balls[k, 1] - oy, balls[k, 2] - oz
    along = px * dx + py * dy + pz * dz
    if along <= 0.0:
        return FAR
    qx, qy, qz = px - along * dx, py - along * dy, pz - along * dz
    left = balls[k, 3] * balls[k, 3] - (qx * qx + qy * qy + qz * qz)
    return along - math.sqrt(left) if left > 0.0 else FAR


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def nearest(world: World, ox, oy, oz, dx, dy, dz, skip: int):
    """What a ray meets first: kind, index, distance. ``skip``: the ball it starts from, or -1."""
    kind, index, best = NOTHING, -1, FAR
    if dz < 0.0:
        t = -oz / dz
        x, y = ox + t * dx, oy + t * dy
        extent = world.page.extent
        if extent[0] <= x <= extent[2] and extent[1] <= y <= extent[3] and extent[2] > extent[0]:
            kind, best = BOARD, t
        elif x * x + y * y < world.table_radius * world.table_radius:
            kind, best = TABLE, t
        for k in range(len(world.heights)):
            if t <= best and inside(world.outlines, k, x, y):
                kind, index, best = SIDE, k, t  # came in below its edge, unless its top is met first
            above = (world.heights[k] - oz) / dz
            if 0.0 < above <= best and inside(world.outlines, k, ox + above * dx, oy + above * dy):
                kind, index, best = (SAMPLE if k == world.sample_sheet else SHEET), k, above
    for k in range(len(world.balls)):
        if k != skip and world.balls[k, 3] > 0.0:
            t = meet_ball(world.balls, k, ox, oy, oz, dx, dy, dz)
            if t < best:
                kind, index, best = (BALL if k else SAMPLE), (k if k else -1), t
    return kind, index, best


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy")
def behind_ball(balls, k, x, y, z, lx, ly, lz, distance, size):
    """Fraction of a lamp in unit direction l, its angular radius of sine ``size``, that ball k hides from a point."""
    px, py, pz, radius = balls[k, 0] - x, balls[k, 1] - y, balls[k, 2] - z, balls[k, 3]
    squared, along = px * px + py * py + pz * pz, px * lx + py * ly + pz * lz
    cx, cy, cz = py * lz - pz * ly, pz * lx - px * lz, px * ly - py * lx
    across = cx * cx + cy * cy + cz * cz
    to = math.sqrt(squared)
    # most points are far from the shadow: sin(apart) > sin(a) + b, or the ball is behind
    if across > (radius + size * to) ** 2 and (along > 0.0 or radius < 0.99 * to):
        return 0.0
    if to >= distance or to <= radius:
        return 0.0
    return covered(math.asin(radius / to), math.asin(size), math.atan2(math.sqrt(across), along))


@njit(cache=True, nogil=True, error_model="numpy")
def lamp_from(lamps, k, x, y, z):
    """Unit direction to lamp k from a point, falloff 1/d^2 or 1, distance, sine of its angular radius."""
    if lamps[k, 0] == 1.0:
        return lamps[k, 1], lamps[k, 2], lamps[k, 3], 1.0, FAR, math.sin(lamps[k, 4])
    dx, dy, dz = lamps[k, 1] - x, lamps[k, 2] - y, lamps[k, 3] - z
    squared = dx * dx + dy * dy + dz * dz
    d = math.sqrt(squared)
    return dx / d, dy / d, dz / d, 1.0 / squared, d, min(lamps[k, 4] / d, 1.0)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def visible(world: World, x, y, z, lx, ly, lz, distance, size, skip: int, on_sheet: int) -> float:
    """Fraction of a lamp that a point sees past balls (but ``skip``) and sheets (but ``on_sheet``)."""
    fraction = 1.0
    for b in range(len(world.balls)):
        if b != skip and world.balls[b, 3] > 0.0:
            fraction -= behind_ball(world.balls, b, x, y, z, lx, ly, lz, distance, size)
    if lz > 0.0:
        for p in range(len(world.heights)):
            t = (world.heights[p] - z) / lz
            if p != on_sheet and 0.0 < t < distance and inside(world.outlines, p, x + t * lx, y + t * ly):
                return 0.0
    return max(fraction, 0.0)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def gather(world: World, x, y, z, on_sheet: int, gain: np.ndarray) -> float:
    """Irradiance over intensity of each lamp (k,) at an upward-facing point; returns the visible fractions' sum."""
    seen = 0.0
    for k in range(len(world.lamps)):
        lx, ly, lz, falloff, distance, size = lamp_from(world.lamps, k, x, y, z)
        gain[k] = 0.0
        if lz > 0.0:
            part = visible(world, x, y, z, lx, ly, lz, distance, size, -1, on_sheet)
            seen += part
            gain[k] = falloff * lz * part
    return seen


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def color_at(world: World, kind: int, index: int, x, y) -> int:
    """Row of World.colors that a point of board, table, sheet or its wall has."""
    if kind == BOARD:
        return PAPER if paper_at(world.page, x, y) == 1 else INK
    if kind == TABLE:
        return TABLETOP
    return WALL if kind == SIDE else FIRST_SHEET + index


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def ray_of(rotation, u, v):
    """Unit direction in the world through (u, v, 1) of a camera with this rotation."""
    x = rotation[0, 0] * u + rotation[1, 0] * v + rotation[2, 0]
    y = rotation[0, 1] * u + rotation[1, 1] * v + rotation[2, 1]
    z = rotation[0, 2] * u + rotation[1, 2] * v + rotation[2, 2]
    size = 1.0 / math.sqrt(x * x + y * y + z * z)
    return x * size, y * size, z * size


@njit(cache=True, nogil=True, error_model="numpy")
def label_rays(world: World, origin: np.ndarray, rotation: np.ndarray, plane: np.ndarray) -> np.ndarray:
    """A number a ray (n,) that differs wherever the picture may step: thing, ink, lit, shadow, penumbra.

    ``plane`` (n, 2): where the rays meet the camera's plane z = 1.
    """
    labels = np.empty(len(plane), np.int32)
    gain = np.empty(len(world.lamps))
    for n in range(len(plane)):
        dx, dy, dz = ray_of(rotation, plane[n, 0], plane[n, 1])
        kind, index, t = nearest(world, origin[0], origin[1], origin[2], dx, dy, dz, -1)
        label = kind * 64 + (index + 1)
        if kind == BOARD or kind == TABLE or kind == SHEET or (kind == SAMPLE and index >= 0):
            x, y, z = origin[0] + t * dx, origin[1] + t * dy, origin[2] + t * dz
            color = 0 if kind == SAMPLE else color_at(world, kind, index, x, y)
            seen = gather(world, x, y, z, index, gain)
            whole = int(seen)
            label += 1024 * (color + 1) + 65536 * (2 * whole + (seen > whole))
        labels[n] = label
    return labels


@njit(cache=True, nogil=True, error_model="numpy")
def shade_ray(world, ox, oy, oz, dx, dy, dz, through, image, pixel, gain, want, n):
    """Adds what a ray sees, times ``through``, to ``image[pixel]``. If it ends on the sample it fills ``want[n]``:

    point (3) in the world, unit direction back along the ray (3), what is left of ``through``; returns whether.
    """
    skip, channels = -1, image.shape[1]
    for _ in range(BOUNCES + 1):
        kind, index, t = nearest(world, ox, oy, oz, dx, dy, dz, skip)
        if kind == NOTHING:
            for c in range(channels):
                image[pixel, c] += through * world.ambient[c]
            return False
        ox, oy, oz = ox + t * dx, oy + t * dy, oz + t * dz
        if kind == SAMPLE:
            want[n, 0], want[n, 1], want[n, 2] = ox, oy, oz
            want[n, 3], want[n, 4], want[n, 5], want[n, 6] = -dx, -dy, -dz, through
            return True
        if kind != BALL:
            color = color_at(world, kind, index, ox, oy)
            for k in range(len(gain)):
                gain[k] = 0.0
            if kind != SIDE:
                gather(world, ox, oy, oz, index if kind == SHEET else -1, gain)
            for c in range(channels):
                light = math.pi * world.ambient[c]
                for k in range(len(gain)):
                    light += gain[k] * world.intensity[k, c]
                image[pixel, c] += through * world.colors[color, c] * light / math.pi
            return False
        radius = world.balls[index, 3]
        nx, ny = (ox - world.balls[index, 0]) / radius, (oy - world.balls[index, 1]) / radius
        nz = (oz - world.balls[index, 2]) / radius
        turn = 2.0 * (dx * nx + dy * ny + dz * nz)
        dx, dy, dz = dx - turn * nx, dy - turn * ny, dz - turn * nz
        through, skip = through * world.balls[index, 4], index
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def shade_pixels(world, origin, rotation, corners, pixels, offsets, image, want_pixel, want):
    """Adds the mean over offsets x offsets of each of ``pixels`` (n,) to ``image`` (h w, c).

    ``corners`` (h+1, w+1, 2): the pixels' corners on the camera's plane z = 1. Rays that end on the sample are left
    to the caller: their pixel in ``want_pixel`` and what :func:`shade_ray` says in ``want`` (m, 7). Returns how many.
    """
    count, width, side = 0, corners.shape[1] - 1, len(offsets)
    part, ox, oy, oz = 1.0 / (side * side), origin[0], origin[1], origin[2]
    gain = np.empty(len(world.lamps))
    for n in range(len(pixels)):
        p = pixels[n]
        row, column = p // width, p % width
        for j in range(side):
            b = offsets[j]
            for i in range(side):
                a = offsets[i]
                u = (1 - b) * ((1 - a) * corners[row, column, 0] + a * corners[row, column + 1, 0])
                u += b * ((1 - a) * corners[row + 1, column, 0] + a * corners[row + 1, column + 1, 0])
                v = (1 - b) * ((1 - a) * corners[row, column, 1] + a * corners[row, column + 1, 1])
                v += b * ((1 - a) * corners[row + 1, column, 1] + a * corners[row + 1, column + 1, 1])
                dx, dy, dz = ray_of(rotation, u, v)
                want_pixel[count] = p
                if shade_ray(world, ox, oy, oz, dx, dy, dz, part, image, p, gain, want, count):
                    count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def see_lamp(world: World, k: int, points: np.ndarray, skip: int, on_sheet: int) -> np.ndarray:
    """Visible fraction (n,) of lamp k from points (n, 3), past all balls but ``skip``, their own horizon apart."""
    out = np.empty(len(points))
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        lx, ly, lz, _, distance, size = lamp_from(world.lamps, k, x, y, z)
        out[n] = visible(world, x, y, z, lx, ly, lz, distance, size, skip, on_sheet)
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def floor_radiance(world: World, points: np.ndarray) -> np.ndarray:
    """Radiance (n, c) of what lies at the x, y of points (n, 3): a sheet, the page, the table."""
    out, gain, extent = (
        np.zeros((len(points), len(world.ambient))),
        np.empty(len(world.lamps)),
        world.page.extent,
    )
    for n in range(len(points)):
        x, y = points[n, 0], points[n, 1]
        on_page = extent[2] > extent[0] and extent[0] <= x <= extent[2] and extent[1] <= y <= extent[3]
        kind, index = (BOARD if on_page else TABLE), -1
        for p in range(len(world.heights)):
            if p != world.sample_sheet and inside(world.outlines, p, x, y):
                kind, index = SHEET, p
        if kind == TABLE and x * x + y * y >= world.table_radius * world.table_radius:
            continue
        color = color_at(world, kind, index, x, y)
        gather(world, x, y, world.heights[index] if kind == SHEET else 0.0, index, gain)
        for c in range(len(world.ambient)):
            light = math.pi * world.ambient[c]
            for k in range(len(gain)):
                light += gain[k] * world.intensity[k, c]
            out[n, c] = world.colors[color, c] * light / math.pi
    return out
