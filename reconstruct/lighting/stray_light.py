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
    pairs, source, angles = np.empty((3, most), np.int32), np.empty(most), np.empty((3, most))
    rows = [np.array(one, float) for one in (place, normal, back, surround.points)]
    area = np.broadcast_to(surround.area, len(surround.points)).astype(float)
    count, wide = _facing(*rows, area, _roughness(model), pairs, source, angles)
    if wide:
        aslant = pairs[:, most - wide :][:, ::-1].copy()
        beyond = max(count + int(np.sum(aslant[2] ** 2)) - most, 0)
        if beyond:
            pairs, source, angles = (
                np.concatenate([one, np.empty((*one.shape[:-1], beyond), one.dtype)], axis=-1)
                for one in (pairs, source, angles)
            )
        count = _parted(*rows, area, aslant, count, pairs, source, angles)
    sent = np.zeros((len(place), surround.radiance.shape[1]))
    if count:
        value = model.evaluate(Cells.of_angles(*angles[:, :count]))
        _summed(pairs, value, source, np.asarray(surround.radiance, float), sent)
    return sent


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
def _facing(place, normal, back, points, area, roughness, pairs, source, angles):
    """Pairs of places (n, 3) and patches (p, 3) that see one another: how many are whole, and how many are not.

    Of a whole one, at the front: in ``pairs`` (3, n * p) its place and patch, in ``source`` the irradiance at the place
    of unit radiance, in ``angles`` theta_i, theta_r, dphi, radians, of the light sent on along ``back`` (n, 3). Of one
    whose patch is to be cut, from the end backward: place, patch, and into how many parts a side.
    """
    count, wide, most = 0, 0, pairs.shape[1]
    for n in range(len(place)):
        up = normal[n]
        cos_r = _cosine(back[n], up)
        theta_r = math.acos(cos_r)
        for p in range(len(points)):
            x, y, z = points[p, 0] - place[n, 0], points[p, 1] - place[n, 1], points[p, 2] - place[n, 2]
            if z >= 0.0:
                continue
            along = x * up[0] + y * up[1] + z * up[2]
            seen = along > 0.0
            if not seen and not _straddles(along, area[p], up):
                continue
            squared, cos_i, sines, turn = _sent(x, y, z, along, back[n], cos_r)
            side = math.sqrt(area[p] / squared)  # radians, across the line of sight
            parts = _parts(cos_i, cos_r, sines * turn, side, roughness)
            if parts > 1:
                wide += 1
                pairs[0, most - wide], pairs[1, most - wide], pairs[2, most - wide] = n, p, parts
            elif seen:
                pairs[0, count], pairs[1, count] = n, p
                source[count] = along * -z / (squared * squared) * area[p]
                angles[0, count], angles[1, count] = math.acos(cos_i), theta_r
                angles[2, count] = math.acos(turn)
                count += 1
    return count, wide


@jit
def _parts(cos_i, cos_r, across, side, roughness):
    """Into how many parts a side a patch of angular ``side`` is to be cut. Aslant, a lobe is narrower across the plane
    of incidence by the cosine. ``across`` is the product of the sines and the cosine of dphi."""
    half = 0.5 * math.sqrt(max(2.0 + 2.0 * (cos_i * cos_r + across), 1e-18))  # cosine, from it to either
    finest = CLOSE * roughness * max(half - 0.35 * side, LEAST_COSINE)  # where the patch is seen most aslant
    if side <= finest:
        return 1
    from_normal = math.acos(min(0.5 * (cos_i + cos_r) / half, 1.0))
    if from_normal > REACH * roughness + 0.5 * side / half:
        return 1
    return min(math.ceil(side / finest), FINEST)


@jit
def _parted(place, normal, back, points, area, wide, count, pairs, source, angles):
    """The squares that the patches of ``wide`` (3, k) pairs are cut into, put down as :func:`_facing` has it from
    ``count`` on; how many there are then."""
    for k in range(wide.shape[1]):
        n, p, sides = wide[0, k], wide[1, k], wide[2, k]
        step = math.sqrt(area[p]) / sides
        cos_r = _cosine(back[n], normal[n])
        for one in range(sides * sides):
            x = points[p, 0] + (one // sides + 0.5 - 0.5 * sides) * step - place[n, 0]
            y = points[p, 1] + (one % sides + 0.5 - 0.5 * sides) * step - place[n, 1]
            z = points[p, 2] - place[n, 2]
            along = x * normal[n, 0] + y * normal[n, 1] + z * normal[n, 2]
            if along <= 0.0 or z >= 0.0:
                continue
            squared, cos_i, _, turn = _sent(x, y, z, along, back[n], cos_r)
            pairs[0, count], pairs[1, count] = n, p
            source[count] = along * -z / (squared * squared) * (step * step)
            angles[0, count], angles[1, count] = math.acos(cos_i), math.acos(cos_r)
            angles[2, count] = math.acos(turn)
            count += 1
    return count


@jit
def _cosine(toward, up):
    """Between a direction and a normal, as :data:`LEAST_COSINE` has it."""
    return min(max(toward[0] * up[0] + toward[1] * up[1] + toward[2] * up[2], LEAST_COSINE), 1.0)


@jit
def _sent(x, y, z, along, toward, cos_r):
    """Of light from (x, y, z), ``along`` of it along the normal, sent on ``toward`` the camera: the squared distance,
    cos theta_i, the product of both sines, cos dphi."""
    squared = x * x + y * y + z * z
    length = math.sqrt(squared)
    cos_i = min(max(along / length, LEAST_COSINE), 1.0)
    across = (x * toward[0] + y * toward[1] + z * toward[2]) / length - cos_i * cos_r
    sines = max(math.sqrt((1.0 - cos_i * cos_i) * (1.0 - cos_r * cos_r)), 1e-12)
    return squared, cos_i, sines, min(max(across / sines, -1.0), 1.0)


@jit
def _straddles(along, area, up):
    """Whether some of a patch lies above the tangent plane, whose centre lies below."""
    return along > -0.5 * math.sqrt(area) * (abs(up[0]) + abs(up[1]))


@jit
def _summed(pairs, value, source, radiance, sent):
    """Adds to ``sent`` (n, c) what each of k pairs sends on: its ``value`` (k, c) times the irradiance there."""
    for k in range(len(value)):
        n, p = pairs[0, k], pairs[1, k]
        for c in range(sent.shape[1]):
            sent[n, c] += value[k, c] * source[k] * radiance[p, c]


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
