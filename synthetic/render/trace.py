"""The compiled code of rays: what they meet, and what Lambertian things send along them.

The sample itself is left to the caller, who gets a request for each ray that ends on it.
"""

from __future__ import annotations

import math

import numpy as np

from photogonio.capture.jit import borrowing, jit
from photogonio.synthetic.render.light import gather, inside
from photogonio.synthetic.render.print import paper_at
from photogonio.synthetic.render.room import (
    BALL,
    BOARD,
    FAR,
    FIRST_SHEET,
    INK,
    NOTHING,
    PAPER,
    SAMPLE,
    SHEET,
    SIDE,
    TABLE,
    TABLETOP,
    WALL,
    World,
)

BOUNCES = 4  # reflections in mirror balls that a ray may take


@borrowing
def meet_ball(balls, k, ox, oy, oz, dx, dy, dz):
    """Distance along the ray to the near side of ball ``k`` that its origin is outside of, or FAR."""
    px, py, pz = balls[k, 0] - ox, balls[k, 1] - oy, balls[k, 2] - oz
    along = px * dx + py * dy + pz * dz
    if along <= 0.0:
        return FAR
    qx, qy, qz = px - along * dx, py - along * dy, pz - along * dz
    left = balls[k, 3] * balls[k, 3] - (qx * qx + qy * qy + qz * qz)
    return along - math.sqrt(left) if left > 0.0 else FAR


@borrowing
def meet_page(world: World, ox, oy, oz, dx, dy, dz):
    """Distance along a ray that goes down to the page, flat or curled, or FAR."""
    extent = world.page.extent
    if extent[2] <= extent[0]:
        return FAR
    away = ox - 0.5 * (extent[0] + extent[2])
    # the height of the page at x equals that of the ray: a t^2 + b t + c = 0, the root that stays for a = 0
    a, b, c = world.curl * dx * dx, 2.0 * world.curl * dx * away - dz, world.curl * away * away - oz
    root = b * b - 4.0 * a * c
    if c >= 0.0 or root < 0.0 or b + math.sqrt(root) <= 0.0:
        return FAR
    t = -2.0 * c / (b + math.sqrt(root))
    x, y = along_page(world, ox + t * dx), oy + t * dy
    return t if extent[0] <= x <= extent[2] and extent[1] <= y <= extent[3] else FAR


@borrowing
def along_page(world: World, x: float) -> float:
    """Where on the print a point of the page at ``x`` is: the length along the parabola, to the third order."""
    middle = 0.5 * (world.page.extent[0] + world.page.extent[2])
    u = x - middle
    return x + 2.0 / 3.0 * world.curl * world.curl * u * u * u


@borrowing
def nearest(world: World, ox, oy, oz, dx, dy, dz, skip: int):
    """What a ray meets first: kind, index, distance. ``skip``: the ball it starts from, or -1."""
    kind, index, best = NOTHING, -1, FAR
    if dz < 0.0:
        t = -oz / dz
        x, y = ox + t * dx, oy + t * dy
        met = meet_page(world, ox, oy, oz, dx, dy, dz)
        if met < FAR:
            kind, best = BOARD, met
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


@borrowing
def color_at(world: World, kind: int, index: int, x, y) -> int:
    """Row of World.colors that a point of board, table, sheet or its wall has."""
    if kind == BOARD:
        return PAPER if paper_at(world.page, along_page(world, x), y) == 1 else INK
    if kind == TABLE:
        return TABLETOP
    return WALL if kind == SIDE else FIRST_SHEET + index


@borrowing
def ray_of(rotation, u, v):
    """Unit direction in the world through (u, v, 1) of a camera with this rotation."""
    x = rotation[0, 0] * u + rotation[1, 0] * v + rotation[2, 0]
    y = rotation[0, 1] * u + rotation[1, 1] * v + rotation[2, 1]
    z = rotation[0, 2] * u + rotation[1, 2] * v + rotation[2, 2]
    size = 1.0 / math.sqrt(x * x + y * y + z * z)
    return x * size, y * size, z * size


@jit
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


@borrowing
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


@jit
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


@jit
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
