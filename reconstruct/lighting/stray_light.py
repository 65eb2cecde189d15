"""Light that the surroundings throw on the sample: to first order, from the radiance that the photos show there.

The board, the white patch and the table are seen in every photo, so their radiance is known, whatever lit them (the
lamp, or the sample itself). Each patch of them is a small diffuse source; what the sample sends on of it toward the
camera is its BRDF times the irradiance, summed over the patches. Divided by the lamp's irradiance at the same place
that is what the stray light adds to the measured BRDF. A room that is not dark adds a sky, taken as alike all over.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from photogonio.calib.radiometry.surround import Surround
from photogonio.calib.setup import ViewSetup
from photogonio.capture.jit import jit
from photogonio.capture.photoset import Plane, Sphere
from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.modes.parallel import cores
from photogonio.reconstruct.table.cells import Cells

CHUNK = 1 << 16  # pairs of cell and patch at a time
SKY = 200  # directions of light from all over the sky
LEAST_COSINE = 1e-3  # directions nearer to the horizon count as this near


@dataclass(frozen=True, slots=True)
class StrayLight:
    """The surroundings of every view; call it with cells and a model of the surface."""

    sample: Sphere | Plane
    views: Sequence[ViewSetup | None]  # by group
    surrounds: Sequence[Surround | None]  # by group; None: nothing is known, and nothing is added
    sky: np.ndarray | None = None  # (c,) radiance from everywhere above the board, in all views

    def __call__(self, cells: Cells, model: Model) -> np.ndarray:
        """What the stray light adds to the value of each cell, (n, c) 1/sr."""
        added = np.zeros_like(cells.value)

        def fill(group: int) -> None:
            view, surround = self.views[group], self.surrounds[group]
            if view is None or (surround is None and self.sky is None):
                return
            rows = np.flatnonzero(cells.group == group)
            step = max(1, CHUNK // (SKY if surround is None else len(surround.points)))
            for start in range(0, len(rows), step):
                part = rows[start : start + step]
                added[part] = self._added(cells.place[part], view, surround, model)

        with ThreadPoolExecutor(cores()) as pool:  # each view fills cells of its own
            list(pool.map(fill, range(len(self.views))))
        return added

    def _added(
        self, place: np.ndarray, view: ViewSetup, surround: Surround | None, model: Model
    ) -> np.ndarray:
        normal = self._normals(place)
        back = _unit(view.pose.center - place)
        lamp, falloff = view.light.toward(place)
        irradiance = np.maximum(np.einsum("ij,ij->i", lamp, normal), LEAST_COSINE) * falloff
        sent = np.zeros((len(place), len(view.strength)))
        if surround is not None:
            sent += _sent_on(place, normal, back, surround, model)
        if self.sky is not None:
            sent += _from_sky(normal, back, self.sky, model)
        return sent / (irradiance[:, None] * view.strength)

    def _normals(self, place: np.ndarray) -> np.ndarray:
        if isinstance(self.sample, Sphere):
            return _unit(place - self.sample.center)
        return np.broadcast_to([0.0, 0.0, 1.0], place.shape)


def _sent_on(place, normal, back, surround: Surround, model: Model) -> np.ndarray:
    """Radiance (n, c) toward the camera of light from all patches, each facing up with its own radiance."""
    most = len(place) * len(surround.points)
    cell, patch, source, angles = (
        np.empty(most, int),
        np.empty(most, int),
        np.empty(most),
        np.empty((3, most)),
    )
    rows = [np.array(one, float) for one in (place, normal, back, surround.points)]
    area = np.broadcast_to(surround.area, len(surround.points)).astype(float)
    count = _facing(*rows, area, cell, patch, source, angles)
    if not count:
        return np.zeros((len(place), surround.radiance.shape[1]))
    value = model.evaluate(Cells.of_angles(*(angle[:count] for angle in angles)))
    weighted = value * source[:count, None] * surround.radiance[patch[:count]]
    return np.stack([np.bincount(cell[:count], column, len(place)) for column in weighted.T], axis=1)


@jit
def _facing(place, normal, back, points, area, cell, patch, source, angles):
    """Pairs of places (n, 3) and patches (p, 3) that see one another; how many there are. Of each: ``cell``, ``patch``,
    the irradiance ``source`` at the place of unit radiance, and theta_i, theta_r, dphi, radians, of the light sent on
    along ``back`` (n, 3)."""
    count = 0
    for n in range(len(place)):
        up, toward = normal[n], back[n]
        cos_r = toward[0] * up[0] + toward[1] * up[1] + toward[2] * up[2]
        cos_r = min(max(cos_r, LEAST_COSINE), 1.0)
        for p in range(len(points)):
            x, y, z = points[p, 0] - place[n, 0], points[p, 1] - place[n, 1], points[p, 2] - place[n, 2]
            along = x * up[0] + y * up[1] + z * up[2]
            if along <= 0.0 or z >= 0.0:
                continue
            squared = x * x + y * y + z * z
            length = math.sqrt(squared)
            cos_i = min(max(along / length, LEAST_COSINE), 1.0)
            across = (x * toward[0] + y * toward[1] + z * toward[2]) / length - cos_i * cos_r
            sines = max(math.sqrt((1.0 - cos_i * cos_i) * (1.0 - cos_r * cos_r)), 1e-12)
            cell[count], patch[count] = n, p
            source[count] = along * -z / (squared * squared) * area[p]
            angles[0, count], angles[1, count] = math.acos(cos_i), math.acos(cos_r)
            angles[2, count] = math.acos(min(max(across / sines, -1.0), 1.0))
            count += 1
    return count


def _from_sky(normal: np.ndarray, back: np.ndarray, sky: np.ndarray, model: Model) -> np.ndarray:
    """Radiance (n, c) toward the camera of light from all over the sky."""
    toward = _sky_directions()
    source = np.maximum(normal @ toward.T, 0.0) * (2.0 * np.pi / SKY)
    cell, part = np.nonzero(source > 0.0)
    weighted = model.evaluate(_pairs(toward[part], back[cell], normal[cell])) * source[cell, part, None]
    return np.stack([np.bincount(cell, column, len(normal)) for column in weighted.T], axis=1) * sky


def _sky_directions() -> np.ndarray:
    """Unit vectors (SKY, 3) evenly over the hemisphere above the board: a spiral of equal areas (Vogel 1979)."""
    z = (np.arange(SKY) + 0.5) / SKY
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(SKY)
    across = np.sqrt(1.0 - z**2)
    return np.column_stack([across * np.cos(turn), across * np.sin(turn), z])


def _pairs(incident: np.ndarray, exit: np.ndarray, normal: np.ndarray) -> Cells:
    cos_i = np.clip(np.einsum("ij,ij->i", incident, normal), LEAST_COSINE, 1.0)
    cos_r = np.clip(np.einsum("ij,ij->i", exit, normal), LEAST_COSINE, 1.0)
    across = np.einsum("ij,ij->i", incident, exit) - cos_i * cos_r
    sines = np.sqrt((1.0 - cos_i**2) * (1.0 - cos_r**2))
    cos_d = np.clip(across / np.maximum(sines, 1e-12), -1.0, 1.0)
    return Cells.of_angles(np.arccos(cos_i), np.arccos(cos_r), np.arccos(cos_d))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
