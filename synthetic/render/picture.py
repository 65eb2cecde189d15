"""The picture of a world: radiance of every pixel, its area averaged, without noise.

A pixel with an edge in it is sampled on an 8 x 8 grid, its neighbours (where an edge's corner may hide) on 3 x 3,
other pixels of the sample at 2 x 2 Gauss points, and those of even board and table once. There is no chance in it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.synthetic.brdf.reflectance import Reflectance
from photogonio.synthetic.render.highlight import add_highlights
from photogonio.synthetic.render.light import see_lamp
from photogonio.synthetic.render.room import BALL, SAMPLE, World
from photogonio.synthetic.render.trace import label_rays
from photogonio.synthetic.render.trace import shade_pixels as trace_pixels

Extra = Callable[
    [np.ndarray, np.ndarray, np.ndarray], np.ndarray
]  # points, normals, exits (n, 3) -> radiance (n, c)
CHUNK = 160_000  # rays at a time
# degree 5 on the unit disc (Radon 1948): places and weights
LAMP_POINTS = np.array(
    [[0.0, 0.0], *(np.sqrt(2 / 3) * np.array([np.cos(a), np.sin(a)]) for a in np.arange(6) * np.pi / 3)]
)
LAMP_WEIGHTS = np.array([0.25] + [0.125] * 6)


@dataclass(frozen=True, slots=True)
class Detail:
    """How finely a pixel is sampled, points along its side."""

    sample: int = 2
    near: int = 3
    edge: int = 8


def render(
    world: World,
    brdf: Reflectance,
    camera: Camera,
    pose: Pose,
    *,
    extra: tuple[Extra, ...] = (),
    detail: Detail = Detail(),
) -> np.ndarray:
    """Radiance (h, w, c). ``extra``: what the sample sends out besides the lamps' direct light."""
    width, height = camera.size
    corners = plane_corners(camera)
    kind, edge, near = sort_pixels(world, pose, corners)
    smooth = ~edge & ~near
    image = np.zeros((height * width, len(world.ambient)))
    groups = (
        (edge, detail.edge),
        (near, detail.near),
        (smooth & (kind == SAMPLE), detail.sample),
        (smooth & (kind != SAMPLE), 1),
    )
    for mask, count in groups:
        offsets = gauss_points(count) if count <= 2 else (np.arange(count) + 0.5) / count
        shade_pixels(world, brdf, pose, corners, np.flatnonzero(mask), offsets, image, extra)
    picture = image.reshape(height, width, -1)
    add_highlights(world, camera, pose, picture)
    return picture


def gauss_points(count: int) -> np.ndarray:
    """Gauss-Legendre places on [0, 1] whose weights are equal (one or two of them)."""
    return 0.5 * (np.polynomial.legendre.leggauss(count)[0] + 1.0)


def plane_corners(camera: Camera) -> np.ndarray:
    """Places (h+1, w+1, 2) on the plane z = 1 of the camera that the pixels' corners see; read-only."""
    return _plane_corners(camera.matrix.tobytes(), camera.distortion.tobytes(), camera.size)


@lru_cache(maxsize=4)  # undoing the lens costs as much as a tenth of a picture, and a set has one camera
def _plane_corners(matrix: bytes, distortion: bytes, size: tuple[int, int]) -> np.ndarray:
    camera = Camera(np.frombuffer(matrix).reshape(3, 3), np.frombuffer(distortion), size)
    width, height = size
    x, y = np.meshgrid(np.arange(width + 1) - 0.5, np.arange(height + 1) - 0.5)
    rays = camera.rays(np.stack([x.ravel(), y.ravel()], axis=-1))
    corners = np.ascontiguousarray(rays[:, :2] / rays[:, 2:]).reshape(height + 1, width + 1, 2)
    corners.setflags(write=False)
    return corners


