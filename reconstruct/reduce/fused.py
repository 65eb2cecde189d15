"""The fused kernel: from the pixels of one view to sums over facet pairs, in one pass.

It does what :mod:`reconstruct.reduce.directions` and :func:`reconstruct.reduce.reduce.samples_of` do, pixel by pixel,
without an array between. The region is cut into a fixed number of bands of rows, each with sums of its own, so that
the bands can be worked on by any number of threads and added up in their order: the same bytes for any number of
threads.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from photogonio.reconstruct.reduce.directions import ViewScene
from photogonio.reconstruct.reduce.kernel import reduce_rows
from photogonio.reconstruct.reduce.ray_grid import Lens
from photogonio.reconstruct.reduce.sums_kernel import SumTable
from photogonio.reconstruct.table.facet_table import LEFT_OUT
from photogonio.reconstruct.table.facets import vertices

BANDS = 16  # at most; never a matter of how many threads there are
LEAST_ROWS = 32  # of a band
FIRST_ROOM = 512  # cells


class Rig(NamedTuple):
    """A scene as the kernel takes it."""

    eye: tuple[float, float, float]
    rotation: tuple[float, ...]  # 9, row by row
    spherical: bool
    axis: tuple[float, float, float]  # sphere's centre less the eye
    curvature: float  # one over the sphere's radius; 0: a plane
    power: float  # squared distance from the eye to the sphere's centre, less the squared radius
    edge: float  # length along the ray at which its foot on the centre lies on the margin
    height: float  # of the plane
    outline: np.ndarray  # (n, 3)
    margin_sine: float
    covering: np.ndarray  # (b, 5) balls: centre less the eye, nearest depth, product with a ray on the margin
    shading: np.ndarray  # (b, 4) balls: centre, radius
    patch_heights: np.ndarray  # (p,)
    patch_ends: np.ndarray  # (p,) end of each in patch_normals
    patch_normals: np.ndarray  # (k, 3)
    near: float  # 1: a point light, 0: a directional one
    place: tuple[float, float, float]
    lamp_radius: float
    lamp_sine: float
    cos_i_min: float
    cos_r_min: float
    isotropic: bool
    per_strength: np.ndarray  # (c,) one over the strength
    weight: float  # omega of unit cos * falloff


class Frame(NamedTuple):
    """A view's radiance; ``left`` and ``top`` are the picture's pixel at index 0."""

    value: np.ndarray  # (h, w, c) float32
    variance: np.ndarray  # (h, w, c) float32
    valid: np.ndarray  # (h, w) bool
    saturated: np.ndarray  # (h, w) bool
    left: int
    top: int


class Row(NamedTuple):
    """What is known of one row of the region's w pixels, stage by stage."""

    reason: np.ndarray  # (w,) int8, as in directions.Pairs
    ray: np.ndarray  # (3, w) unit, world
    point: np.ndarray  # (3, w)
    normal: np.ndarray  # (3, w)
    incident: np.ndarray  # (3, w)
    exit: np.ndarray  # (3, w)
    depth: np.ndarray  # (w,) along the ray
    side: np.ndarray  # (w,) positive where the ray meets the sample
    falloff: np.ndarray  # (w,)
    geometry: np.ndarray  # (w,) cos * falloff
    inverse: np.ndarray  # (w,) one over it
    key: np.ndarray  # (w,) int64 of the facet pair, -1 for a pixel left out


