"""Where a sample ball stands that is not where the manifest says: its whole limb is looked for, far around.

A limb is a closed curve of edges that all lie across it. Prints have edges everywhere, but along no circle: where the
share of a circle's edges that lie right stands out from all others', there is the ball.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from photogonio.calib.adjust.start import start_sample
from photogonio.calib.adjust.state import State, observed
from photogonio.calib.detect.gray import without_fireflies
from photogonio.calib.detect.limb import LIMB_POINTS
from photogonio.calib.detect.observation import Observation
from photogonio.calib.detect.photo_reader import Reader
from photogonio.calib.diagnose.base import Departure, Stage
from photogonio.calib.geometry.camera import Camera, Pose, focal
from photogonio.calib.geometry.cones import outline
from photogonio.capture.diagnosis import Diagnosis, Entry
from photogonio.capture.linear.signal import Region
from photogonio.capture.photoset import PhotoSet, Sphere

_MOVED = 0.03  # of the radius, by which a ball may stand beside its place without a further look
_REACH = 1.6  # radii around the manifest's place that are looked at
_STEP = 2.5  # pixels between places tried, and then
_FINE = 0.8
_BLUR = 1.5  # pixels
_LARGEST = 120.0  # pixels of a radius; in larger pictures a ball is looked for in ones as much smaller
_AT_ONCE = 4096  # places tried: the memory they take
_POINTS = 64  # along a limb
_PHOTOS = 4  # looked at
_SHARE = 0.15  # of a limb that must be seen: the fainter an edge beside the print's, the less it counts
_BETTER = 1.3  # times the share of the manifest's place, and of all others
_FAINT = 0.25  # of the usual strong edge: a limb may be fainter than the print
_APART = 0.3  # of the radius, between places that are not one
_NEAR = 0.04  # of the radius, where a ball is looked for at the manifest's place
_PART = 0.4  # of a limb's points, that a ball shows where it is found
_TRIED = 4  # of the likeliest places
_INNER = 0.85  # of a limb's size: corners within are hidden by the ball, and
_SEEN_THROUGH = 2  # so many of them seen are none that were mistaken
_SMALLEST = 8  # pixels of a part that is looked at


@dataclass(frozen=True, slots=True)
class _Picture:
    """Edges in a part of a photo, or of all of a still camera's, as unit gradients times how clear they are."""

    pose: Pose
    x: np.ndarray  # (h, w) float32
    y: np.ndarray
    origin: np.ndarray  # (2,) the part's first pixel
    shrunk: int  # pixels of the photo along one of these
    corners: np.ndarray  # (n, 2) pixels of corners of the board and of its markers that are seen

    def share(self, limbs: np.ndarray) -> np.ndarray:
        """How much (m,) of limbs (m, k, 2) shows edges that lie along them, 0 to 1."""
        tangent = np.roll(limbs, -1, axis=1) - np.roll(limbs, 1, axis=1)
        tangent /= np.maximum(np.linalg.norm(tangent, axis=2, keepdims=True), 1e-12)
        place = np.floor((limbs + 0.5 - self.origin) / self.shrunk).astype(int)
        height, width = self.x.shape
        inside = ((place >= 0) & (place < (width, height))).all(axis=2)
        column, row = np.where(inside, place[..., 0], 0), np.where(inside, place[..., 1], 0)
        across = self.x[row, column] * tangent[..., 1] - self.y[row, column] * tangent[..., 0]
        return (inside * across**2).mean(axis=1) * ~self._before_corners(limbs)

    def _before_corners(self, limbs: np.ndarray) -> np.ndarray:
        """Whether corners of the board are seen where balls of these limbs would hide them, (m,) bool."""
        middle = limbs.mean(axis=1)
        inner = _INNER * np.linalg.norm(limbs - middle[:, None], axis=2).min(axis=1)
        away = np.linalg.norm(self.corners - middle[:, None], axis=2)
        return (away < inner[:, None]).sum(axis=1) >= _SEEN_THROUGH


