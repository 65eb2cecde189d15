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
_PAPER_ERROR = 0.003  # relative, of the paper's level in one view, at least
_DISAGREE = 5.0  # spreads by which a patch may differ from the paper
_LEAST_DISAGREE = 0.03
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
    """Strength of every view's lamp: from its white patch, else from the board's paper, tied to the patch by the views
    whose patch is good, else as the manifest states it.

    A patch that disagrees with the paper is not believed. With a patch in the set, a view that nothing ties to the
    scale is left out.
    """
    seen, patches, channels = [], [], 1
    for sight, light in usable:
        image = reader(sight.view)
        if image is None:
            continue
        seen.append((sight, light))
        patches.append(_patch_strength(photoset, settled, sight, light, image))
        channels = image.value.shape[2]
    papers = [_paper_level(settled, sight) for sight, _ in seen]
    tie = _tie(patches, papers)
    views = []
    for (sight, light), patch, paper in zip(seen, patches, papers, strict=True):
        found = _believed(patch, paper, tie)
        if found is None and any(p is not None for p in patches):
            notes.leave_out(
                sight.view.name, "neither the white patch nor the board's paper gives its lamp's strength"
            )
            continue
        strength, error, source = found or _given(settled.lamps[sight.light], channels)
        views.append(ViewSetup(sight.view.name, light, sight.pose, strength, error, source, sight.pose_rms))
    return views


@dataclass(frozen=True, slots=True)
class _Tie:
    """Strength over paper level, common to all views."""

    ratio: np.ndarray  # (c,)
    spread: float  # relative, of single views about it
    error: float  # relative, of the ratio


def _patch_strength(photoset, settled, sight, light, image) -> PatchReading | None:
    readings = [read_patch(image, settled.camera, sight.pose, light, p) for p in photoset.white_patches]
    return next((r for r in readings if r.strength is not None), None)


def _paper_level(settled, sight) -> float | None:
    """What the shading of the print says of strength times white paper's reflectance, in gray, up to a constant."""
    fit = settled.shading.get(sight.view.name)
    return None if fit is None else float(np.exp(fit.local[3]))


def _tie(patches: list[PatchReading | None], papers: list[float | None]) -> _Tie | None:
    pairs = [(p.strength, w) for p, w in zip(patches, papers, strict=True) if p is not None and w is not None]
    if not pairs:
        return None
    ratios = np.array([strength / level for strength, level in pairs])
    ratio = np.median(ratios, axis=0)
    off = np.abs(ratios / ratio - 1.0).max(axis=1)
    spread = max(1.4826 * float(np.median(off)), _PAPER_ERROR)
    return _Tie(ratio, spread, spread / np.sqrt(len(pairs)))


def _believed(patch, paper, tie) -> tuple[np.ndarray, np.ndarray, str] | None:
    by_paper = None if tie is None or paper is None else tie.ratio * paper
    if patch is not None:
        off = 0.0 if by_paper is None else float(np.abs(patch.strength / by_paper - 1.0).max())
        if by_paper is None or off <= max(_DISAGREE * tie.spread, _LEAST_DISAGREE):
            return patch.strength, patch.error, "white patch"
    if by_paper is None:
        return None
    return by_paper, np.hypot(tie.spread, tie.error) * by_paper, "board"


def _given(lamp, channels: int) -> tuple[np.ndarray, np.ndarray, str]:
    """As the manifest states it, or equal for all lamps: a scale that is relative."""
    given = np.asarray(lamp.entry.intensity if lamp.entry is not None else (1.0,), float)
    strength = np.broadcast_to(given, (channels,)).copy()
    return strength, 0.1 * strength, "intensity"
