"""Light that the surroundings throw on the sample: to first order, from the radiance that the photos show there.

The board, the white patch and the table are seen in every photo, so their radiance is known, whatever lit them (the
lamp, or the sample itself). Each patch of them is a small diffuse source; what the sample sends on of it toward the
camera is its BRDF times the irradiance, summed over the patches. Divided by the lamp's irradiance at the same place
that is what the stray light adds to the measured BRDF.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from calib.setup import ViewSetup
from calib.surround import Surround
from capture.photoset import Plane, Sphere
from reconstruct.cells import Cells
from reconstruct.model import Model
from reconstruct.rows import cores

CHUNK = 1 << 16  # pairs of cell and patch at a time
LEAST_COSINE = 1e-3  # directions nearer to the horizon count as this near


@dataclass(frozen=True, slots=True)
class StrayLight:
    """The surroundings of every view; call it with cells and a model of the surface."""

    sample: Sphere | Plane
    views: Sequence[ViewSetup | None]  # by group
    surrounds: Sequence[Surround | None]  # by group; None: nothing is known, and nothing is added

    def __call__(self, cells: Cells, model: Model) -> np.ndarray:
        """What the stray light adds to the value of each cell, (n, c) 1/sr."""
        added = np.zeros_like(cells.value)

        def fill(group: int) -> None:
            view, surround = self.views[group], self.surrounds[group]
            if view is None or surround is None:
                return
            rows = np.flatnonzero(cells.group == group)
            step = max(1, CHUNK // max(1, len(surround.points)))
            for start in range(0, len(rows), step):
                part = rows[start : start + step]
                added[part] = self._added(cells.place[part], view, surround, model)

        with ThreadPoolExecutor(cores()) as pool:  # each view fills cells of its own
            list(pool.map(fill, range(len(self.views))))
        return added

    def _added(self, place: np.ndarray, view: ViewSetup, surround: Surround, model: Model) -> np.ndarray:
        normal = self._normals(place)
        back = _unit(view.pose.center - place)
        lamp, falloff = view.light.toward(place)
        irradiance = np.maximum(np.einsum("ij,ij->i", lamp, normal), LEAST_COSINE) * falloff
        sent = _sent_on(place, normal, back, surround, model)
        return sent / (irradiance[:, None] * view.strength)

    def _normals(self, place: np.ndarray) -> np.ndarray:
        if isinstance(self.sample, Sphere):
            return _unit(place - self.sample.center)
        return np.broadcast_to([0.0, 0.0, 1.0], place.shape)


def _sent_on(place, normal, back, surround: Surround, model: Model) -> np.ndarray:
    """Radiance (n, c) toward the camera of light from all patches, each facing up with its own radiance."""
    path = surround.points - place[:, None]
    squared = np.einsum("npk,npk->np", path, path)
    toward = path / np.sqrt(squared)[..., None]
    cos_i = np.einsum("npk,nk->np", toward, normal)
    source = np.maximum(cos_i, 0.0) * np.maximum(-toward[..., 2], 0.0) / squared * surround.area
    cell, patch = np.nonzero(source > 0.0)
    if not len(cell):
        return np.zeros((len(place), surround.radiance.shape[1]))
    pairs = _pairs(toward[cell, patch], back[cell], normal[cell])
    weighted = model.evaluate(pairs) * source[cell, patch, None] * surround.radiance[patch]
    return np.stack([np.bincount(cell, column, len(place)) for column in weighted.T], axis=1)


def _pairs(incident: np.ndarray, exit: np.ndarray, normal: np.ndarray) -> Cells:
    cos_i = np.clip(np.einsum("ij,ij->i", incident, normal), LEAST_COSINE, 1.0)
    cos_r = np.clip(np.einsum("ij,ij->i", exit, normal), LEAST_COSINE, 1.0)
    across = np.einsum("ij,ij->i", incident, exit) - cos_i * cos_r
    sines = np.sqrt((1.0 - cos_i**2) * (1.0 - cos_r**2))
    cos_d = np.clip(across / np.maximum(sines, 1e-12), -1.0, 1.0)
    return Cells.of_angles(np.arccos(cos_i), np.arccos(cos_r), np.arccos(cos_d))


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
