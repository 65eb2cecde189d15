"""Where the camera stood: the board's pose in a photo, by its corners."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from photogonio.calib.geometry.board import FEWEST_CORNERS, Corners
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.capture import robust

_OUTLIER_SIGMA = 4.0
_OUTLIER_PIXELS = 0.75  # corners nearer than this are kept however good the others are


@dataclass(frozen=True, slots=True)
class PoseFit:
    """One pose, the corners that support it, and how sure it is."""

    pose: Pose
    inlier: np.ndarray  # (n,) bool, of the corners given
    rms: float  # pixels, of the inliers
    covariance: np.ndarray  # (6, 6) of rotation vector (left, camera frame) and translation


def fit_pose(camera: Camera, corners: Corners) -> PoseFit | None:
    """The board's pose; None if too few corners agree. A planar board's flip is settled by the residual."""
    if len(corners) < FEWEST_CORNERS:
        return None
    inlier = np.ones(len(corners), bool)
    for _ in range(4):
        tried = _solve(camera, corners.points[inlier], corners.pixels[inlier])
        if tried is None:
            return None
        pose = tried
        miss = np.linalg.norm(camera.project(pose, corners.points) - corners.pixels, axis=1)
        spread = float(robust.deviation(miss[inlier]))
        kept = miss < max(_OUTLIER_SIGMA * spread, _OUTLIER_PIXELS)
        if kept.sum() < FEWEST_CORNERS:
            return None
        if np.array_equal(kept, inlier):
            break
        inlier = kept
    rms = float(np.sqrt(np.mean(miss[inlier] ** 2)))
    return PoseFit(pose, inlier, rms, pose_covariance(camera, pose, corners.points[inlier], rms / np.sqrt(2)))


def _solve(camera: Camera, points: np.ndarray, pixels: np.ndarray) -> Pose | None:
    """The best of the candidate poses that look at the front of the board."""
    flat = np.ptp(points[:, 2]) < 1e-9 * max(np.ptp(points[:, 0]), 1e-30)
    method = cv2.SOLVEPNP_IPPE if flat else cv2.SOLVEPNP_SQPNP
    points = np.ascontiguousarray(points).reshape(-1, 1, 3)
    pixels = np.ascontiguousarray(pixels).reshape(-1, 1, 2)
    count, turns, shifts, _ = cv2.solvePnPGeneric(
        points, pixels, camera.matrix, camera.distortion, flags=method
    )
    best, least = None, np.inf
    for turn, shift in zip(turns[:count], shifts[:count], strict=True):
        turn, shift = cv2.solvePnPRefineLM(points, pixels, camera.matrix, camera.distortion, turn, shift)
        pose = Pose.from_rodrigues(turn, shift)
        miss = camera.project(pose, points) - pixels.reshape(-1, 2)
        error = float(np.mean(miss**2))
        faces = not flat or pose.center[2] > 0
        if faces and np.isfinite(error) and error < least:
            best, least = pose, error
    return best


def pose_covariance(camera: Camera, pose: Pose, points: np.ndarray, sigma: float) -> np.ndarray:
    """(6, 6) covariance of (rotation vector, translation) from corners with error ``sigma`` pixels a coordinate."""
    _, jacobian = cv2.projectPoints(
        np.ascontiguousarray(points).reshape(-1, 1, 3),
        pose.rodrigues(),
        pose.translation,
        camera.matrix,
        camera.distortion if camera.distortion.size else None,
    )
    design = jacobian[:, :6]
    return np.linalg.pinv(design.T @ design) * max(sigma, 1e-6) ** 2


def joined(all_corners: list[Corners]) -> Corners:
    """The corners of one fixed board seen by one fixed camera in many photos: median place of each."""
    ids = np.concatenate([c.ids for c in all_corners])
    points = np.concatenate([c.points for c in all_corners])
    pixels = np.concatenate([c.pixels for c in all_corners])
    sigma = np.concatenate([c.sigma for c in all_corners])
    numbers = np.unique(ids)
    middle = np.array([np.median(pixels[ids == k], axis=0) for k in numbers]).reshape(-1, 2)
    place = np.array([points[ids == k][0] for k in numbers]).reshape(-1, 3)
    errors = np.array([np.median(sigma[ids == k]) for k in numbers])
    first = all_corners[0]
    return Corners(numbers, place, middle, errors, first.marker_ids, first.marker_pixels)
