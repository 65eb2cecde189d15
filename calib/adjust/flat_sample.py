"""Where a flat sample lies, from the edges of its outline in several photos."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from photogonio.calib.detect.edges import Edges, on_plane
from photogonio.calib.detect.observation import FIXED_POSE, Observation
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.capture import robust
from photogonio.capture.photoset import PhotoSet, Plane

_LEAST = 40  # points of all photos from which a place is told
_MISPLACED = 0.02  # of the sample's size: how far off the manifest may put it, sideways and in height
_GROWN = 0.02  # how much larger or smaller it may make it, either way
_TURNED = 0.02  # radians, about the normal and off the level
_BIAS = 0.3  # pixels
_SOFT = 2.0  # standard errors beyond which an edge point counts less
_SURE = 5.0  # standard errors at which a move is believed
_MOST = 4.0  # expected errors of the manifest beyond which it is not


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
        moved = moved_points(on_plane(plane, plane.outline), plane, values)
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
            parts.append(robust.rooted_cauchy(z, _SOFT))
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


def flat_move(photoset: PhotoSet, camera: Camera, observations: Sequence[Observation]) -> PlaneMove | None:
    """How a flat sample lies, as the photos show it; None for a ball, or where too little shows."""
    if not isinstance(photoset.sample, Plane):
        return None
    seen = [(s.pose, s.edges) for s in observations if s.edges is not None]
    still = all(s.pose_block == FIXED_POSE for s in observations)
    return lying(camera, seen, photoset.sample, still)