def sort_pixels(world: World, pose: Pose, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What the pixels' middles show, and masks of those that a step runs through and of their neighbours (h, w).

    All of a mirror ball counts as steps: what it shows is small.
    """
    height, width = corners.shape[0] - 1, corners.shape[1] - 1
    eye, turned = pose.center, pose.rotation
    at_corner = label_rays(world, eye, turned, corners.reshape(-1, 2)).reshape(height + 1, width + 1)
    middles = pixel_middles(corners).reshape(-1, 2)
    middles.setflags(write=False)  # as the corners are: what may be written is another type, compiled anew
    middle = label_rays(world, eye, turned, middles).reshape(height, width)
    kind = middle % 1024 // 64
    edge = kind == BALL
    for rows in (slice(None, -1), slice(1, None)):
        for columns in (slice(None, -1), slice(1, None)):
            edge |= at_corner[rows, columns] != middle
    near = cv2.dilate(edge.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
    return kind, edge, near & ~edge


def pixel_middles(corners: np.ndarray) -> np.ndarray:
    """Places (h, w, 2) on the plane z = 1 of the pixels' middles."""
    return 0.25 * (corners[1:, 1:] + corners[1:, :-1] + corners[:-1, 1:] + corners[:-1, :-1])


def shade_pixels(world, brdf, pose, corners, pixels, offsets, image, extra) -> None:
    """Adds the light of ``pixels`` (n,), sampled at offsets x offsets, to ``image`` (h w, c)."""
    per_pixel = len(offsets) ** 2
    step = max(CHUNK // per_pixel, 1)
    for first in range(0, len(pixels), step):
        part = pixels[first : first + step]
        where, want = np.empty(len(part) * per_pixel, np.int64), np.empty((len(part) * per_pixel, 7))
        count = trace_pixels(world, pose.center, pose.rotation, corners, part, offsets, image, where, want)
        if count:
            where, points, exits, through = (
                where[:count],
                want[:count, :3],
                want[:count, 3:6],
                want[:count, 6],
            )
            light = through[:, None] * sample_radiance(world, brdf, points, exits, extra)
            for c in range(image.shape[1]):
                image[:, c] += np.bincount(where, light[:, c], minlength=len(image))


def sample_radiance(
    world: World, brdf: Reflectance, points, exits, extra: tuple[Extra, ...] = ()
) -> np.ndarray:
    """Radiance (n, c) that the sample's points (n, 3) send along ``exits`` (n, 3)."""
    normals = sample_normals(world, points)
    frame = tangent_frames(normals)
    exit = np.einsum("nij,nj->ni", frame, exits)
    total = np.zeros((len(points), len(world.ambient)))
    for k, lamp in enumerate(world.lamps):
        seen = see_lamp(world, k, points, 0, world.sample_sheet)
        for direction, falloff in lamp_directions(lamp, points):
            incident = np.einsum("nij,nj->ni", frame, direction)
            strength = seen * falloff * np.maximum(incident[:, 2], 0.0)
            total += strength[:, None] * brdf(incident, exit) * world.intensity[k]
    for more in extra:
        total += more(points, normals, exits)
    return total


def sample_normals(world: World, points: np.ndarray) -> np.ndarray:
    if world.balls[0, 3] > 0:
        return (points - world.balls[0, :3]) / world.balls[0, 3]
    return np.broadcast_to([0.0, 0.0, 1.0], points.shape)


def tangent_frames(normals: np.ndarray) -> np.ndarray:
    """Rows x, y, n (n, 3, 3): x along the circle about the vertical; the board's x at the top."""
    x = np.stack([-normals[:, 1], normals[:, 0], np.zeros(len(normals))], axis=-1)
    size = np.linalg.norm(x, axis=1, keepdims=True)
    x = np.where(size > 1e-12, x / np.maximum(size, 1e-300), [1.0, 0.0, 0.0])
    return np.stack([x, np.cross(normals, x), normals], axis=1)


def lamp_directions(lamp: np.ndarray, points: np.ndarray):
    """Yields unit directions (n, 3) to parts of a lamp and their falloff (n,); one part if it is a point.

    In the plane across the axis a glowing ball is an even disc of radius sin(size), on which Radon's rule integrates
    f cos; the parts' falloffs sum to 1/d^2 but for the foreshortening of the disc itself, below size^2.
    """
    if lamp[0] == 1.0:
        axis, falloff, size = np.broadcast_to(lamp[1:4], points.shape), np.ones(len(points)), np.sin(lamp[4])
    else:
        offset = lamp[1:4] - points
        squared = np.einsum("ij,ij->i", offset, offset)
        axis, falloff = offset / np.sqrt(squared)[:, None], 1.0 / squared
        size = np.minimum(lamp[4] / np.sqrt(squared), 1.0)
    if lamp[4] == 0.0:
        yield axis, falloff
        return
    side = tangent_frames(axis)
    for (u, v), weight in zip(LAMP_POINTS, LAMP_WEIGHTS, strict=True):
        a, b = u * size, v * size
        along = np.broadcast_to(np.sqrt(1.0 - a**2 - b**2), len(points))
        across = np.broadcast_to(np.stack(np.broadcast_arrays(a, b), axis=-1), (len(points), 2))
        direction = along[:, None] * axis + np.einsum("nk,nkj->nj", across, side[:, :2])
        yield direction, falloff * weight / along
