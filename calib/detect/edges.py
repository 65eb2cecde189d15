"""Where a flat sample is: by the edges of its outline in the photos, one place and tilt for all of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.calib.detect.gray import GrayPart
from photogonio.calib.detect.limb import find_edges
from photogonio.calib.geometry.camera import Camera, Pose, project_with_scale
from photogonio.calib.geometry.print_map import Print
from photogonio.capture.photoset import Plane

_STEP = 6.0  # pixels between places along an edge
_CORNER = 0.08  # of an edge at either end, where the other edge is near
_PRINT = 2.5  # pixels between what is looked for and the next edge of the print
_FEW = 8  # of one photo
_TAIL = 0.5  # pixels: what is found so close to the end of the search is the flank of an edge beyond


@dataclass(frozen=True, slots=True)
class Edges:
    """Points of a flat sample's outline in one photo."""

    places: np.ndarray  # (n, 3) world, on the manifest's outline, where each point should be
    pixels: np.ndarray  # (n, 2) where it was found, to be compared across the edge alone
    normals: np.ndarray  # (n, 2) unit, across the edge in the picture
    sigma: np.ndarray  # (n,) pixels

    def __len__(self) -> int:
        return len(self.places)


def on_plane(plane: Plane, flat: np.ndarray) -> np.ndarray:
    flat = np.asarray(flat, float)
    return np.column_stack([flat, np.full(len(flat), plane.height)])


def plane_edges(
    part: GrayPart, camera: Camera, pose: Pose, plane: Plane, within: float, print_: Print | None = None
) -> Edges | None:
    """The edges of the outline in one photo, at most ``within`` pixels off; None if too few are clear.

    Edges of the board's ``print_`` are stronger than a sample's: where one may come within reach nothing is looked for.
    """
    places, ahead = [], []
    corners = on_plane(plane, plane.outline)
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
    found, sigma, clear = find_edges(part, pixels, normals, within)
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
