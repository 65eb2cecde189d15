"""Which pixels of a photo show the sample and not the print, and which shape holds most of them.

The print and its light are known, so that each pixel says how much rather it shows the sample than the print, lit or
in a shadow (a logarithm of chances). A shape is placed where the sum over the pixels within it is largest: all its
outline tells, wherever sample and print differ, and edges of the print, which are stronger than a sample's, do not
mislead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import minimize

from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.print_map import Print
from photogonio.calib.identify.covered import Cover

AROUND = 0.6  # of the shape's size, beside it in the picture, in which pixels are asked
MOST = 8_000  # pixels of a photo that tell
PIECE = 30_000  # points at a time, for OpenCV
FINE = 3  # points along a pixel's side at which the print is asked
BLUR = 0.8  # pixels, standard deviation, of a photo's own
ASIDE = 0.35  # pixels by which the print may lie aside
LEAST_NOISE = 0.03  # of white
LEVELS = 24  # of light over white, in which the sample's own are counted
TOP = 1.6  # of white: brighter samples are counted together
EVEN = 0.1  # chance that a pixel of the sample is like none of its others
SHADED = 0.12  # chance that print lies in a shadow, however deep
DARK = 0.04  # of white: standard deviation of what a full shadow leaves
ODD = 0.03  # chance that print looks like anything
FLAT = 1e-5  # of the sum, at which a fit ends
STEP = 0.1  # units, in which its slope is taken
SOFT = (6.0, 3.0, 1.5, 1.5)  # pixels over which an outline is softened, rounds one after another
WORTH = 8.0  # that a pixel may tell at most


@dataclass(frozen=True, slots=True)
class SamplePixels:
    """Pixels of one photo about the sample."""

    pixels: np.ndarray  # (n, 2)
    rays: np.ndarray  # (n, 3) unit, world
    eye: np.ndarray  # (3,)
    level: np.ndarray  # (n,) light over that of white paper there
    of_print: np.ndarray  # (n,) logarithm of the chance density of that, if it shows the print
    camera: Camera
    pose: Pose
    weight: float  # pixels that each stands for

    def of_sample(self, inside: np.ndarray) -> np.ndarray:
        """(n,) by how much rather each pixel shows the sample, as its pixels ``inside`` (n,) bool look."""
        counted = np.clip((self.level / TOP * LEVELS).astype(int), 0, LEVELS - 1)
        counts = np.bincount(counted[inside], minlength=LEVELS).astype(float)
        counts = np.convolve(counts, [0.25, 0.5, 0.25], mode="same") + 1e-9
        density = (EVEN + (1.0 - EVEN) * counts / counts.sum() * LEVELS) / TOP
        told = np.log(density[counted]) - self.of_print
        return np.where(np.isfinite(self.of_print), np.clip(told, -WORTH, WORTH), 0.0)


def seen_about(
    small: np.ndarray, cover: Cover, pose: Pose, camera: Camera, print_: Print, outline: np.ndarray
) -> SamplePixels | None:
    """The pixels about a shape's ``outline`` (m, 2) in a photo, gray (h, w); None if it is not in the picture."""
    height, width = small.shape
    if not np.isfinite(outline).all():
        return None
    reach = AROUND * np.ptp(outline, axis=0).max()
    low = np.maximum(np.floor(outline.min(axis=0) - reach), 0).astype(int)
    high = np.minimum(np.ceil(outline.max(axis=0) + reach), [width - 1, height - 1]).astype(int)
    shape = (int(high[1] - low[1] + 1), int(high[0] - low[0] + 1))
    if min(shape) < 8:
        return None
    x, y = np.meshgrid(np.arange(low[0], high[0] + 1.0), np.arange(low[1], high[1] + 1.0))
    pixels = np.column_stack([x.ravel(), y.ravel()])
    rays = camera.world_rays(pose, pixels)
    points = _on_board(pose.center, rays)
    tone = _tones(camera, pose, print_, pixels, shape)
    slope = np.hypot(
        cv2.Sobel(tone, cv2.CV_32F, 1, 0, scale=0.125), cv2.Sobel(tone, cv2.CV_32F, 0, 1, scale=0.125)
    )
    white = _light_at(cover, points.reshape(*shape, 2)).ravel()
    level = small[low[1] : high[1] + 1, low[0] : high[0] + 1].ravel() / np.maximum(white, 1e-9)
    beyond = ~print_.on_print(points) | (white <= 0)
    ends = _ink_and_paper(level, tone.ravel(), cover, points, beyond)
    expected = ends[0] + (ends[1] - ends[0]) * tone.ravel()
    noise = np.hypot(_noise(level - expected, beyond), ASIDE * (ends[1] - ends[0]) * slope.ravel())
    chance = _chance(level, expected, noise)
    of_print = np.where(beyond, np.nan, np.log(chance))
    keep = np.arange(0, len(pixels), max(1, int(np.ceil(len(pixels) / MOST))))
    weight = len(pixels) / len(keep)
    return SamplePixels(
        pixels[keep], rays[keep], pose.center, level[keep], of_print[keep], camera, pose, weight
    )


