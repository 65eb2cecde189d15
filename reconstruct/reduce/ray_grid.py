"""Rays of many pixels of one camera, interpolated from a grid of exact ones.

Undistortion is an iteration for each pixel; the rays are smooth, so those of every 16th pixel and a polynomial of
fifth degree in each direction give all others to about 1e-13. The grid belongs to the camera, not to its pose, and
is kept.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from photogonio.calib.geometry.camera import Camera

STEP = 16  # pixels between nodes
LEAST_STEP = 4
TOLERANCE = 1e-13  # radians; near the outline of a ball it is magnified a thousand times
ORDER = 6  # nodes in each direction that a ray is interpolated from
BEFORE = 2  # of them before the pixel's cell


@dataclass(frozen=True, slots=True)
class Lens:
    """Nodes of the ray grid: ``nodes[j, i]`` is (x / z, y / z) of pixel ((i - 2) step, (j - 2) step)."""

    nodes: np.ndarray  # (rows, columns, 2)
    weights: np.ndarray  # (step, 6) of the nodes around a pixel, by its place between nodes

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """Unit rays (n, 3) in the camera frame of whole pixels (n, 2) of the picture."""
        step = len(self.weights)
        (i, u), (j, v) = (np.divmod(pixels[:, k].astype(np.int64), step) for k in (0, 1))
        columns = self.nodes.shape[1]
        around = (np.arange(ORDER)[:, None] * columns + np.arange(ORDER)).ravel()
        nodes = self.nodes.reshape(-1, 2)[(j * columns + i)[:, None] + around]
        weights = (self.weights[v][:, :, None] * self.weights[u][:, None, :]).reshape(-1, 1, ORDER**2)
        flat = (weights @ nodes)[:, 0]
        rays = np.column_stack([flat, np.ones(len(flat))])
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)


def lens_of(camera: Camera) -> Lens:
    """The ray grid of a camera, the same one for the same numbers."""
    return _lens(camera.matrix.tobytes(), camera.distortion.tobytes(), camera.size)


@lru_cache(maxsize=4)
def _lens(matrix: bytes, distortion: bytes, size: tuple[int, int]) -> Lens:
    camera = Camera(np.frombuffer(matrix).reshape(3, 3), np.frombuffer(distortion), size)
    step = STEP
    lens = _grid(camera, step)
    while step > LEAST_STEP and _error(lens, camera) > TOLERANCE:
        step //= 2
        lens = _grid(camera, step)
    return lens


def _grid(camera: Camera, step: int) -> Lens:
    columns, rows = ((length - 1) // step + ORDER for length in camera.size)
    j, i = np.mgrid[:rows, :columns]
    pixels = np.column_stack([i.ravel(), j.ravel()]) - BEFORE
    rays = camera.rays(step * pixels.astype(float))
    nodes = (rays[:, :2] / rays[:, 2:]).reshape(rows, columns, 2)
    return Lens(nodes, _lagrange(np.arange(step) / step))


def _lagrange(place: np.ndarray) -> np.ndarray:
    """Weights (n, 6) of values at -2 .. 3 in the polynomial through them, at places (n,) between 0 and 1."""
    nodes = np.arange(ORDER) - BEFORE
    weights = np.ones((len(place), ORDER))
    for k in range(ORDER):
        for m in range(ORDER):
            if m != k:
                weights[:, k] *= (place - nodes[m]) / (nodes[k] - nodes[m])
    return weights


def _error(lens: Lens, camera: Camera) -> float:
    """Greatest error, radians, at the pixels in the middle of the cells along the border and both diagonals."""
    width, height = camera.size
    along = np.linspace(0.0, 1.0, 200)
    edges = [(along, 0 * along), (along, 0 * along + 1), (0 * along, along), (0 * along + 1, along)]
    lines = [*edges, (along, along), (along, 1 - along)]
    x, y = np.concatenate(lines, axis=1)
    step = len(lens.weights)
    middles = [
        np.minimum(np.floor(t * (n - 1) / step) * step + step // 2, n - 1)
        for t, n in ((x, width), (y, height))
    ]
    pixels = np.column_stack(middles)
    return float(np.max(np.linalg.norm(lens.rays(pixels) - camera.rays(pixels), axis=1)))
