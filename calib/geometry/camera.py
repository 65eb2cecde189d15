"""The camera's geometry: rigid poses, and the map between points, rays and pixels.

Frames: world = board frame (z out of the paper); the camera looks along its +z, x right, y down (OpenCV).
Pixels: (x, y), the centre of the top-left pixel is (0, 0).
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np


@dataclass(frozen=True, slots=True)
class Pose:
    """A rigid motion ``x_cam = rotation @ x_world + translation``; poses compose with ``@``."""

    rotation: np.ndarray  # (3, 3)
    translation: np.ndarray  # (3,)

    def __matmul__(self, other: Pose) -> Pose:
        return Pose(self.rotation @ other.rotation, self.rotation @ other.translation + self.translation)

    def inverse(self) -> Pose:
        return Pose(self.rotation.T, -self.rotation.T @ self.translation)

    def apply(self, points: np.ndarray) -> np.ndarray:
        """World points (..., 3) in the camera frame."""
        return points @ self.rotation.T + self.translation

    @property
    def center(self) -> np.ndarray:
        """The camera's centre in the world frame, (3,)."""
        return -self.rotation.T @ self.translation

    @classmethod
    def from_rodrigues(cls, rvec: np.ndarray, tvec: np.ndarray) -> Pose:
        rotation, _ = cv2.Rodrigues(np.asarray(rvec, float).reshape(3, 1))
        return cls(rotation, np.asarray(tvec, float).reshape(3))

    def rodrigues(self) -> np.ndarray:
        """Rotation vector (3,), radians; inverse of :meth:`from_rodrigues`."""
        return cv2.Rodrigues(self.rotation)[0].reshape(3)


@dataclass(frozen=True, slots=True)
class Camera:
    """A pinhole camera with OpenCV's distortion model."""

    matrix: np.ndarray  # (3, 3), pixels
    distortion: np.ndarray  # (k,), OpenCV's order; empty: none
    size: tuple[int, int]  # width, height

    def project(self, pose: Pose, points: np.ndarray) -> np.ndarray:
        """Pixels (n, 2) of world points (n, 3). Inverse (up to depth) of :meth:`rays`."""
        if len(points) == 0:
            return np.zeros((0, 2))  # of which OpenCV makes nothing
        points = np.ascontiguousarray(points, float).reshape(-1, 1, 3)
        pixels, _ = cv2.projectPoints(
            points, pose.rodrigues(), pose.translation, self.matrix, self.distortion
        )
        return pixels.reshape(-1, 2)

    def aside(self, pixels: np.ndarray) -> np.ndarray:
        """Squares (n,) of how far pixels (n, 2) lie from where the optical axis meets the picture; 1 in the corner that
        is farthest from there."""
        middle = self.matrix[:2, 2]
        corner = np.maximum(middle, np.array(self.size) - 1 - middle)
        return ((pixels - middle) ** 2).sum(1) / (corner @ corner)

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """Unit directions (n, 3) in the camera frame of pixels (n, 2). Inverse of :meth:`project`."""
        if len(pixels) == 0:
            return np.zeros((0, 3))
        pixels = np.ascontiguousarray(pixels, float).reshape(-1, 1, 2)
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)
        plane = cv2.undistortPoints(pixels, self.matrix, self.distortion, criteria=criteria).reshape(-1, 2)
        rays = np.column_stack([plane, np.ones(len(plane))])
        return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    def world_rays(self, pose: Pose, pixels: np.ndarray) -> np.ndarray:
        """Unit directions (n, 3) in the world frame of pixels (n, 2) seen from ``pose.center``."""
        return self.rays(pixels) @ pose.rotation


def focal(camera: Camera) -> float:
    """Geometric mean of both focal lengths, pixels."""
    return float(np.sqrt(camera.matrix[0, 0] * camera.matrix[1, 1]))


def project_with_scale(camera: Camera, pose: Pose, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pixels (n, 2) of board points and pixels per length in the most foreshortened direction (n,)."""
    pixels, right, up = projected_with_axes(camera, pose, points)
    total = (right**2).sum(1) + (up**2).sum(1)
    area = right[:, 0] * up[:, 1] - right[:, 1] * up[:, 0]
    least = total / 2 - np.sqrt(np.maximum(total**2 / 4 - area**2, 0.0))
    return pixels, np.sqrt(np.maximum(least, 0.0))


def projected_with_axes(
    camera: Camera, pose: Pose, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pixels (n, 2) of board points and how they move with the point along x and along y, pixels per length."""
    step = 1e-3 * float(np.ptp(points[:, :2], axis=0).max())
    pixels = camera.project(pose, points)
    right = (camera.project(pose, points + np.array([step, 0, 0])) - pixels) / step
    up = (camera.project(pose, points + np.array([0, step, 0])) - pixels) / step
    return pixels, right, up
