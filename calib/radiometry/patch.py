"""Reading a lamp's strength off a diffuse surface: the white patch, or the board's own paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import cv2
import numpy as np

from photogonio.calib.detect.masks import fill
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.visibility import behind_ball, direct, lit_fraction, log_cosine
from photogonio.calib.setup import Light
from photogonio.calib.shading.interreflection import bounce_on_patch
from photogonio.calib.shading.model import ShadingScene
from photogonio.capture import robust
from photogonio.capture.photoset import WhitePatch
from photogonio.capture.radiance import RadianceImage

UNEVEN = "the patch is unevenly lit: shadowed, partly hidden, or in something's reflection"
_CLEAR = 2  # pixels between the patch's edge and what is read
_AROUND = 24  # pixels around the patches that are read too: spots and spills show in their neighbours
_MANY_PIXELS = 16_000  # of a patch, of which no more than four times as many are read
_FEWEST_PIXELS = 12
_CLIPPED = 0.03  # share of saturated pixels beyond which the patch is not believed
_UNEVEN = 0.04  # relative spread beyond noise: a shadow or a hidden part that the geometry does not know
_STEP = 0.05  # of the logarithm between lit and shadowed parts of a patch
_APART = 4.5  # the same in scatters within the parts; an even ramp has 3.5, a bell 2.7
_SHADOW = 0.7  # the same between light and a shadow, at the least: that takes half of the light and more
_LEAST_PART = 0.03  # share of the pixels that makes a part; fewer are blemishes
_EDGE = 3  # pixels beside a shadow that are not read
_PARTLY = 0.004  # relative error of what is read beside a shadow
_SEEN = 0.999  # share of the lamp that a place must see to be read
_FEW_PLACES = 100
LEAST_TILT = 0.1  # what a tilt leaves of the light at the least
_LITTLE_BOUNCE = 0.02  # over the direct light: paper with more of it is not read if enough is left


@dataclass(frozen=True, slots=True)
class Strength:
    """A lamp's strength times the surface's reflectance over pi."""

    value: np.ndarray  # (c,)
    error: np.ndarray  # (c,) of the reading itself, not of the lamp's place
    pull: (
        np.ndarray
    )  # (3,) derivative of log 1/r^2 (sample left aside) by the lamp's place, over what was read
    problem: str = ""


@dataclass(frozen=True, slots=True)
class NoStrength:
    """Why it could not be read."""

    value: ClassVar[None] = None
    problem: str
    rough: Strength | None = None  # what there is in spite of the problem, better than nothing


@dataclass(frozen=True, slots=True)
class Stray:
    """Light beside the direct one, by the shading fit: amounts of diffuse and glossy bounce and of even light."""

    scene: ShadingScene
    amounts: np.ndarray  # (3,) diffuse, glossy, even, or (3, c)
    even: float  # unit of the even light
    tilt: tuple[float, float, float] = (1.0, 0.0, 0.0)  # of the direct light: constant, by x and by y


def light_shape(points: np.ndarray, light: Light, stray: Stray | None) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance on a level surface for unit strength, bounce and all, (n, c) or (n, 1) where all channels have the
    same, and the share of the lamp seen (n,).
    """
    toward, falloff = light.toward(points)
    shape = (np.clip(toward[:, 2], 0, None) * falloff)[:, None]
    if stray is None or light.kind != "point":
        return shape, np.ones(len(points))
    scene, amounts = stray.scene, stray.amounts.reshape(3, -1)
    balls = scene.polished + (() if scene.sample is None else (scene.sample,))
    table = np.array([[*b.center, b.radius] for b in balls], float).reshape(-1, 4)
    share = lit_fraction(points, light.place, scene.lamp_radius, table, scene.blur)
    shape *= np.exp(scene.narrow * log_cosine(points, light.place, np.array(scene.aim)))[:, None]
    shape *= np.clip(stray.tilt[0] + points[:, :2] @ stray.tilt[1:], LEAST_TILT, None)[:, None]
    extra = amounts[2:] * stray.even
    if scene.sample is not None:
        ball = scene.sample
        extra = extra + bounce_on_patch(points, light.place, ball.center, ball.radius) @ amounts[:2]
    return shape * share[:, None] + extra, share


