"""The compiled code of direct light: which part of a lamp a point sees, and what it gets from it.

Light on a Lambertian point is exact: a glowing ball wholly above the horizon gives what a point at its centre
would (I cos / d^2), times the fraction of its disc that no other ball covers, times 0 or 1 for the raised sheets.
"""

from __future__ import annotations

import math

import numpy as np

from photogonio.capture.jit import borrowing, jit
from photogonio.synthetic.render.room import FAR, World

FLAT = 1e-6  # height, length units, up to which a page lies on the table


@borrowing
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


@borrowing
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


@borrowing
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


@borrowing
def lamp_from(lamps, k, x, y, z):
    """Unit direction to lamp k from a point, falloff 1/d^2 or 1, distance, sine of its angular radius."""
    if lamps[k, 0] == 1.0:
        return lamps[k, 1], lamps[k, 2], lamps[k, 3], 1.0, FAR, math.sin(lamps[k, 4])
    dx, dy, dz = lamps[k, 1] - x, lamps[k, 2] - y, lamps[k, 3] - z
    squared = dx * dx + dy * dy + dz * dz
    d = math.sqrt(squared)
    return dx / d, dy / d, dz / d, 1.0 / squared, d, min(lamps[k, 4] / d, 1.0)


@borrowing
def through_shade(shades, k, lx, ly, lz):
    """Part of lamp k's light that its shade lets go the way to a point that sees it in unit direction l: 1 within the
    cone, half at its half angle, and a smooth step between."""
    if k >= len(shades) or shades[k, 3] <= 0.0:
        return 1.0
    along = -(lx * shades[k, 0] + ly * shades[k, 1] + lz * shades[k, 2])
    angle = math.acos(min(1.0, max(-1.0, along)))
    t = min(1.0, max(0.0, (shades[k, 3] - angle) / shades[k, 4] + 0.5))
    return t * t * (3.0 - 2.0 * t)


@borrowing
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


@borrowing
def slope_at(world: World, x, y, z) -> float:
    """How steeply the page rises along x at a point of it that lies above the table; 0 elsewhere."""
    extent = world.page.extent
    if world.curl <= 0.0 or z < FLAT or y < extent[1] or y > extent[3]:
        return 0.0
    return 2.0 * world.curl * (x - 0.5 * (extent[0] + extent[2]))


@borrowing
def gather(world: World, x, y, z, on_sheet: int, gain: np.ndarray) -> float:
    """Irradiance over intensity of each lamp (k,) at a point that faces up, or as the page does; returns the visible
    fractions' sum."""
    seen, slope = 0.0, (slope_at(world, x, y, z) if on_sheet < 0 else 0.0)
    size_of_normal = math.sqrt(1.0 + slope * slope)
    for k in range(len(world.lamps)):
        lx, ly, lz, falloff, distance, size = lamp_from(world.lamps, k, x, y, z)
        gain[k] = 0.0
        facing = (lz - slope * lx) / size_of_normal
        if facing > 0.0:
            part = visible(world, x, y, z, lx, ly, lz, distance, size, -1, on_sheet)
            seen += part
            gain[k] = falloff * facing * part * through_shade(world.shades, k, lx, ly, lz)
    return seen


@jit
def see_lamp(world: World, k: int, points: np.ndarray, skip: int, on_sheet: int) -> np.ndarray:
    """Fraction (n,) of lamp k's light that reaches points (n, 3), out of its shade and past all balls but ``skip``,
    their own horizon apart."""
    out = np.empty(len(points))
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        lx, ly, lz, _, distance, size = lamp_from(world.lamps, k, x, y, z)
        part = visible(world, x, y, z, lx, ly, lz, distance, size, skip, on_sheet)
        out[n] = part * through_shade(world.shades, k, lx, ly, lz)
    return out