def _on_board(eye: np.ndarray, rays: np.ndarray) -> np.ndarray:
    down = np.minimum(rays[:, 2], -1e-6)
    return (eye - (eye[2] / down)[:, None] * rays)[:, :2]


def _tones(
    camera: Camera, pose: Pose, print_: Print, pixels: np.ndarray, shape: tuple[int, int]
) -> np.ndarray:
    """The print's tone (h, w) as the camera would see it."""
    steps = (np.arange(FINE) + 0.5) / FINE - 0.5
    total = np.zeros(len(pixels), np.float32)
    for dx in steps:
        for dy in steps:
            rays = camera.world_rays(pose, pixels + np.array([dx, dy]))
            points = _on_board(pose.center, rays)
            total += np.concatenate(
                [print_.tone_at(points[k : k + PIECE]) for k in range(0, len(points), PIECE)]
            )
    return cv2.GaussianBlur((total / FINE**2).reshape(shape), (0, 0), BLUR)


def _light_at(cover: Cover, points: np.ndarray) -> np.ndarray:
    """(h, w) what white paper has at board points (h, w, 2)."""
    first = cover.points[0]
    at = ((points - first) / cover.step).astype(np.float32)
    light = cover.light.reshape(cover.shape).astype(np.float32)
    return cv2.remap(light, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)


def _cells(cover: Cover, points: np.ndarray) -> np.ndarray:
    """(n,) what the cells about board points say: 1 hidden, 0 not."""
    at = np.round((points - cover.points[0]) / cover.step).astype(int)
    rows, columns = cover.shape
    inside = (at >= 0).all(axis=1) & (at[:, 0] < columns) & (at[:, 1] < rows)
    at = np.clip(at, 0, [columns - 1, rows - 1])
    return np.where(inside, cover.hidden.reshape(cover.shape)[at[:, 1], at[:, 0]], 0.5)


def _ink_and_paper(
    level: np.ndarray, tone: np.ndarray, cover: Cover, points: np.ndarray, beyond: np.ndarray
) -> tuple[float, float]:
    """Black and white print over the light that the cells have of white."""
    shown = ~beyond & (_cells(cover, points) == 0)
    ends = []
    for own, usual in ((tone < 0.03, 0.05), (tone > 0.97, 1.0)):
        told = level[shown & own]
        ends.append(float(np.median(told)) if len(told) >= 20 else usual)
    return ends[0], max(ends[1], ends[0] + 0.1)


def _noise(off: np.ndarray, beyond: np.ndarray) -> float:
    """Of print that is seen, over white: most of what is off by little."""
    near = np.abs(off[~beyond & (np.abs(off) < 0.2)])
    return max(LEAST_NOISE, 1.48 * float(np.median(near))) if len(near) else LEAST_NOISE