def read_patch(
    image: RadianceImage, camera: Camera, pose: Pose, light: Light, patch: WhitePatch, stray: Stray | None
) -> Strength | NoStrength:
    """Strength times rho / pi from one patch's pixels, each with its own distance and angle to the lamp."""
    inside = _patch_mask(image, camera, pose, patch)
    if inside is None or inside.sum() < _FEWEST_PIXELS:
        return NoStrength("the patch is outside the picture or too small in it")
    if image.saturated[inside].mean() > _CLIPPED:
        return NoStrength("the patch is clipped")
    y, x, step = _thinned(inside & image.valid)
    total = inside.sum() / step**2
    if len(y) < _FEWEST_PIXELS:
        return NoStrength("too few pixels of the patch are valid")
    rays = camera.world_rays(pose, np.column_stack([x, y]).astype(float) + image.origin)
    eye = pose.center
    points = eye + ((patch.height - eye[2]) / rays[:, 2])[:, None] * rays
    shape, share = light_shape(points, light, stray)
    good = (shape > 0).all(1) & (share > _SEEN) & ~_hidden(points, eye, stray)
    if good.sum() < max(_FEWEST_PIXELS, 0.1 * total):
        return NoStrength("the patch lies in shadow, is hidden, or has too few usable pixels")
    whole = int(good.sum())
    good[good] = _lit_part(
        image.value[y, x][good].astype(float) / shape[good], y[good] // step, x[good] // step
    )
    if good.sum() < max(_FEWEST_PIXELS, _LEAST_PART * total):
        return NoStrength(UNEVEN)
    level = image.value[y, x][good].astype(float) / shape[good]
    noise = np.sqrt(image.variance[y, x][good].astype(float)) / shape[good]
    middle = np.median(level, axis=0)
    spread = robust.deviation(level - middle, axis=0)
    if middle.min() <= 0:
        return NoStrength("the patch is black")
    excess = np.sqrt(np.maximum(spread**2 - np.median(noise, axis=0) ** 2, 0.0)) / middle
    pull = _pull(points[good], light)
    if excess.max() > _UNEVEN:
        return NoStrength(UNEVEN, Strength(middle, excess * middle, pull))
    error = robust.median_error(spread, good.sum()) + (0.002 + _PARTLY * (good.sum() < whole)) * middle
    return Strength(middle, error, pull)


