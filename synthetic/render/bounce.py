"""What the sample sends out besides the lamps' direct light: light off the board and table, and of the room.

First order: board, sheets and table are lit directly (shadowed by the sample) and shine on the ball as
Lambertian areas. A flat sample lies in their plane and sees none of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates, spline_filter

from photogonio.synthetic.brdf.library import directions
from photogonio.synthetic.brdf.reflectance import Reflectance
from photogonio.synthetic.render.picture import Extra, sample_normals, tangent_frames
from photogonio.synthetic.render.room import World
from photogonio.synthetic.render.trace import floor_radiance

RIM = np.radians(100.0)  # the map reaches beyond the half of the ball that a viewer sees


@dataclass(frozen=True, slots=True)
class SurroundingCells:
    """The surroundings in pieces."""

    place: np.ndarray  # (n, 3)
    area: np.ndarray  # (n,)
    radiance: np.ndarray  # (n, c)


def surroundings(world: World, *, rings: int = 32, spokes: int = 56, fine: int = 3) -> SurroundingCells:
    """Board, sheets and table around the sample's foot, in rings that widen outward.

    Each cell's radiance is the mean over ``fine`` x ``fine`` places in it.
    """
    foot, radius = world.balls[0, :2], world.balls[0, 3]
    reach = max(world.table_radius, float(np.abs(world.page.extent).max()) * 2.0)
    edge = np.concatenate([[0.0], np.geomspace(0.25 * radius, reach, rings)])
    ring, spoke, a, b = np.meshgrid(*(np.arange(n) for n in (rings, spokes, fine, fine)), indexing="ij")
    r2 = edge[ring] ** 2 + (edge[ring + 1] ** 2 - edge[ring] ** 2) * (a + 0.5) / fine  # even in area
    turn = (spoke + (b + 0.5) / fine) * 2.0 * np.pi / spokes
    place = np.stack(
        [foot[0] + np.sqrt(r2) * np.cos(turn), foot[1] + np.sqrt(r2) * np.sin(turn), 0.0 * r2], axis=-1
    )
    points = place.reshape(-1, 3)
    radiance = floor_radiance(world, points).reshape(rings * spokes, fine * fine, -1).mean(axis=1)
    size = np.repeat(np.pi * np.diff(edge**2) / spokes, spokes)
    return SurroundingCells(place.reshape(rings * spokes, fine * fine, 3).mean(axis=1), size, radiance)


def bounced(cells: SurroundingCells, brdf: Reflectance, points, normals, exits) -> np.ndarray:
    """Radiance (n, c) that points of a ball send along ``exits`` from the light of all cells, one by one."""
    frame = tangent_frames(normals)
    total = np.zeros((len(points), cells.radiance.shape[1]))
    for n, (point, axes) in enumerate(zip(points, frame, strict=True)):
        offset = cells.place - point
        d2 = np.einsum("ij,ij->i", offset, offset)
        toward = offset / np.sqrt(d2)[:, None]
        incident = toward @ axes.T
        # cells are level: they face the point with the cosine to the vertical
        share = np.maximum(incident[:, 2], 0.0) * np.maximum(-toward[:, 2], 0.0) * cells.area / d2
        seen = np.flatnonzero(share > 0)
        light = share[seen, None] * cells.radiance[seen]
        total[n] = np.sum(light * brdf(incident[seen], axes @ exits[n]), axis=0)
    return total


def bounce_extra(world: World, brdf: Reflectance, viewer: np.ndarray, *, side: int = 19) -> Extra | None:
    """The bounce as an addition to the render, from a map of side x side places on the near half of the ball.

    None where there is nothing to bounce: a flat sample, or no board and no table.
    """
    bare = world.page.extent[2] <= world.page.extent[0] and world.table_radius <= 0
    if world.balls[0, 3] <= 0 or bare:
        return None
    cells, center, radius = surroundings(world), world.balls[0, :3], world.balls[0, 3]
    toward = (viewer - center) / np.linalg.norm(viewer - center)
    axes = tangent_frames(toward[None])[0]
    reach = np.sqrt(2.0) * np.sin(0.5 * RIM)
    u, v = (a.ravel() for a in np.meshgrid(*[np.linspace(-reach, reach, side)] * 2, indexing="ij"))
    rho = np.minimum(np.hypot(u, v), reach)
    turn, theta = np.arctan2(v, u), 2.0 * np.arcsin(rho / np.sqrt(2.0))
    local = np.stack([np.sin(theta) * np.cos(turn), np.sin(theta) * np.sin(turn), np.cos(theta)], axis=-1)
    normals = local @ axes
    points = center + radius * normals
    exits = raise_above_horizon(
        (viewer - points) / np.linalg.norm(viewer - points, axis=1, keepdims=True), normals
    )
    grid = bounced(cells, brdf, points, normals, exits).reshape(side, side, -1)
    splines = [spline_filter(channel, order=3, mode="nearest") for channel in np.moveaxis(grid, -1, 0)]

    def extra(points: np.ndarray, normals: np.ndarray, exits: np.ndarray) -> np.ndarray:
        local = normals @ axes.T
        stretch = np.sqrt(1.0 / np.maximum(1.0 + local[:, 2], 0.1))  # rho / sin(theta)
        place = (local[:, :2] * stretch[:, None] / reach + 1.0) * 0.5 * (side - 1)
        found = [map_coordinates(s, place.T, order=3, mode="nearest", prefilter=False) for s in splines]
        return np.maximum(np.stack(found, axis=-1), 0.0)

    return extra


def raise_above_horizon(exits: np.ndarray, normals: np.ndarray, floor: float = 0.02) -> np.ndarray:
    """Exit directions tilted up to a cosine of ``floor``, so that the map has no cliff at the ball's limb."""
    cos = np.einsum("ij,ij->i", exits, normals)
    tilted = exits + np.maximum(floor - cos, 0.0)[:, None] * normals
    return tilted / np.linalg.norm(tilted, axis=1, keepdims=True)


