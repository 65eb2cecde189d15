"""Camera and poses as blocks of values that are adjusted, and what is expected of a camera."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from photogonio.calib.adjust.bundle import Derivatives, Term, Values
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.rig.gaussian import RigExpected


@dataclass(frozen=True, slots=True)
class CameraModel:
    """What a camera block means: which distortion terms it holds, the picture's size, and what is expected."""

    size: tuple[int, int]
    distortion: np.ndarray  # the whole vector, OpenCV's order
    free: tuple[int, ...]  # indices in it that the block holds after fx, fy, cx, cy
    aspect: float = 0.0  # standard error of fy / fx about 1; 0: nothing is expected of it
    centre: float = 0.0  # pixels, of the principal point about the picture's middle; 0: the same
    held: tuple[
        tuple[int, float], ...
    ] = ()  # free terms that are expected about 0, with their standard errors
    expected: RigExpected | None = None  # the whole block, as other sets of the rig have it

    def camera(self, block: np.ndarray) -> Camera:
        matrix = np.array([[block[0], 0, block[2]], [0, block[1], block[3]], [0, 0, 1.0]])
        distortion = self.distortion.copy()
        distortion[list(self.free)] = block[4:]
        return Camera(matrix, distortion, self.size)

    def block(self, camera: Camera) -> np.ndarray:
        """Inverse of :meth:`camera`."""
        m = camera.matrix
        return np.concatenate([[m[0, 0], m[1, 1], m[0, 2], m[1, 2]], camera.distortion[list(self.free)]])


def camera_term(model: CameraModel) -> Term:
    """What is expected of the terms that the photos do not ask for.

    They are not fixed: what is not known of them counts in the errors of all others.
    """
    middle = (np.array(model.size, float) - 1) / 2

    def term(values: Values) -> tuple[np.ndarray, Derivatives]:
        block = values["camera"]
        if model.expected is not None:
            root = model.expected.root
            return root @ (block - model.expected.value), {"camera": root}
        rows: list[tuple[float, dict[int, float]]] = []
        if model.aspect:
            ratio, unit = block[1] / block[0], model.aspect * block[0]
            rows.append(((ratio - 1) / model.aspect, {0: -ratio / unit, 1: 1 / unit}))
        if model.centre:
            rows += [((block[2 + k] - middle[k]) / model.centre, {2 + k: 1 / model.centre}) for k in (0, 1)]
        for index, sigma in model.held:
            place = 4 + model.free.index(index)
            rows.append((block[place] / sigma, {place: 1 / sigma}))
        design = np.zeros((len(rows), len(block)))
        for k, (_, entries) in enumerate(rows):
            for place, value in entries.items():
                design[k, place] = value
        return np.array([value for value, _ in rows]), {"camera": design}

    return term


def pose_block(pose: Pose) -> np.ndarray:
    """Rotation vector and translation, (6,); inverse of :func:`block_pose`."""
    return np.concatenate([pose.rodrigues(), pose.translation])


def block_pose(block: np.ndarray) -> Pose:
    return Pose.from_rodrigues(block[:3], block[3:])


def project(
    model: CameraModel, camera: np.ndarray, pose: np.ndarray, points: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Pixels (n, 2) and derivatives by pose (n, 2, 6), camera (n, 2, k) and point (n, 2, 3)."""
    made = model.camera(camera)
    flat = np.ascontiguousarray(points, float).reshape(-1, 1, 3)
    pixels, jacobian = cv2.projectPoints(flat, pose[:3], pose[3:], made.matrix, made.distortion)
    jacobian = jacobian.reshape(len(points), 2, -1)
    by_shift = jacobian[:, :, 3:6]
    rotation = cv2.Rodrigues(pose[:3])[0]
    columns = [6, 7, 8, 9, *(10 + k for k in model.free)]
    return pixels.reshape(-1, 2), jacobian[:, :, :6], jacobian[:, :, columns], by_shift @ rotation
