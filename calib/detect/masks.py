"""What stands before the board in a photo: filled outlines of balls, sheets and patches."""

from __future__ import annotations

import cv2
import numpy as np

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.cones import outline
from photogonio.capture.photoset import PhotoSet, Sphere

_SHIFT = 4  # fractional bits of OpenCV's polygon corners


def fill(mask: np.ndarray, polygon: np.ndarray) -> None:
    """Set the pixels of a polygon (n, 2) in ``mask`` (h, w) uint8; one that is not finite is passed over."""
    if np.isfinite(polygon).all() and np.abs(polygon).max() < 1e6:
        corners = np.round(polygon * 2**_SHIFT).astype(np.int32).reshape(-1, 1, 2)
        cv2.fillPoly(mask, [corners], 1, shift=_SHIFT)


def things_mask(
    photoset: PhotoSet, camera: Camera, pose: Pose, shape: tuple[int, int], grow: int, *, loose: float = 0.03
) -> np.ndarray:
    """Pixels (h, w) bool on or near a ball, the sample or a patch, by ``loose`` of their size and ``grow`` pixels."""
    mask = np.zeros(shape, np.uint8)
    spheres = [(b.center, b.radius) for b in photoset.mirror_balls]
    sheets = [(p.outline, p.height) for p in photoset.white_patches]
    if isinstance(photoset.sample, Sphere):
        spheres.append((photoset.sample.center, photoset.sample.radius))
    else:
        sheets.append((photoset.sample.outline, photoset.sample.height))
    for center, radius in spheres:
        fill(mask, outline(camera, pose, np.asarray(center, float), radius * (1 + loose)))
    for flat, height in sheets:
        flat = np.asarray(flat, float)
        wide = flat.mean(0) + (1 + loose) * (flat - flat.mean(0))
        fill(mask, camera.project(pose, np.column_stack([wide, np.full(len(wide), height)])))
    x, y, width, height = cv2.boundingRect(mask)
    if width and height:
        part = np.s_[max(y - grow, 0) : y + height + grow, max(x - grow, 0) : x + width + grow]
        mask[part] = cv2.dilate(mask[part], np.ones((2 * grow + 1, 2 * grow + 1), np.uint8))
    return mask.view(bool)
