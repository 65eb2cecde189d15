"""A lamp's place by printed markers that are fixed to it and seen in the photo."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from photogonio.calib.geometry.board import Corners
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.capture.errors import InputError
from photogonio.capture.photoset import MANIFEST, LightEntry

_CORNER_SIGMA = 0.2  # pixels


@dataclass(frozen=True, slots=True)
class MarkedPlace:
    """Where a lamp is by its markers."""

    place: np.ndarray  # (3,) world
    sigma: float  # standard error, length units (the worst direction's)


def marked_place(
    camera: Camera, pose: Pose, corners: Corners | None, entry: LightEntry, board_length: float | None
) -> MarkedPlace | None:
    """The lamp's place from the markers of ``entry`` seen in one photo; None if too few are.

    ``entry.markers`` may hold ``corners``, the four corners of each marker in a frame whose origin is the lamp,
    clockwise from the top left in the order of the ids: one marker is then enough. Otherwise ``length`` is the
    side of each marker (the board's if absent) and the lamp is in the middle of all of them, which must all be
    seen.
    """
    if corners is None:
        return None
    seen = {int(k): quad for k, quad in zip(corners.marker_ids, corners.marker_pixels, strict=True)}
    quads = [seen.get(k) for k in entry.marker_ids]
    if entry.markers.get("corners") is not None:
        return _by_frame(camera, pose, quads, entry)
    length = entry.markers.get("length", board_length)
    if not isinstance(length, int | float) or not length > 0:
        where = f'{MANIFEST}: light "{entry.id}" markers'
        raise InputError(where, "expected length (the markers' side) or corners (in the lamp's frame)")
    return _by_middle(camera, pose, quads, float(length))


def _by_frame(
    camera: Camera, pose: Pose, quads: list[np.ndarray | None], entry: LightEntry
) -> MarkedPlace | None:
    try:
        frame = np.asarray(entry.markers["corners"], float).reshape(len(entry.marker_ids), 4, 3)
    except ValueError as error:
        where = f'{MANIFEST}: light "{entry.id}" markers.corners'
        raise InputError(where, "expected four corners of three numbers for each id") from error
    points = [frame[k] for k, quad in enumerate(quads) if quad is not None]
    pixels = [quad for quad in quads if quad is not None]
    if not pixels:
        return None
    return _solve(camera, pose, np.concatenate(points), np.concatenate(pixels), np.zeros(3))


def _by_middle(
    camera: Camera, pose: Pose, quads: list[np.ndarray | None], length: float
) -> MarkedPlace | None:
    half = length / 2
    square = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
    found = []
    for quad in quads:
        if quad is None:
            return None
        one = _solve(camera, pose, square, quad, np.zeros(3))
        if one is None:
            return None
        found.append(one)
    place = np.mean([f.place for f in found], axis=0)
    return MarkedPlace(place, float(np.sqrt(np.sum([f.sigma**2 for f in found])) / len(found)))


def _solve(
    camera: Camera, pose: Pose, points: np.ndarray, pixels: np.ndarray, origin: np.ndarray
) -> MarkedPlace | None:
    """The place of ``origin`` of the markers' own frame in the world."""
    points = np.ascontiguousarray(points, float).reshape(-1, 1, 3)
    pixels = np.ascontiguousarray(pixels, float).reshape(-1, 1, 2)
    flat = len(points) == 4 and np.ptp(points[:, 0, 2]) == 0
    method = cv2.SOLVEPNP_IPPE_SQUARE if flat else cv2.SOLVEPNP_SQPNP
    found, turn, shift = cv2.solvePnP(points, pixels, camera.matrix, camera.distortion, flags=method)
    if not found:
        return None
    _, jacobian = cv2.projectPoints(points, turn, shift, camera.matrix, camera.distortion)
    covariance = np.linalg.pinv(jacobian[:, :6].T @ jacobian[:, :6])[3:, 3:] * _CORNER_SIGMA**2
    place = pose.inverse().apply(Pose.from_rodrigues(turn, shift).apply(origin))
    return MarkedPlace(place, float(np.sqrt(np.linalg.eigvalsh(covariance)[-1])))
