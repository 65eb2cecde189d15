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
SKY = 200  # directions of light from all over the sky, at the least
FINEST = 16  # parts a side of a patch, and at most so many times as many directions of the sky
CLOSE = (
    3.0  # of a lobe's roughness, radians: sources so close together are as good as one surface (within 2 %)
)
REACH = 6.0  # of the same, from the normal to the half vector: beyond, the lobe changes little across a patch
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
            step = max(
                1, CHUNK // (len(_sky_directions(model)) if surround is None else len(surround.points))
            )
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
    """Radiance (n, c) toward the camera of light from all patches, each facing up with its own radiance.

    A patch that is wider than the gloss which mirrors it is taken in parts: as one source it would be mirrored either
    wholly or not at all.
    """
    most = len(place) * len(surround.points)
    cell, patch, parts = np.empty(most, int), np.empty(most, int), np.empty(most, int)
    source, angles = np.empty(most), np.empty((3, most))
    rows = [np.array(one, float) for one in (place, normal, back, surround.points)]
    area = np.broadcast_to(surround.area, len(surround.points)).astype(float)
    count = _facing(*rows, area, _roughness(model), cell, patch, parts, source, angles)
    cell, patch, parts, source, angles = (
        cell[:count], patch[:count], parts[:count], source[:count], angles[:, :count]
    )  # fmt: skip
    wide = np.flatnonzero(parts > 1)
    if len(wide):
        whole, squares = parts == 1, int(np.sum(parts[wide] ** 2))
        finer = np.empty(squares, int), np.empty(squares, int), np.empty(squares), np.empty((3, squares))
        found = _parted(*rows, area, cell[wide], patch[wide], parts[wide], *finer)
        cell = np.concatenate([cell[whole], finer[0][:found]])
        patch = np.concatenate([patch[whole], finer[1][:found]])
        source = np.concatenate([source[whole], finer[2][:found]])
        angles = np.concatenate([angles[:, whole], finer[3][:, :found]], axis=1)
    if not len(cell):
        return np.zeros((len(place), surround.radiance.shape[1]))
    value = model.evaluate(Cells.of_angles(*angles))
    weighted = value * source[:, None] * surround.radiance[patch]
    return np.stack([np.bincount(cell, column, len(place)) for column in weighted.T], axis=1)


def _roughness(model: Model) -> float:
    """Of the narrowest lobe about the mirror direction, along its narrower axis; without limit where there is none."""
    narrowest = np.inf
    for family, shape in zip(model.lobes.families, model.lobes.shapes, strict=True):
        if family.retro:
            continue
        narrower = np.exp(-np.hypot(*np.log(shape[-2:]))) if family.turning else 1.0
        narrowest = min(narrowest, float(shape[0]) * float(narrower))
    return narrowest


@jit
def _facing(place, normal, back, points, area, roughness, cell, patch, parts, source, angles):
    """Pairs of places (n, 3) and patches (p, 3) that see one another; how many there are. Of each: ``cell``, ``patch``,
    into how many ``parts`` a side the patch is to be cut, the irradiance ``source`` at the place of unit radiance, and
    theta_i, theta_r, dphi, radians, of the light sent on along ``back`` (n, 3)."""
    count = 0
    for n in range(len(place)):
        for p in range(len(points)):
            x, y, z = points[p, 0] - place[n, 0], points[p, 1] - place[n, 1], points[p, 2] - place[n, 2]
            seen = _pair(x, y, z, area[p], normal[n], back[n], count, source, angles)
            if not seen and (z >= 0.0 or not _straddles(x, y, z, area[p], normal[n])):
                continue
            side = math.sqrt(area[p] / (x * x + y * y + z * z))  # radians, across the line of sight
            parts[count] = _parts(angles[0, count], angles[1, count], angles[2, count], side, roughness)
            if not seen and parts[count] == 1:
                continue
            cell[count], patch[count] = n, p
            count += 1
    return count


