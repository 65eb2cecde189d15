"""Where a flat sample is: by the edges of its outline in the photos, one place and tilt for all of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from photogonio.calib.detect.limb import find_edges
from photogonio.calib.detect.paper import project_with_scale
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.print_map import Print
from photogonio.capture.photoset import Plane
from scipy.optimize import least_squares

_STEP = 6.0  # pixels between places along an edge
_CORNER = 0.08  # of an edge at either end, where the other edge is near
_PRINT = 2.5  # pixels between what is looked for and the next edge of the print
_LEAST = 40  # points of all photos from which a place is told
_FEW = 8  # of one photo
_TAIL = 0.5  # pixels: what is found so close to the end of the search is the flank of an edge beyond
_MISPLACED = 0.02  # of the sample's size: how far off the manifest may put it, sideways and in height
_GROWN = 0.02  # how much larger or smaller it may make it, either way
_TURNED = 0.02  # radians, about the normal and off the level
_BIAS = 0.3  # pixels
_SOFT = 2.0  # standard errors beyond which an edge point counts less
_SURE = 5.0  # standard errors at which a move is believed
_MOST = 4.0  # expected errors of the manifest beyond which it is not


@dataclass(frozen=True, slots=True)
class Edges:
    """Points of a flat sample's outline in one photo."""

    places: np.ndarray  # (n, 3) world, on the manifest's outline, where each point should be
    pixels: np.ndarray  # (n, 2) where it was found, to be compared across the edge alone
    normals: np.ndarray  # (n, 2) unit, across the edge in the picture
    sigma: np.ndarray  # (n,) pixels

    def __len__(self) -> int:
        return len(self.places)


@dataclass(frozen=True, slots=True)
class PlaneMove:
    """How a flat sample lies against the manifest, with standard errors."""

    # (8,) x, y, turn about the normal (radians), height, slopes along x and y, growth along x and y
    values: np.ndarray
    errors: np.ndarray  # (8,)
    size: float  # of the sample, half its larger side

    @property
    def expected(self) -> np.ndarray:
        """(8,) what the manifest may be off by."""
        aside = self.size * _MISPLACED
        return np.array([aside, aside, _TURNED, aside, _TURNED, _TURNED, _GROWN, _GROWN])

    @property
    def plausible(self) -> bool:
        return bool((np.abs(self.values) < _MOST * self.expected).all())

    @property
    def tilt(self) -> tuple[float, float]:
        """Slope off the level and its standard error, radians."""
        slope = self.values[4:6]
        size = float(np.hypot(*slope))
        return size, float(np.hypot(*(slope * self.errors[4:6])) / max(size, 1e-12))

    def applied(self, plane: Plane) -> Plane:
        """The plane where it is, but for its tilt; a part that is not surely off stays the manifest's."""
        if not self.plausible:
            return plane
        sure = np.abs(self.values) > _SURE * self.errors
        values = np.where(sure, self.values, 0.0)
        values[4:6] = 0.0
        moved = moved_points(_on(plane, plane.outline), plane, values)
        return Plane(moved[:, :2], plane.height + float(values[3]))


def moved_points(points: np.ndarray, plane: Plane, values: np.ndarray) -> np.ndarray:
    """Points (n, 3) of the manifest's plane where ``values`` (8,) put them."""
    middle = np.append(np.asarray(plane.outline, float).mean(0), plane.height)
    off = (points - middle) * np.append(1.0 + values[6:8], 1.0)
    cosine, sine = np.cos(values[2]), np.sin(values[2])
    x = cosine * off[:, 0] - sine * off[:, 1] + values[0]
    y = sine * off[:, 0] + cosine * off[:, 1] + values[1]
    z = off[:, 2] + values[3] + values[4] * off[:, 0] + values[5] * off[:, 1]
    return middle + np.column_stack([x, y, z])


