"""How strongly each view's lamp shines: from the white patch, with its own distance and angle to the light."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from calib.camera import Camera, Pose
from calib.setup import Light, ViewSetup
from capture.photoset import WhitePatch
from capture.radiance import RadianceImage

_EDGE = 0.12  # of the patch's size left out along its border
_FEWEST_PIXELS = 12
_CLIPPED = 0.1  # share of saturated pixels beyond which the patch is not believed
_UNEVEN = 0.03  # relative spread beyond noise: a shadow or a hidden half


@dataclass(frozen=True, slots=True)
class PatchReading:
    """The lamp's strength as one patch tells it, or why it does not."""

    strength: np.ndarray | None  # (c,)
    error: np.ndarray | None  # (c,)
    problem: str = ""


def read_patch(
    image: RadianceImage, camera: Camera, pose: Pose, light: Light, patch: WhitePatch
) -> PatchReading:
    """Strength from one patch's pixels: pi L / (rho cos falloff), the median over the patch."""
    polygon = np.asarray(patch.outline, float)
    middle = polygon.mean(0)
    inner = middle + (1 - _EDGE) * (polygon - middle)
    corners = np.column_stack([inner, np.full(len(inner), patch.height)])
    mask = np.zeros(image.valid.shape, np.uint8)
    limb = camera.project(pose, corners)
    if not np.isfinite(limb).all() or np.abs(limb).max() > 1e6:
        return PatchReading(None, None, "the patch is outside the picture")
    cv2.fillConvexPoly(mask, np.round(limb * 16).astype(np.int32).reshape(-1, 1, 2), 1, shift=4)
    inside = mask > 0
    if inside.sum() < _FEWEST_PIXELS:
        return PatchReading(None, None, "the patch is outside the picture or too small in it")
    if image.saturated[inside].mean() > _CLIPPED:
        return PatchReading(None, None, "the patch is clipped")
    chosen = inside & image.valid
    if chosen.sum() < max(_FEWEST_PIXELS, 0.5 * inside.sum()):
        return PatchReading(None, None, "too few pixels of the patch are usable")
    return _strength(image, camera, pose, light, patch, chosen)


def _strength(
    image: RadianceImage, camera: Camera, pose: Pose, light: Light, patch: WhitePatch, chosen: np.ndarray
) -> PatchReading:
    y, x = np.nonzero(chosen)
    rays = camera.world_rays(pose, np.column_stack([x, y]).astype(float))
    eye = pose.center
    points = eye + ((patch.height - eye[2]) / rays[:, 2])[:, None] * rays
    toward, falloff = light.toward(points)
    shape = toward[:, 2] * falloff
    if (shape <= 0).any():
        return PatchReading(None, None, "the patch faces away from the light")
    reflectance = np.broadcast_to(np.asarray(patch.reflectance, float), image.value.shape[2:])
    strength = np.pi * image.value[y, x].astype(float) / (reflectance * shape[:, None])
    middle = np.median(strength, axis=0)
    noise = np.pi * np.sqrt(image.variance[y, x].astype(float)) / (reflectance * shape[:, None])
    spread = 1.4826 * np.median(np.abs(strength - middle), axis=0)
    excess = np.sqrt(np.maximum(spread**2 - np.median(noise, axis=0) ** 2, 0.0)) / np.maximum(middle, 1e-300)
    if middle.min() <= 0:
        return PatchReading(None, None, "the patch is black")
    if excess.max() > _UNEVEN:
        return PatchReading(None, None, "the patch is unevenly lit: shadowed or partly hidden")
    error = 1.2533 * spread / np.sqrt(len(y)) + 0.003 * middle
    return PatchReading(middle, error)


def find_strengths(photoset, reader, settled, usable, notes) -> list[ViewSetup]:
    """Strength of every view's lamp."""
    views = []
    for sight, light in usable:
        image = reader(sight.view)
        if image is None:
            continue
        channels = image.value.shape[2]
        readings = [read_patch(image, settled.camera, sight.pose, light, p) for p in photoset.white_patches]
        good = [r for r in readings if r.strength is not None]
        if good:
            strength, error, source = good[0].strength, good[0].error, "white patch"
        else:
            lamp = settled.lamps[sight.light]
            given = np.asarray(lamp.entry.intensity if lamp.entry is not None else (1.0,), float)
            strength = np.broadcast_to(given, (channels,)).copy()
            error, source = 0.1 * strength, "intensity"
        views.append(ViewSetup(sight.view.name, light, sight.pose, strength, error, source, sight.pose_rms))
    return views