class DisplacedBall(Departure):
    """A sample ball whose limb is seen far from its place in the manifest."""

    stage = Stage.PHOTO
    entries = (
        Entry(
            "displaced-ball",
            "The sample ball's limb is seen elsewhere than the manifest has it; the ball is taken to be there.",
            "Correct `sample.center`, and `sample.radius` if it is said to be half as large.",
        ),
    )

    def evidence(self, state: State) -> Sequence[Diagnosis]:
        found = ball_elsewhere(state.photoset, state.reader, state.camera, state.observations)
        if found is None:
            return []
        told, unit = state.photoset.sample, state.photoset.length_unit
        assert isinstance(told, Sphere)
        off = float(np.linalg.norm(found.center - told.center))
        place = ", ".join(f"{v:.3g}" for v in found.center)
        same = found.radius == told.radius
        size = "," if same else f", with a radius of {found.radius:.3g}, half the manifest's,"
        message = (
            f"the sample ball stands {off:.2g} {unit} off the manifest's center, at about [{place}]{size} and is taken "
            f"to be there: correct {'sample.center' if same else 'sample.center and sample.radius'}"
        )
        detail = {"center": found.center.tolist(), "radius": float(found.radius)}
        return [Diagnosis("displaced-ball", message, off, allowed=True, detail=detail, grounds=found)]

    def remedy(self, state: State, found: Sequence[Diagnosis]) -> State | None:
        moved = observed(replace(state, photoset=replace(state.photoset, sample=found[0].grounds)))
        return moved if shows_limb(moved.observations) else None


def ball_elsewhere(
    photoset: PhotoSet, reader: Reader, camera: Camera, observations: Sequence[Observation]
) -> Sphere | None:
    """The sample ball where the photos show it, if that is far from where the manifest has it; else None."""
    ball = photoset.sample
    if not isinstance(ball, Sphere) or not _doubtful(camera, observations, ball):
        return None
    pictures = _pictures(reader, camera, observations, ball)
    if not pictures:
        return None
    near = _grid(ball.center, _NEAR * ball.radius, _NEAR / 4 * ball.radius)
    there, _ = _highest(pictures, camera, near, ball.radius)
    for radius in (ball.radius, ball.radius / 2):  # the diameter may be told for the radius
        tried = [_best(pictures, camera, one) for one in _guesses(ball, radius)]
        share, other, center = max(tried, key=lambda one: one[0])
        if share >= max(_SHARE, _BETTER * max(there, other)):
            moved = float(np.linalg.norm(center - ball.center)) > _MOVED * radius
            return Sphere(center, radius) if moved or radius != ball.radius else None
    return None


def shows_limb(observations: Sequence[Observation]) -> bool:
    """Whether a good part of the sample's limb was found."""
    return any(s.limb is not None and len(s.limb) > _PART * LIMB_POINTS for s in observations)


def _doubtful(camera: Camera, observations: Sequence[Observation], ball: Sphere) -> bool:
    """Whether no limb is seen about the manifest's place, or far aside."""
    if all(s.limb is None for s in observations):
        return True
    start = start_sample(camera, observations, ball)
    return start is not None and bool(np.linalg.norm(start[:3] - ball.center) > _MOVED * ball.radius)


def _guesses(ball: Sphere, radius: float) -> list[Sphere]:
    """The ball as high as it is told to be, and lying on the board."""
    heights = [float(ball.center[2])]
    if abs(heights[0] - radius) > _MOVED * radius:
        heights.append(radius)
    return [Sphere(np.array([*ball.center[:2], height]), radius) for height in heights]


def _best(pictures: list[_Picture], camera: Camera, ball: Sphere) -> tuple[float, float, np.ndarray]:
    """The largest share that a ball as large and as high as ``ball`` has anywhere around, the largest that it has
    elsewhere, and the centre (3,) of the first."""
    scale = _scale(pictures, camera, ball)
    centers = _grid(ball.center, _REACH * ball.radius, _STEP / scale)
    shares = _shares(pictures, camera, centers, ball.radius)
    found = []
    for k in _peaks(centers, shares, _APART * ball.radius):
        share, center = shares[k], centers[k]
        for reach, step in ((2 * _STEP, _FINE), (_FINE, _FINE / 3)):
            close = _grid(center, reach / scale, step / scale)
            share, center = _highest(pictures, camera, close, ball.radius)
        found.append((share, center))
    (share, center), *others = sorted(found, key=lambda one: -one[0])
    apart = [s for s, c in others if np.linalg.norm(c - center) > _APART * ball.radius / 2]
    return share, max(apart, default=0.0), center


def _peaks(centers: np.ndarray, shares: np.ndarray, apart: float) -> list[int]:
    """The largest shares that are so far apart."""
    chosen: list[int] = []
    for k in np.argsort(-shares):
        if all(np.linalg.norm(centers[k] - centers[n]) > apart for n in chosen):
            chosen.append(int(k))
        if len(chosen) == _TRIED:
            break
    return chosen


def _highest(
    pictures: list[_Picture], camera: Camera, centers: np.ndarray, radius: float
) -> tuple[float, np.ndarray]:
    """The largest share of balls at ``centers`` (m, 3), in the mean of the photos, and the centre (3,) that has it."""
    shares = _shares(pictures, camera, centers, radius)
    best = int(np.argmax(shares))
    return float(shares[best]), centers[best]


