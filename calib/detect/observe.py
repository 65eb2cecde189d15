"""What each photo shows of lamp, sample and paper, once the camera's place is known."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.detect.edges import Edges, plane_edges
from photogonio.calib.detect.gray import GrayPart, without_fireflies
from photogonio.calib.detect.highlights import Highlight, ball_box, find_highlight, lamp_pixels
from photogonio.calib.detect.limb import Limb, settled_limb
from photogonio.calib.detect.observation import FIXED_POSE, Observation
from photogonio.calib.detect.paper import PaperPlaces, paper_places, sample_paper
from photogonio.calib.detect.paper_near_balls import ClosePlaces, close_paper, close_places
from photogonio.calib.detect.paper_reading import (
    PaperReading,
    PatchPlaces,
    local_noise,
    patch_places,
    sample_patches,
)
from photogonio.calib.detect.photo_reader import Progress, Reader
from photogonio.calib.geometry.board import board_size
from photogonio.calib.geometry.camera import Camera, Pose, focal
from photogonio.calib.geometry.cones import outline
from photogonio.calib.geometry.print_map import draw_print, square_pitch
from photogonio.capture.linear.signal import Region
from photogonio.capture.photoset import LooseMarkers, MirrorBall, PhotoSet, Plane, Sphere
from photogonio.capture.radiance import RadianceImage

_ACROSS = 170  # paper samples along the board's longer side
_ACROSS_LOOSE = 300  # the same where only loose markers are known to be paper
_CAUSTIC = 3.0  # radii around a polished ball where it throws light back onto the paper
_FEWEST = 400  # samples of paper worth a fit
_DARK = 3.0  # standard errors of one sample of paper
_PILED = 16  # photos of a still camera that are laid over one another
_FARTHEST_EDGE = 3.0  # pixels that a flat sample's edge is looked for aside
_FARTHER = 2.0  # times as far, where there is none
_DIMMEST = 0.03  # of the brightest highlight: one and the same lamp in another ball
_FILTERED = 8.0  # pixels beside an edge that finding it takes
_ASTRAY = 0.04  # of the radius: how far a sample ball may stand from the manifest's place


def observe(
    photoset: PhotoSet,
    reader: Reader,
    camera: Camera,
    observations: list[Observation],
    balls: tuple[MirrorBall, ...],
    tell: Progress,
) -> None:
    """Fill in highlights, limbs and paper of every observation."""
    still = len(observations) > 1 and all(s.pose_block == FIXED_POSE for s in observations)
    brightest, middle = _Pile("max"), _Pile("median")
    common = _places(photoset, camera, observations[0].pose, balls) if still else None

    def watch(observation: Observation) -> GrayPart | None:
        places = common or _places(photoset, camera, observation.pose, balls)
        found = [
            _highlight(reader, camera, observation, ball, number, places.lamp[number])
            for number, ball in enumerate(balls)
        ]
        observation.highlights = of_one_lamp([h for h in found if h is not None], balls)
        if not observation.probe:
            reading = _paper(photoset, reader, observation, places)
            observation.dark = reading is not None and is_dark(reading)
            observation.keep, observation.reading = reader.keep, reading
        box = places.balls if observation.probe else places.sample
        level = (
            reader.level(observation.view, box)
            if box and not observation.dark and (still or not observation.probe)
            else None
        )
        if box is None or level is None:
            return None
        # what is saturated has edges too
        shown = GrayPart(without_fireflies(level[0]), np.isfinite(level[0]), box[:2])
        if isinstance(photoset.sample, Plane) and not observation.probe:
            observation.edges = _sample_edges(photoset, photoset.sample, shown, camera, observation)
        return shown

    for k, (observation, shown) in enumerate(
        zip(observations, reader.abreast(watch, observations), strict=True)
    ):
        if shown is not None and still:
            (middle if observation.probe else brightest).add(observation, shown)
        elif shown is not None:
            observation.limb = _sample_limb(photoset, shown, camera, observation)
        tell("finding lamps, sample and paper", k + 1, len(observations))
    if brightest.observation is not None:
        brightest.observation.limb = _sample_limb(
            photoset, brightest.picture(), camera, brightest.observation
        )
    if middle.observation is not None:
        middle.observation.ball_limbs = _ball_limbs(balls, middle.picture(), camera, middle.observation)


@dataclass(frozen=True, slots=True)
class _Places:
    """Where in a photo all this is, with the camera at one place."""

    lamp: list[np.ndarray]  # each ball's :func:`lamp_pixels`
    paper: PaperPlaces | None
    close: ClosePlaces | None
    patches: PatchPlaces | None
    sample: Region | None  # None: not in the picture
    balls: Region | None


def _places(photoset: PhotoSet, camera: Camera, pose: Pose, balls: tuple[MirrorBall, ...]) -> _Places:
    board, paper, close, white = photoset.board, None, None, None
    sample, patches = photoset.sample, photoset.white_patches
    if board is not None:
        step = float(board_size(board).max()) / (
            _ACROSS_LOOSE if isinstance(board, LooseMarkers) else _ACROSS
        )
        paper = paper_places(photoset, camera, pose, step=step, apart=_CAUSTIC)
        close = close_places(board, camera, pose, sample=sample, balls=photoset.mirror_balls, patches=patches)
        if paper is not None:
            white = patch_places(
                camera,
                pose,
                patches,
                step=step,
                cell=square_pitch(board),
                sample=sample,
                balls=photoset.mirror_balls,
            )
    limbs = [outline(camera, pose, np.asarray(b.center, float), b.radius) for b in balls]
    reach = max((_within(camera, pose, b.center, b.radius) for b in balls), default=0.0)
    return _Places(
        [lamp_pixels(camera, pose, ball) for ball in balls],
        paper,
        close,
        white,
        _sample_box(photoset, camera, pose),
        _box(camera, np.concatenate(limbs), reach) if limbs else None,
    )


def _sample_box(photoset: PhotoSet, camera: Camera, pose: Pose) -> Region | None:
    """Where the sample's outline may be in a photo; None if that is nowhere."""
    sample = photoset.sample
    if isinstance(sample, Plane):
        flat = np.asarray(sample.outline, float)
        limb = camera.project(pose, np.column_stack([flat, np.full(len(flat), sample.height)]))
        return _box(camera, limb, _FARTHER * _FARTHEST_EDGE)
    center = np.asarray(sample.center, float)
    return _box(
        camera, outline(camera, pose, center, sample.radius), _within(camera, pose, center, sample.radius)
    )