def rig_of(scene: ViewScene, *, omega: float) -> Rig:
    """``omega`` is the weight of a pixel whose cos * falloff is 1."""
    axis = scene.sphere[:3] - scene.eye
    distance = float(np.sqrt(axis @ axis))
    radius = float(scene.sphere[3])
    edge = max(np.arcsin(min(radius / distance, 1.0)) - scene.margin, 0.0)
    offset = scene.covering[:, :3] - scene.eye
    away = np.sqrt(np.einsum("ij,ij->i", offset, offset))
    reach = np.arcsin(np.minimum(scene.covering[:, 3] / away, 1.0)) + scene.margin
    normals = [cone for _, cone in scene.patches]
    return Rig(
        eye=tuple(scene.eye.tolist()),
        rotation=tuple(scene.rotation.ravel().tolist()),
        spherical=radius > 0.0,
        axis=tuple(axis.tolist()),
        curvature=1.0 / radius if radius > 0.0 else 0.0,
        power=distance**2 - radius**2,
        edge=float(distance * np.cos(edge)),
        height=float(scene.height),
        outline=np.ascontiguousarray(scene.outline, float),
        margin_sine=float(np.sin(scene.margin)),
        covering=np.column_stack([offset, away - scene.covering[:, 3], away * np.cos(reach)]),
        shading=np.ascontiguousarray(scene.shading),
        patch_heights=np.array([height for height, _ in scene.patches], float),
        patch_ends=np.cumsum([len(cone) for cone in normals], dtype=np.int64),
        patch_normals=np.concatenate([np.zeros((0, 3)), *normals]),
        near=float(scene.near),
        place=tuple(scene.place.tolist()),
        lamp_radius=float(scene.lamp_radius),
        lamp_sine=float(np.sin(scene.lamp_angle)),
        cos_i_min=scene.cos_i_min,
        cos_r_min=scene.cos_r_min,
        isotropic=scene.isotropic,
        per_strength=1.0 / scene.strength,
        weight=omega,
    )


def reduce_region(
    rig: Rig, lens: Lens, frame: Frame, region: tuple[int, int, int, int], level: int, threads: int = 1
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Keys (k,), sums (k, 11 + 3 c) and counts left out of the cells of every band, one band after another.

    The rows are those of :func:`reconstruct.table.facet_table.table_of_sums`, which adds up the bands.
    """
    edges = _edge_planes(level)
    x0, y0, x1, y1 = region
    bands = max(1, min(BANDS, (y1 - y0) // LEAST_ROWS))
    limits = np.linspace(y0, y1, bands + 1).astype(int).tolist()

    def band(k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return _band(rig, lens, frame, (x0, limits[k], x1, limits[k + 1]), level, edges)

    if threads > 1:
        with ThreadPoolExecutor(threads) as pool:
            parts = list(pool.map(band, range(bands)))
    else:
        parts = [band(k) for k in range(bands)]
    keys, sums, left_out = zip(*parts, strict=True)
    return np.concatenate(keys), np.concatenate(sums), np.sum(left_out, axis=0)


def _band(
    rig: Rig, lens: Lens, frame: Frame, region: tuple[int, int, int, int], level: int, edges: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Keys, sums and counts left out of one band. Arrays are made here, since numba is slow to compile that."""
    width, c = region[2] - region[0], frame.value.shape[2]
    step = len(lens.weights)
    wide = (width // step + 2) * step  # rays are made for whole cells of the lens's grid
    ray, point, normal, incident, exit_ = np.zeros((5, 3, wide))
    depth, side, falloff, geometry, inverse = np.zeros((5, wide))
    reason, key = np.zeros(wide, np.int8), np.zeros(wide, np.int64)
    row = Row(reason, ray, point, normal, incident, exit_, depth, side, falloff, geometry, inverse, key)
    room = SumTable(
        np.full(4 * FIRST_ROOM, -1, np.int32),
        np.zeros(FIRST_ROOM, np.int64),
        np.zeros((FIRST_ROOM, 11 + 3 * c)),
    )
    left_out = np.zeros(len(LEFT_OUT), np.int64)
    cells, used = reduce_rows(
        rig,
        lens.nodes,
        np.ascontiguousarray(lens.weights.T),
        frame,
        region,
        level,
        edges,
        row,
        room,
        0,
        left_out,
    )
    return cells.keys[:used], cells.sums[:used], left_out


def compiled_before() -> bool:
    """Whether a compiled kernel is on disk; the first use takes some seconds if none is."""
    module = reduce_rows.py_func.__module__.rpartition(".")[2]
    return any(Path(str(reduce_rows.stats.cache_path)).glob(f"{module}.reduce_rows-*.nbi"))


@lru_cache(maxsize=4)
def _edge_planes(level: int) -> np.ndarray:
    """(f, 9) inward unit normals of each facet's three edges; level 1 and up."""
    corners = vertices(level)
    normals = np.cross(corners, np.roll(corners, -1, axis=1))
    normals = normals / np.linalg.norm(normals, axis=2, keepdims=True)
    return np.ascontiguousarray(normals.reshape(-1, 9))