def exit_albedo(brdf: Reflectance, *, turns: int = 64) -> tuple[np.ndarray, np.ndarray]:
    """Integral of f cos_i over incidence, (65, c), at 65 cosines of the exit angle, (65,)."""
    cos_r = np.linspace(0.0, 1.0, 65)
    node, weight = np.polynomial.legendre.leggauss(64)
    cos_i = 0.5 * (node + 1.0)
    polar, phi = np.meshgrid(np.arccos(cos_i), (np.arange(turns) + 0.5) * 2.0 * np.pi / turns, indexing="ij")
    incident = directions(polar, phi)
    share = (weight * cos_i * np.pi / turns)[:, None, None]
    azimuths = np.zeros(1) if brdf.isotropic else np.arange(8) * 0.25 * np.pi
    rows = []
    for theta in np.arccos(np.maximum(cos_r, 1e-3)):
        exits = directions(np.full(len(azimuths), theta), azimuths)
        rows.append(np.mean([np.sum(share * brdf(incident, exit), axis=(0, 1)) for exit in exits], axis=0))
    return cos_r, np.stack(rows)


def room_extra(
    world: World, brdf: Reflectance, albedo: tuple[np.ndarray, np.ndarray] | None = None
) -> Extra | None:
    """The room's even light on the sample, as an addition to the render; None in a dark room.

    Exit radiance is ambient times the integral of f cos_i over incidence; a ball on a board sees the room with
    the part (1 + n_z) / 2 of it. Of an anisotropic sample the mean over eight azimuths is taken. ``albedo`` is that of
    :func:`exit_albedo`, if it was worked out before.
    """
    if not np.any(world.ambient > 0):
        return None
    cos_r, table = exit_albedo(brdf) if albedo is None else albedo
    on_board = world.balls[0, 3] > 0 and world.page.extent[2] > world.page.extent[0]

    def extra(points: np.ndarray, normals: np.ndarray, exits: np.ndarray) -> np.ndarray:
        cos = np.einsum("ij,ij->i", exits, sample_normals(world, points))
        open_part = 0.5 * (1.0 + normals[:, 2]) if on_board else np.ones(len(points))
        found = np.stack([np.interp(cos, cos_r, column) for column in table.T], axis=-1)
        return open_part[:, None] * found * world.ambient

    return extra