def _box(camera: Camera, limb: np.ndarray, within: float) -> Region | None:
    """The part of the picture that looking for an outline (n, 2) takes, which may be ``within`` pixels beside it."""
    if not np.isfinite(limb).all():
        return None
    reach, size = 2 * within + _FILTERED, np.array(camera.size)
    low = np.clip(np.floor(limb.min(0) - reach), 0, size).astype(int).tolist()
    high = np.clip(np.ceil(limb.max(0) + reach) + 1, 0, size).astype(int).tolist()
    return (*low, *high) if low[0] < high[0] and low[1] < high[1] else None


class _Pile:
    """Photos of a still camera laid over one another: what no single lamp shows shows in all of them together."""

    def __init__(self, how: str):
        self.observation: Observation | None = None  # the first, which what is found will be booked on
        self._how = how
        self._parts: list[GrayPart] = []
        self._usable: np.ndarray | None = None

    def add(self, observation: Observation, part: GrayPart) -> None:
        self.observation = self.observation or observation
        self._usable = part.usable if self._usable is None else self._usable & part.usable
        if self._how == "max" and self._parts:
            np.maximum(self._parts[0].level, part.level, out=self._parts[0].level)
        elif len(self._parts) < _PILED:
            self._parts.append(part)

    def picture(self) -> GrayPart:
        """What the pile shows."""
        first, levels = self._parts[0], [part.level for part in self._parts]
        level = levels[0] if len(levels) == 1 else np.median(levels, axis=0).astype(np.float32)
        return replace(first, level=level, usable=first.usable if self._usable is None else self._usable)


def _highlight(
    reader: Reader, camera: Camera, observation: Observation, ball: MirrorBall, number: int, shown: np.ndarray
) -> Highlight | None:
    x0, y0, x1, y1 = box = ball_box(camera, observation.pose, ball)
    image = reader.part(observation.view, box) if x0 < x1 and y0 < y1 else None
    return None if image is None else find_highlight(image, camera, observation.pose, ball, number, shown)