def _chance(level: np.ndarray, expected: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """(n,) density of a level if a pixel shows the print, lit or in a shadow."""

    def normal(off: np.ndarray, width: np.ndarray | float) -> np.ndarray:
        return np.asarray(np.exp(-0.5 * (off / width) ** 2) / (np.sqrt(2 * np.pi) * width))

    lit = normal(level - expected, noise)
    depth = normal(level - 0.5 * DARK, DARK)  # what little a full shadow leaves
    partly = (level < expected) / np.maximum(expected, 0.05)
    return (1 - SHADED - ODD) * lit + SHADED * (0.5 * depth + 0.5 * partly) + ODD / TOP


def ball_depth(seen: SamplePixels, center: np.ndarray, radius: float) -> np.ndarray:
    """(n,) how far each pixel lies within a ball's limb, pixels, about."""
    toward = center - seen.eye
    far2 = float(toward @ toward)
    along = seen.rays @ toward
    apart = np.sqrt(np.maximum(far2 - along**2, 0.0))  # of the ray from the middle
    scale = np.sqrt(np.abs(np.linalg.det(seen.camera.matrix[:2, :2]))) / np.sqrt(far2)
    return np.where(along > 0, (radius - apart) * scale, -1e3)


def flat_depth(seen: SamplePixels, corners: np.ndarray, height: float) -> np.ndarray:
    """(n,) how far each pixel lies within a convex polygon's outline, pixels."""
    at = seen.camera.project(seen.pose, np.column_stack([corners, np.full(len(corners), height)]))
    edges = np.roll(at, -1, axis=0) - at
    area = float(np.sum(at[:, 0] * np.roll(at[:, 1], -1) - np.roll(at[:, 0], -1) * at[:, 1]))
    length = np.maximum(np.linalg.norm(edges, axis=1), 1e-9)
    inward = np.column_stack([-edges[:, 1], edges[:, 0]]) / length[:, None] * np.sign(area)
    depth = np.full(len(seen.pixels), np.inf)
    for corner, normal in zip(at, inward, strict=True):
        np.minimum(depth, (seen.pixels - corner) @ normal, out=depth)
    return depth


Depth = Callable[[SamplePixels, np.ndarray], np.ndarray]


def ball_by(seen: SamplePixels, values: np.ndarray) -> np.ndarray:
    """Depth of a ball on the paper, of x, y and the logarithm of its radius."""
    radius = float(np.exp(values[2]))
    return ball_depth(seen, np.append(values[:2], radius), radius)


def flat_by(seen: SamplePixels, values: np.ndarray) -> np.ndarray:
    """Depth of a flat piece, of its corners' coordinates one after another and its height."""
    return flat_depth(seen, values[:-1].reshape(-1, 2), float(values[-1]))


def best_shape(
    photos: Sequence[SamplePixels],
    depth: Depth,
    start: np.ndarray,
    scale: np.ndarray,
    stages: Sequence[float] = SOFT,
) -> tuple[np.ndarray, float]:
    """The values that hold most, near ``start``, with steps in units of ``scale``; and how much, over all photos.

    ``stages``: pixels over which the outline is softened, one round each."""
    values = np.asarray(start, float) / scale
    for soft in stages:
        told = [one.of_sample(depth(one, values * scale) > 0) for one in photos]
        values = minimize(
            lambda at, told=told, soft=soft: -_held(photos, told, depth, at * scale, soft),
            values,
            method="L-BFGS-B",
            options={"eps": STEP, "ftol": FLAT, "maxiter": 25},
        ).x
    return values * scale, held(photos, depth, values * scale)


def held(photos: Sequence[SamplePixels], depth: Depth, values: np.ndarray) -> float:
    """What a shape holds of all photos."""
    told = [one.of_sample(depth(one, values) > 0) for one in photos]
    return _held(photos, told, depth, values, SOFT[-1])


def _held(
    photos: Sequence[SamplePixels], told: Sequence[np.ndarray], depth: Depth, values: np.ndarray, soft: float
) -> float:
    return sum(
        float(one.weight * (worth @ np.clip(depth(one, values) / soft + 0.5, 0.0, 1.0)))
        for one, worth in zip(photos, told, strict=True)
    )
