"""Where a set's sample is, as its manifest says, and how much of it a photo clips."""

from __future__ import annotations

import cv2
import numpy as np

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.cones import outline
from photogonio.calib.identify.quick_look import QuickLook
from photogonio.capture.photoset import PhotoSet, Sphere
from photogonio.reconstruct.design.spots import Piece


def middle_of(scene: PhotoSet) -> np.ndarray:
    """(3,) the sample's middle."""
    sample = scene.sample
    if isinstance(sample, Sphere):
        return np.asarray(sample.center, float)
    return np.append(np.asarray(sample.outline, float).mean(axis=0), sample.height)


def piece_of(scene: PhotoSet) -> Piece:
    """What the sample is to a plan of photos."""
    sample = scene.sample
    if isinstance(sample, Sphere):
        return Piece(True, (sample.radius, sample.radius))
    half = 0.5 * np.ptp(np.asarray(sample.outline, float), axis=0)
    return Piece(False, (float(half[0]), float(half[1])))


def sample_limb(scene: PhotoSet, camera: Camera, pose: Pose) -> np.ndarray:
    """(n, 2) the sample's outline in a photo, pixels."""
    sample = scene.sample
    if isinstance(sample, Sphere):
        return outline(camera, pose, np.asarray(sample.center, float), sample.radius)
    flat = np.asarray(sample.outline, float)
    return camera.project(pose, np.column_stack([flat, np.full(len(flat), sample.height)]))


def clipped_share(scene: PhotoSet, camera: Camera, pose: Pose, seen: QuickLook) -> float | None:
    """Of the sample's pixels the share that is saturated; None if it is not in the picture."""
    limb = sample_limb(scene, camera, pose)
    if not np.isfinite(limb).all():
        return None
    mask = np.zeros(seen.full.shape, np.uint8)
    cv2.fillPoly(mask, [np.round((limb + 0.5) / seen.step - 0.5).astype(np.int32).reshape(-1, 1, 2)], 1)
    inside = mask > 0
    return float(seen.full[inside].mean()) if inside.any() else None