def _on(plane: Plane, flat: np.ndarray) -> np.ndarray:
    flat = np.asarray(flat, float)
    return np.column_stack([flat, np.full(len(flat), plane.height)])


def plane_edges(
    level: np.ndarray,
    usable: np.ndarray,
    camera: Camera,
    pose: Pose,
    plane: Plane,
    within: float,
    print_: Print | None = None,
    origin: tuple[int, int] = (0, 0),
) -> Edges | None:
    """The edges of the outline in one photo, at most ``within`` pixels off; None if too few are clear.

    ``level`` (h, w) float32 is linear radiance, its first pixel the photo's ``origin``. Edges of the board's ``print_``
    are stronger than a sample's: where one may come within reach nothing is looked for.
    """
    places, ahead = [], []
    corners = _on(plane, plane.outline)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        ends = camera.project(pose, np.array([start, end]))
        count = int(np.linalg.norm(ends[1] - ends[0]) / _STEP)
        share = np.linspace(_CORNER, 1 - _CORNER, max(count, 2))[:, None]
        places.append(start + share * (end - start))
        ahead.append(places[-1] + 1e-3 * (end - start))
    where = np.concatenate(places)
    pixels = camera.project(pose, where)
    along = camera.project(pose, np.concatenate(ahead)) - pixels
    normals = np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1, keepdims=True)
    found, sigma, clear = find_edges(level, usable, pixels, normals, within, origin)
    clear &= np.abs(np.einsum("ij,ij->i", found - pixels, normals)) < within - _TAIL
    if print_ is not None:
        rays = camera.world_rays(pose, pixels)
        behind = pose.center - (pose.center[2] / rays[:, 2])[:, None] * rays
        _, apart = print_.at(behind[:, :2])
        _, scale = project_with_scale(camera, pose, behind)
        beside = ~print_.on_print(behind[:, :2])
        clear &= beside | (apart * scale > within + _PRINT)
    if clear.sum() < _FEW:
        return None
    return Edges(where[clear], found[clear], normals[clear], sigma[clear])


def place_plane(camera: Camera, poses: list[Pose], edges: list[Edges], plane: Plane) -> PlaneMove | None:
    """Where the sample lies, from its edges in several photos and what the manifest leads one to expect."""
    if not edges or sum(len(e) for e in edges) < _LEAST:
        return None
    size = float(np.ptp(np.asarray(plane.outline, float), axis=0).max()) / 2
    # all edges may seem farther out, or in, by some part of a pixel
    expected = np.append(PlaneMove(np.zeros(8), np.zeros(8), size).expected, _BIAS)

    def residual(values: np.ndarray) -> np.ndarray:
        parts = [values / expected]
        for pose, edge in zip(poses, edges, strict=True):
            off = camera.project(pose, moved_points(edge.places, plane, values[:8])) - edge.pixels
            z = (np.einsum("ij,ij->i", off, edge.normals) + values[8]) / edge.sigma
            parts.append(np.sign(z) * _SOFT * np.sqrt(np.log1p((z / _SOFT) ** 2)))  # Cauchy's loss, rooted
        return np.concatenate(parts)

    found = least_squares(residual, np.zeros(9), x_scale=expected)
    median = float(np.median(np.square(found.fun[9:])))
    spread = max(1.0, median / 0.455)  # the median of a normal's squares
    errors = np.sqrt(spread * np.diag(np.linalg.inv(found.jac.T @ found.jac)))
    return PlaneMove(found.x[:8], errors[:8], size)


def lying(camera: Camera, seen: list[tuple[Pose, Edges]], plane: Plane, still: bool) -> PlaneMove | None:
    """The same from each photo's pose and edges; a still camera's photos repeat one another's errors."""
    alike = np.sqrt(len(seen)) if still else 1.0
    edges = [Edges(e.places, e.pixels, e.normals, alike * e.sigma) for _, e in seen]
    return place_plane(camera, [pose for pose, _ in seen], edges, plane)