@jit
def _parts(theta_i, theta_r, dphi, side, roughness):
    """Into how many parts a side a patch of angular ``side`` is to be cut. Aslant, a lobe is narrower across the plane
    of incidence by the cosine."""
    cos_i, cos_r = math.cos(theta_i), math.cos(theta_r)
    across = math.sin(theta_i) * math.sin(theta_r) * math.cos(dphi)
    half = 0.5 * math.sqrt(max(2.0 + 2.0 * (cos_i * cos_r + across), 1e-18))  # cosine, from it to either
    finest = CLOSE * roughness * max(half - 0.35 * side, LEAST_COSINE)  # where the patch is seen most aslant
    if side <= finest:
        return 1
    from_normal = math.acos(min(0.5 * (cos_i + cos_r) / half, 1.0))
    if from_normal > REACH * roughness + 0.5 * side / half:
        return 1
    return min(math.ceil(side / finest), FINEST)


@jit
def _parted(place, normal, back, points, area, cell, patch, parts, cells, patches, source, angles):
    """The pairs (k,) of :func:`_facing` again, of the squares that their patches are cut into."""
    count = 0
    for k in range(len(cell)):
        n, p, sides = cell[k], patch[k], parts[k]
        step = math.sqrt(area[p]) / sides
        for one in range(sides * sides):
            x = points[p, 0] + (one // sides + 0.5 - 0.5 * sides) * step - place[n, 0]
            y = points[p, 1] + (one % sides + 0.5 - 0.5 * sides) * step - place[n, 1]
            z = points[p, 2] - place[n, 2]
            if _pair(x, y, z, step * step, normal[n], back[n], count, source, angles):
                cells[count], patches[count] = n, p
                count += 1
    return count


@jit
def _pair(x, y, z, area, up, toward, at, source, angles):
    """Whether a patch that lies (x, y, z) from a place and faces up is seen there; what it gives, put down ``at``."""
    along = x * up[0] + y * up[1] + z * up[2]
    cos_r = min(max(toward[0] * up[0] + toward[1] * up[1] + toward[2] * up[2], LEAST_COSINE), 1.0)
    squared = x * x + y * y + z * z
    length = math.sqrt(squared)
    cos_i = min(max(along / length, LEAST_COSINE), 1.0)
    across = (x * toward[0] + y * toward[1] + z * toward[2]) / length - cos_i * cos_r
    sines = max(math.sqrt((1.0 - cos_i * cos_i) * (1.0 - cos_r * cos_r)), 1e-12)
    source[at] = along * -z / (squared * squared) * area
    angles[0, at], angles[1, at] = math.acos(cos_i), math.acos(cos_r)
    angles[2, at] = math.acos(min(max(across / sines, -1.0), 1.0))
    return along > 0.0 and z < 0.0


@jit
def _straddles(x, y, z, area, up):
    """Whether some of a patch lies above the tangent plane, whose centre lies below."""
    return x * up[0] + y * up[1] + z * up[2] > -0.5 * math.sqrt(area) * (abs(up[0]) + abs(up[1]))


def _from_sky(normal: np.ndarray, back: np.ndarray, sky: np.ndarray, model: Model) -> np.ndarray:
    """Radiance (n, c) toward the camera of light from all over the sky."""
    toward = _sky_directions(model)
    source = np.maximum(normal @ toward.T, 0.0) * (2.0 * np.pi / len(toward))
    cell, part = np.nonzero(source > 0.0)
    weighted = model.evaluate(_pairs(toward[part], back[cell], normal[cell])) * source[cell, part, None]
    return np.stack([np.bincount(cell, column, len(normal)) for column in weighted.T], axis=1) * sky


def _sky_directions(model: Model) -> np.ndarray:
    """Unit vectors (n, 3) evenly over the hemisphere above the board, as close together as the gloss of ``model``
    needs: a spiral of equal areas (Vogel 1979)."""
    count = int(np.clip(2.0 * np.pi / (CLOSE * _roughness(model)) ** 2, SKY, SKY * FINEST))
    z = (np.arange(count) + 0.5) / count
    turn = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
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
