"""Where the sample is: a ball by its limb in the photos."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import least_squares

from photogonio.calib.detect.gray import GrayPart
from photogonio.calib.geometry.camera import Camera, Pose, focal
from photogonio.calib.geometry.cones import cone_residual, outline
from photogonio.capture import robust

LIMB_POINTS = 72  # places along the limb
_STEP = 0.25  # pixels between samples across it
_SOFT = 0.7  # pixels, the scale of the edge filter
_NEAR = 1.5  # pixels within which the limb is looked for once it is roughly known
BLURRED = 4.5  # likewise, where the edge itself is some pixels wide
_FEWEST = 18  # limb points, a quarter of all
_CLEAR = 0.35  # pixels: typical distance from the circle beyond which a limb is not believed
_MISPLACED = 0.03  # of the radius: how far off the manifest may place the ball
_TRUSTED_RADIUS = 0.004  # of the radius
_SOFTENED = 3.0  # standard errors beyond which a limb's point counts less
_TRUSTED_EDGE = 0.5  # pixels: aliasing and the ball's own shading move all edges of a stretch alike


@dataclass(frozen=True, slots=True)
class Limb:
    """Points of a ball's limb in one photo."""

    pixels: np.ndarray  # (n, 2)
    sigma: np.ndarray  # (n,) pixels, across the limb

    def __len__(self) -> int:
        return len(self.pixels)


def find_limb(
    part: GrayPart, camera: Camera, pose: Pose, center: np.ndarray, radius: float, within: float
) -> Limb:
    """Edges across the expected limb, at most ``within`` pixels off it.

    Where several edges lie in reach the strongest counts, if it stands well above what the ball's own shading does.
    """
    limb = outline(camera, pose, center, radius, LIMB_POINTS)
    outer = outline(camera, pose, center, radius * 1.02, LIMB_POINTS)
    normal = outer - limb
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    edge, sigma, clear = find_edges(part, limb, normal, within)
    return Limb(edge[clear], sigma[clear])


def find_edges(
    part: GrayPart, places: np.ndarray, normals: np.ndarray, within: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The strongest edge across each of ``places`` (n, 2) along its unit ``normals``, at most ``within`` pixels off.

    Pixels (n, 2), their standard errors (n,) across the edge, and which of them are clear (n,) bool.
    """
    reach = within + 4 * _SOFT
    along = np.arange(-reach, reach + _STEP / 2, _STEP)
    place = (places[:, None] - part.origin + along[:, None] * normals[:, None]).astype(np.float32)
    profile = cv2.remap(
        part.level, place[..., 0], place[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    bad = cv2.remap(
        (~part.usable).astype(np.float32), place[..., 0], place[..., 1], cv2.INTER_LINEAR, borderValue=1.0
    )
    slope = gaussian_filter1d(profile.astype(float), _SOFT / _STEP, axis=1, order=1)
    strength = np.abs(slope)
    strength[:, np.abs(along) > within] = 0.0
    best = np.argmax(strength, axis=1)
    rows = np.arange(len(places))
    inner = (best > 0) & (best < len(along) - 1)
    left, peak, right = (strength[rows, np.clip(best + k, 0, len(along) - 1)] for k in (-1, 0, 1))
    bend = np.where(left - 2 * peak + right < 0, left - 2 * peak + right, -1.0)
    offset = along[best] + _STEP * np.clip(0.5 * (left - right) / bend, -0.5, 0.5)
    rest = np.median(np.abs(slope), axis=1) + 1e-30
    contrast = peak / (profile.max(1) - profile.min(1) + 1e-30)
    clear = inner & (peak > 5 * rest) & (contrast > 0.02) & (bad.max(1) == 0)
    clear &= peak > 0.02 * np.percentile(peak, 90)
    edge = places + offset[:, None] * normals
    return edge, _TRUSTED_EDGE + 0.3 * rest / np.maximum(peak, 1e-30), clear


def place_ball(
    camera: Camera, poses: list[Pose], limbs: list[Limb], center: np.ndarray, radius: float
) -> tuple[np.ndarray, float]:
    """Centre (3,) and radius of a ball from its limbs and the manifest's values."""
    start = np.append(np.asarray(center, float), radius)
    prior = np.append(np.full(3, _MISPLACED * radius), _TRUSTED_RADIUS * radius)
    rays = [camera.rays(limb.pixels) for limb in limbs]

    def residual(values: np.ndarray) -> np.ndarray:
        parts = [
            cone_residual(r, pose.apply(values[:3]), values[3], focal(camera)) / limb.sigma
            for r, pose, limb in zip(rays, poses, limbs, strict=True)
        ]
        # a robust loss on the limbs, none on the prior, which is written as the square root of its loss
        return np.concatenate(
            [*[robust.rooted_cauchy(p, _SOFTENED) for p in parts], (values - start) / prior]
        )

    found = least_squares(residual, start, x_scale=prior).x
    return found[:3], float(found[3])


def settled_limb(
    part: GrayPart,
    camera: Camera,
    pose: Pose,
    center: np.ndarray,
    radius: float,
    within: float,
    closest: float = _NEAR,
) -> Limb | None:
    """The limb found in wide reach, then again close to the circle it tells; None if it is not clear.

    Edges of the background and of the ball's own shadow line lie off the circle, and fall away in the second look.
    ``closest``: pixels, the last reach; it must hold more than the edge, which else does not stand out in it.
    """
    limb = find_limb(part, camera, pose, center, radius, within)
    for reach in (3 * _NEAR, closest):
        if len(limb) < _FEWEST:
            return None
        near, size = place_ball(camera, [pose], [limb], center, radius)
        limb = find_limb(part, camera, pose, near, size, reach)
    if len(limb) < _FEWEST:
        return None
    near, size = place_ball(camera, [pose], [limb], center, radius)
    off = cone_residual(camera.rays(limb.pixels), pose.apply(near), size, focal(camera))
    return limb if np.median(np.abs(off)) < _CLEAR else None
