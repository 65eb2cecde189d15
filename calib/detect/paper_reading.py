"""What one view's paper shows, in gray, with its noise; and white patches as more paper.

The light of patches falls off as the paper's does, and is theirs by one factor alone. White print between markers is a
few pixels wide in small pictures, and black print is dim; a patch is wide and bright, and where it is a strip along the
board it tells where the lamp stands better than either.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import cv2
import numpy as np

from photogonio.calib.detect.paper import PaperPlaces, PaperSamples, covered, sample_paper, spread_of
from photogonio.calib.detect.paper_near_balls import Close
from photogonio.calib.geometry.camera import Camera, Pose, project_with_scale
from photogonio.capture import robust
from photogonio.capture.photoset import MirrorBall, Plane, Sphere, WhitePatch
from photogonio.capture.radiance import RadianceImage

_BRIGHT = (
    0.3  # of the tone's median radiance: what is brighter is lit, and shows more than the sensor's noise
)
_UNKNOWN_NOISE = 0.01  # relative, where too little is seen to tell
DIMMEST = 1e-300  # radiance below which there is none
_CLEAR = 2.3  # pixels between a sample and the patch's edge, as for white print
_MOST = 2000  # samples of a patch
_WHOLE = 0.99  # share of a cell's samples that can be read: what is left of a clipped one is its darker part
_FEWEST = 4  # samples of a cell
_APART = 3.0  # radii that mirror balls are away, for the light that they throw


@dataclass(frozen=True, slots=True)
class PatchSamples:
    """White patches in one photo, gray."""

    points: np.ndarray  # (n, 3) world
    level: np.ndarray  # (n,) radiance
    noise: np.ndarray  # (n,) its variance
    square: np.ndarray  # (n,) int, a cell as large as the board's squares
    spread: np.ndarray  # (n, 3) covariance on the board of what a sample gathers
    aside: np.ndarray  # (n,) of :meth:`calib.geometry.camera.Camera.aside`
    reflectance: np.ndarray  # (n,) the mean of the channels

    def __len__(self) -> int:
        return len(self.level)

    def keep(self, mask: np.ndarray) -> PatchSamples:
        """Those of ``mask`` (n,)."""
        return PatchSamples(*(getattr(self, one.name)[mask] for one in fields(self)))


@dataclass(frozen=True, slots=True)
class PatchPlaces:
    """Where they are to be read, of the camera at one place."""

    places: PaperPlaces
    reflectance: np.ndarray  # (k,) of each cell, the mean of the channels


@dataclass(frozen=True, slots=True)
class PaperReading:
    """One view's paper in gray."""

    samples: PaperSamples
    level: np.ndarray  # (n,) radiance
    noise: np.ndarray  # (n,) its variance
    beside: tuple[float, float] = (
        0.0,
        0.0,
    )  # white paper's radiance without the lamp, where known, and its error
    close: Close | None = None  # paper close to polished balls
    patches: PatchSamples | None = None

    @property
    def span(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest x and y, (2,) each, of the paper that is seen: from -1 to 1 go the tilts of its light."""
        flat = self.samples.points[:, :2]
        return flat.min(0), flat.max(0)

    def thinned(self, count: int) -> PaperReading:
        """About ``count`` of the samples, evenly taken, and as large a share of what is close to balls."""
        step = max(1, len(self.level) // count)
        if step == 1:
            return self
        mask = np.arange(len(self.level)) % step == 0
        close = None if self.close is None else self.close.keep(np.arange(len(self.close.level)) % step == 0)
        patches = self.patches
        if patches is not None:
            patches = patches.keep(np.arange(len(patches)) % step == 0)
        samples, level, noise = self.samples.keep(mask), self.level[mask], self.noise[mask]
        return replace(self, samples=samples, level=level, noise=noise, close=close, patches=patches)


def local_noise(samples: PaperSamples, level: np.ndarray) -> np.ndarray:
    """Relative noise (n,) from one sample to the next of the same square and tone: what the stated variance may miss.

    White and black apart: light that spreads over the print's edges is much to black and little to white.
    """
    close = (np.diff(samples.square) == 0) & (np.diff(samples.white.astype(int)) == 0)
    close &= np.abs(np.diff(samples.points[:, 1])) < 1e-9
    pair = np.maximum(level[1:] + level[:-1], DIMMEST) / 2
    relative = np.abs(np.diff(level)) / pair
    noise = np.empty(len(level))
    for white in (True, False):
        here = close & (samples.white[1:] == white)
        middle = float(np.median(pair[here])) if here.any() else 0.0
        bright = here & (pair > _BRIGHT * middle) & (middle > DIMMEST)
        spread = robust.deviation(relative[bright]) / np.sqrt(2) if bright.any() else _UNKNOWN_NOISE
        noise[samples.white == white] = spread
    return noise


def patch_places(
    camera: Camera,
    pose: Pose,
    patches: Sequence[WhitePatch],
    *,
    step: float,
    cell: float,
    sample: Sphere | Plane,
    balls: tuple[MirrorBall, ...],
) -> PatchPlaces | None:
    """A grid of pitch ``step``, or wider, over each patch, clear of its edges and of what stands before it; None of
    nothing. Cells of ``cell`` length err together."""
    width, height = camera.size
    found: list[tuple[np.ndarray, ...]] = []
    white: list[float] = []
    first = 0
    for patch in patches:
        outline = np.asarray(patch.outline, float)
        points = _grid(outline, float(patch.height), step)
        pixels, scale = project_with_scale(camera, pose, points)
        used = (pixels > 2).all(1) & (pixels[:, 0] < width - 3) & (pixels[:, 1] < height - 3)
        used[used] = _within(outline, points[used]) * scale[used] > _CLEAR
        used[used] = ~covered(points[used], pose, sample, balls, (), 2 * step)
        for ball in balls:
            used &= np.hypot(*(points[:, :2] - ball.center[:2]).T) > _APART * ball.radius
        if not used.any():
            continue
        points, pixels = points[used], pixels[used]
        column, row = ((points[:, :2] - outline.min(0)) // cell).astype(int).T
        cells = first + column + (column.max() + 1) * row
        white += [float(np.mean(patch.reflectance))] * (int(cells.max()) + 1 - first)
        first = len(white)
        found.append((points, pixels, cells))
    if not found:
        return None
    points, pixels, cells = (np.concatenate(parts) for parts in zip(*found, strict=True))
    own = cells, spread_of(camera, pose, points), camera.aside(pixels)
    return PatchPlaces(PaperPlaces(points, np.ones(len(points), bool), pixels, *own), np.array(white))


def sample_patches(
    found: PatchPlaces, near: Callable[[np.ndarray], RadianceImage | None]
) -> PatchSamples | None:
    """What one photo shows there; None of nothing. ``near`` as for :func:`calib.detect.paper.sample_paper`."""
    samples = sample_paper(found.places, near)
    if samples is None or not len(samples) or samples.spread is None or samples.aside is None:
        return None
    asked, seen = (
        np.bincount(one, minlength=found.places.square.max() + 1)
        for one in (found.places.square, samples.square)
    )
    kept = ((seen >= _WHOLE * asked) & (seen >= _FEWEST))[samples.square]
    if not kept.any():
        return None
    reflectance = found.reflectance[samples.square]
    value, variance = samples.value.mean(axis=1), samples.variance.mean(axis=1) / samples.value.shape[1]
    own = samples.square, samples.spread, samples.aside, reflectance
    return PatchSamples(samples.points, value, variance, *own).keep(kept)


def _grid(outline: np.ndarray, height: float, step: float) -> np.ndarray:
    """Points (n, 3) over the box about an outline (k, 2), at most about _MOST."""
    low, size = outline.min(0), np.maximum(np.ptp(outline, axis=0), 1e-9)
    step = max(step, float(np.sqrt(size.prod() / _MOST)))
    x, y = (np.arange(step / 2, side, step) if side > step else np.array([side / 2]) for side in size)
    flat = np.stack(np.meshgrid(low[0] + x, low[1] + y), axis=-1).reshape(-1, 2)
    return np.column_stack([flat, np.full(len(flat), height)])


def _within(outline: np.ndarray, points: np.ndarray) -> np.ndarray:
    """How far (n,) points lie inside an outline (k, 2), less than 0 outside."""
    polygon = outline.astype(np.float32).reshape(-1, 1, 2)
    return np.array([cv2.pointPolygonTest(polygon, (float(u), float(v)), True) for u, v in points[:, :2]])