def _thinned(mask: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Rows and columns (n,) of a mask's pixels, of many of them those at whole steps alone, and the step."""
    y, x = np.nonzero(mask)
    step = max(1, int(np.sqrt(len(y) / _MANY_PIXELS)))
    kept = (y % step == 0) & (x % step == 0)
    return y[kept], x[kept], step


def _lit_part(level: np.ndarray, y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Which pixels (n,) bool of a patch are clear of hard shadows and of what hides it.

    Either is darker than the white: where ``level`` (n, c), the radiance over the light expected, falls into two
    parts the darker one is dropped, with what lies beside it; as often as there are two. Bright specks that this would
    leave next to nothing of, and that are not as much brighter as light is than shadow, are what polished things throw.
    """
    tone = np.log(np.maximum(level / np.maximum(np.median(level, axis=0), 1e-300), 1e-3)).mean(1)
    lit = np.ones(len(tone), bool)
    for _ in range(3):
        bound = _parting(tone[lit])
        if bound is None:
            return lit
        dark = np.zeros((int(np.ptp(y)) + 1, int(np.ptp(x)) + 1), np.uint8)
        dark[y - y.min(), x - x.min()] = tone < bound
        near = cv2.dilate(dark, np.ones((2 * _EDGE + 1, 2 * _EDGE + 1), np.uint8)) > 0
        clear, below = lit & ~near[y - y.min(), x - x.min()], lit & (tone < bound)
        apart = tone[lit & ~below].mean() - tone[below].mean()
        specks = clear.sum() < _LEAST_PART * len(tone) and apart < _SHADOW
        lit = below if specks else clear
    return lit


def _parting(tone: np.ndarray) -> float | None:
    """The value between two separate parts of ``tone`` (n,) by Otsu's criterion; None if there is but one."""
    if len(tone) < 2:
        return None
    ordered = np.sort(tone)
    count = np.arange(1, len(tone))
    total, squares = np.cumsum(ordered), np.cumsum(ordered**2)
    low, high = total[:-1] / count, (total[-1] - total[:-1]) / (len(tone) - count)
    share = count / len(tone)
    between = np.where(
        (share > _LEAST_PART) & (share < 1 - _LEAST_PART), share * (1 - share) * (high - low) ** 2, 0
    )
    k = int(np.argmax(between)) if len(between) else 0
    if not len(between) or between[k] == 0:
        return None
    within = squares[-1] / len(tone) - (total[-1] / len(tone)) ** 2 - between[k]
    gap = high[k] - low[k]
    apart = gap > max(_STEP, _APART * np.sqrt(max(within, 0.0)))
    return float((low[k] + high[k]) / 2) if apart else None


def patches_box(camera: Camera, pose: Pose, patches: tuple[WhitePatch, ...]) -> tuple[int, int, int, int]:
    """Columns and rows ``[x0, x1) x [y0, y1)`` of the picture that hold all patches, and what judging pixels takes."""
    width, height = camera.size
    limbs = [limb for patch in patches if (limb := _limb(camera, pose, patch)) is not None]
    if not limbs:
        return 0, 0, min(1, width), min(1, height)
    low, high = np.floor(np.vstack(limbs).min(0)) - _AROUND, np.ceil(np.vstack(limbs).max(0)) + _AROUND
    x0, y0 = np.clip(low, 0, [width - 1, height - 1]).astype(int)
    x1, y1 = np.clip(high, [x0 + 1, y0 + 1], [width, height]).astype(int)
    return int(x0), int(y0), int(x1), int(y1)


def _limb(camera: Camera, pose: Pose, patch: WhitePatch) -> np.ndarray | None:
    """The patch's outline in the picture (k, 2); None if it is not before the camera."""
    outline = np.asarray(patch.outline, float)
    limb = camera.project(pose, np.column_stack([outline, np.full(len(outline), patch.height)]))
    return limb if np.isfinite(limb).all() and np.abs(limb).max() <= 1e6 else None


def _patch_mask(image: RadianceImage, camera: Camera, pose: Pose, patch: WhitePatch) -> np.ndarray | None:
    limb = _limb(camera, pose, patch)
    if limb is None:
        return None
    mask = np.zeros(image.valid.shape, np.uint8)
    fill(mask, limb - image.origin)
    width = 2 * _CLEAR + 1
    return cv2.erode(mask, np.ones((width, width), np.uint8), borderValue=1) > 0


def _hidden(points: np.ndarray, eye: np.ndarray, stray: Stray | None) -> np.ndarray:
    hidden = np.zeros(len(points), bool)
    if stray is not None:
        for ball in stray.scene.polished + (() if stray.scene.sample is None else (stray.scene.sample,)):
            hidden |= behind_ball(points, eye, ball.center, 1.05 * ball.radius)
    return hidden


def _pull(points: np.ndarray, light: Light) -> np.ndarray:
    """Mean derivative (3,) of the logarithm of what was read by the lamp's place; zero for a distant one."""
    if light.kind != "point":
        return np.zeros(3)
    offset = light.place - points
    squared = (offset**2).sum(1)
    return (np.array([0, 0, 1.0]) / offset[:, 2:] - 3 * offset / squared[:, None]).mean(0)


def read_paper(
    reading: PaperReading,
    light: Light,
    stray: Stray | None,
    *,
    white: bool = True,
    shown: tuple[np.ndarray, np.ndarray] | None = None,
) -> Strength | NoStrength:
    """Strength times rho / pi of the paper (or the black print), the median over lit places little touched by
    bounce. ``shown`` is the :func:`light_shape` of its samples, where known."""
    samples = reading.samples
    points = samples.points
    shape, share = light_shape(points, light, stray) if shown is None else shown
    bare = (
        direct(points, light.place)
        if light.kind == "point"
        else np.full(len(points), max(light.place[2], 0.0))
    )
    good = (samples.white == white) & (share > _SEEN) & (bare > 0)
    calm = good & (shape - bare[:, None] < _LITTLE_BOUNCE * bare[:, None]).all(1)
    good = calm if calm.sum() > _FEW_PLACES else good
    if good.sum() < _FEW_PLACES:
        return NoStrength("too little lit paper is seen")
    level = samples.value[good] / shape[good]
    middle = np.median(level, axis=0)
    if middle.min() <= 0:
        return NoStrength("the paper is black")
    squares = np.unique(samples.square[good])
    by_square = np.array([np.median(level[samples.square[good] == k], axis=0) for k in squares])
    spread = robust.deviation(by_square - middle, axis=0)
    error = robust.median_error(spread, len(squares)) + 0.002 * middle
    return Strength(middle, error, _pull(points[good], light))