def of_one_lamp(found: list[Highlight], balls: tuple[MirrorBall, ...]) -> list[Highlight]:
    """Those that may be the same lamp: a ball that does not show it shows something else, many times dimmer.

    Dimmer as it is, as a lamp that is resolved would be, and over the ball's radius squared, with which an image's area
    goes.
    """
    peak = np.array([h.peak for h in found])
    spread = np.array([h.peak / balls[h.ball].radius ** 2 for h in found])
    share = [max(p / peak.max(), s / spread.max()) for p, s in zip(peak, spread, strict=True)]
    return [h for h, bright in zip(found, share, strict=True) if h.clipped or bright > _DIMMEST]


def _paper(
    photoset: PhotoSet, reader: Reader, observation: Observation, places: _Places
) -> PaperReading | None:
    def near(pixels: np.ndarray) -> RadianceImage | None:
        return reader.near(observation.view, pixels)

    samples = None if places.paper is None else sample_paper(places.paper, near)
    if samples is None or len(samples) < _FEWEST:
        return None
    level = samples.value.mean(axis=1)
    noise = samples.variance.mean(axis=1) / samples.variance.shape[1]
    close = None if places.close is None else close_paper(places.close, near)
    noise = np.maximum(noise, (local_noise(samples, level) * level) ** 2)
    patches = None if places.patches is None else sample_patches(places.patches, near)
    return PaperReading(samples, level, noise, close=close, patches=patches)


def is_dark(reading: PaperReading) -> bool:
    """Whether nothing stands out of the noise, of neither the white print's brightest tenth nor all paper's: a lamp
    that failed, a lens cap.

    Either alone may mislead: seen at a slant a board yields ten black samples for each white one, and in a small
    picture the few white ones may all lie in a shadow.
    """
    lit, white = reading.level > _DARK * np.sqrt(reading.noise), reading.samples.white
    return all(float(np.mean(one)) < 0.1 for one in (lit, lit[white]) if len(one))


def _sample_limb(
    photoset: PhotoSet,
    part: GrayPart,
    camera: Camera,
    observation: Observation,
) -> Limb | None:
    sample = photoset.sample
    if not isinstance(sample, Sphere):
        return None
    center = np.asarray(sample.center, float)
    within = _within(camera, observation.pose, center, sample.radius)
    return settled_limb(part, camera, observation.pose, center, sample.radius, within)


def _sample_edges(
    photoset: PhotoSet,
    plane: Plane,
    part: GrayPart,
    camera: Camera,
    observation: Observation,
) -> Edges | None:
    flat = np.asarray(plane.outline, float)
    middle = np.append(flat.mean(0), plane.height)
    within = min(
        _within(camera, observation.pose, middle, float(np.ptp(flat, axis=0).max()) / 2), _FARTHEST_EDGE
    )
    board = photoset.board  # what is printed around loose markers is not known
    pattern = None if board is None or isinstance(board, LooseMarkers) else draw_print(board)
    found = plane_edges(part, camera, observation.pose, plane, within, pattern)
    if found is None:  # an outline that is told too large or too small
        found = plane_edges(part, camera, observation.pose, plane, _FARTHER * within, pattern)
    return found


def _ball_limbs(
    balls: tuple[MirrorBall, ...],
    part: GrayPart,
    camera: Camera,
    observation: Observation,
) -> dict[int, Limb]:
    """Limbs of the mirror balls by number, where they stand out of what is behind them."""
    limbs = {}
    for number, ball in enumerate(balls):
        center = np.asarray(ball.center, float)
        within = _within(camera, observation.pose, center, ball.radius)
        limb = settled_limb(part, camera, observation.pose, center, ball.radius, within)
        if limb is not None:
            limbs[number] = limb
    return limbs


def _within(camera: Camera, pose: Pose, center: np.ndarray, radius: float) -> float:
    """Pixels by which an outline may lie beside that of the manifest."""
    scale = focal(camera) / float(np.linalg.norm(pose.apply(np.asarray(center, float))))
    return 2.0 + _ASTRAY * radius * scale