def _shares(pictures: list[_Picture], camera: Camera, centers: np.ndarray, radius: float) -> np.ndarray:
    """Shares (m,) of balls at ``centers`` (m, 3), in the mean of the photos."""
    total = np.zeros(len(centers))
    for one in pictures:
        limb = _limb(camera, one.pose, centers.mean(axis=0), radius)
        for first in range(0, len(centers), _AT_ONCE):
            some = slice(first, first + _AT_ONCE)
            total[some] += one.share(camera.project(one.pose, centers[some])[:, None] + limb)
    return total / len(pictures)


def _limb(camera: Camera, pose: Pose, middle: np.ndarray, radius: float) -> np.ndarray:
    """The limb (k, 2) of a ball at ``middle`` (3,) beside its projection: about that of balls around it too."""
    return outline(camera, pose, middle, radius, _POINTS) - camera.project(pose, middle[None])


def _grid(middle: np.ndarray, reach: float, step: float) -> np.ndarray:
    """Places (m, 3) about ``middle`` at its height."""
    count = int(np.ceil(reach / step))
    line = step * np.arange(-count, count + 1)
    x, y = (part.ravel() for part in np.meshgrid(line, line))
    return middle + np.column_stack([x, y, np.zeros(len(x))])


def _scale(pictures: list[_Picture], camera: Camera, ball: Sphere) -> float:
    """Pixels of its picture that a length unit has at the ball, in the nearest photo."""
    return max(focal(camera) / float(np.linalg.norm(p.pose.apply(ball.center))) / p.shrunk for p in pictures)


def _pictures(
    reader: Reader, camera: Camera, observations: Sequence[Observation], ball: Sphere
) -> list[_Picture]:
    """Edges as far around the ball as it is looked for: of a still camera's photos laid over one another, which show
    all sides lit, or of each."""
    chosen = [s for s in observations if not s.probe and not s.dark]
    if not chosen:
        return []
    every = np.unique(np.linspace(0, len(chosen) - 1, _PHOTOS).astype(int))
    shown: dict[str, tuple[Observation, Region, list[np.ndarray]]] = {}
    for observation in (chosen[k] for k in every):
        region = _region(camera, observation.pose, ball)
        level = None if region is None else reader.level(observation.view, region)
        if region is not None and level is not None:
            shown.setdefault(observation.pose_block, (observation, region, []))[2].append(
                without_fireflies(level[0])
            )
    return [
        _picture(camera, one, np.nan_to_num(np.max(levels, axis=0)), region, ball)
        for one, region, levels in shown.values()
    ]


def _region(camera: Camera, pose: Pose, ball: Sphere) -> Region | None:
    middle = camera.project(pose, np.asarray(ball.center, float)[None])[0]
    reach = (_REACH + 1.1) * ball.radius * focal(camera) / float(np.linalg.norm(pose.apply(ball.center)))
    if not np.isfinite(middle).all():
        return None
    low = np.clip(np.floor(middle - reach), 0, camera.size).astype(int).tolist()
    high = np.clip(np.ceil(middle + reach), 0, camera.size).astype(int).tolist()
    return (*low, *high) if min(high[0] - low[0], high[1] - low[1]) >= _SMALLEST else None


def _picture(
    camera: Camera, observation: Observation, level: np.ndarray, region: Region, ball: Sphere
) -> _Picture:
    radius = ball.radius * focal(camera) / float(np.linalg.norm(observation.pose.apply(ball.center)))
    shrunk = max(1, min(round(radius / _LARGEST), min(level.shape) // _SMALLEST))
    if shrunk > 1:
        height, width = (shrunk * (n // shrunk) for n in level.shape)
        small = width // shrunk, height // shrunk
        level = cv2.resize(level[:height, :width], small, interpolation=cv2.INTER_AREA)
    bright = max(float(np.percentile(level, 95)), 1e-30)
    tone = cv2.GaussianBlur(np.sqrt(np.clip(level / bright, 0, 4)).astype(np.float32), (0, 0), _BLUR)
    dx, dy = (cv2.Sobel(tone, cv2.CV_32F, *order, ksize=3) for order in ((1, 0), (0, 1)))
    size = np.hypot(dx, dy) + 1e-30
    clear = size / (size + _FAINT * float(np.percentile(size, 95)))
    seen, marks = np.zeros((0, 2)), np.zeros((0, 2))
    if observation.corners is not None:
        seen, marks = observation.corners.pixels, observation.corners.marker_pixels.reshape(-1, 2)
    return _Picture(
        observation.pose,
        clear * dx / size,
        clear * dy / size,
        np.array(region[:2], float),
        shrunk,
        np.concatenate([seen, marks]),
    )
