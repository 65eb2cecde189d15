"""What each photo shows of lamp, sample and paper, once the camera's place is known."""

from __future__ import annotations

import numpy as np

from calib.board import board_size
from calib.camera import Camera
from calib.closeup import close_paper
from calib.highlights import Highlight, ball_box, find_highlight
from calib.looking import Progress, Reader
from calib.paper import sample_paper
from calib.pattern import draw_print
from calib.plane import Edges, plane_edges
from calib.sample import Limb, focal, settled_limb
from calib.shading import Reading
from calib.sight import FIXED_POSE, Sight
from calib.starts import local_noise
from calib.tone import without_fireflies
from capture.photoset import MirrorBall, PhotoSet, Plane, Sphere

_ACROSS = 170  # paper samples along the board's longer side
_ACROSS_LOOSE = 300  # the same where only loose markers are known to be paper
_CAUSTIC = 3.0  # radii around a polished ball where it throws light back onto the paper
_FEWEST = 400  # samples of paper worth a fit
_DARK = 3.0  # standard errors of one sample of paper
_PILED = 16  # photos of a still camera that are laid over one another
_FARTHEST_EDGE = 3.0  # pixels that a flat sample's edge is looked for aside
_DIMMEST = 0.03  # of the brightest highlight: one and the same lamp in another ball
_ASTRAY = 0.04  # of the radius: how far a sample ball may stand from the manifest's place


def observe(
    photoset: PhotoSet,
    reader: Reader,
    camera: Camera,
    sights: list[Sight],
    balls: tuple[MirrorBall, ...],
    tell: Progress,
) -> None:
    """Fill in highlights, limbs and paper of every sight."""
    still = len(sights) > 1 and all(s.pose_block == FIXED_POSE for s in sights)
    brightest, middle = _Pile("max"), _Pile("median")

    def watch(sight: Sight) -> tuple[np.ndarray, np.ndarray] | None:
        found = [_highlight(reader, camera, sight, ball, number) for number, ball in enumerate(balls)]
        sight.highlights = of_one_lamp([h for h in found if h is not None], balls)
        if not sight.probe:
            sight.reading = _paper(photoset, reader, camera, sight)
            sight.dark = sight.reading is not None and is_dark(sight.reading)
        if sight.dark:
            return None
        level = reader.level(sight.view) if still or not sight.probe else None
        if level is None:
            return None
        shown = without_fireflies(level[0]), np.isfinite(level[0])  # what is saturated has edges too
        if isinstance(photoset.sample, Plane) and not sight.probe:
            sight.edges = _sample_edges(photoset, photoset.sample, *shown, camera, sight)
        return shown

    for k, (sight, shown) in enumerate(zip(sights, reader.abreast(watch, sights), strict=True)):
        if shown is not None and still:
            (middle if sight.probe else brightest).add(sight, *shown)
        elif shown is not None:
            sight.limb = _sample_limb(photoset, *shown, camera, sight)
        tell("finding lamps, sample and paper", k + 1, len(sights))
    if brightest.sight is not None:
        brightest.sight.limb = _sample_limb(photoset, *brightest.picture(), camera, brightest.sight)
    if middle.sight is not None:
        middle.sight.ball_limbs = _ball_limbs(balls, *middle.picture(), camera, middle.sight)


class _Pile:
    """Photos of a still camera laid over one another: what no single lamp shows shows in all of them together."""

    def __init__(self, how: str):
        self.sight: Sight | None = None  # the first, which what is found will be booked on
        self._how = how
        self._levels: list[np.ndarray] = []
        self._usable: np.ndarray | None = None

    def add(self, sight: Sight, level: np.ndarray, usable: np.ndarray) -> None:
        self.sight = self.sight or sight
        self._usable = usable if self._usable is None else self._usable & usable
        if self._how == "max" and self._levels:
            np.maximum(self._levels[0], level, out=self._levels[0])
        elif len(self._levels) < _PILED:
            self._levels.append(level)

    def picture(self) -> tuple[np.ndarray, np.ndarray]:
        """Radiance (h, w) float32 and usable pixels of the pile."""
        if len(self._levels) == 1:
            return self._levels[0], self._usable
        return np.median(self._levels, axis=0).astype(np.float32), self._usable


def _highlight(
    reader: Reader, camera: Camera, sight: Sight, ball: MirrorBall, number: int
) -> Highlight | None:
    x0, y0, x1, y1 = box = ball_box(camera, sight.pose, ball)
    image = reader.part(sight.view, box) if x0 < x1 and y0 < y1 else None
    return None if image is None else find_highlight(image, camera, sight.pose, ball, number)


def of_one_lamp(found: list[Highlight], balls: tuple[MirrorBall, ...]) -> list[Highlight]:
    """Those that may be the same lamp: a ball that does not show it shows something else, many times dimmer.

    Dimmer as it is, as a lamp that is resolved would be, and over the ball's radius squared, with which an image's area
    goes.
    """
    peak = np.array([h.peak for h in found])
    spread = np.array([h.peak / balls[h.ball].radius ** 2 for h in found])
    share = [max(p / peak.max(), s / spread.max()) for p, s in zip(peak, spread, strict=True)]
    return [h for h, bright in zip(found, share, strict=True) if h.clipped or bright > _DIMMEST]


def _paper(photoset: PhotoSet, reader: Reader, camera: Camera, sight: Sight) -> Reading | None:
    board = photoset.board
    if board is None:
        return None
    samples = sample_paper(
        board,
        lambda pixels: reader.near(sight.view, pixels),
        camera,
        sight.pose,
        step=float(board_size(board).max()) / (_ACROSS_LOOSE if board.kind == "markers" else _ACROSS),
        sample=photoset.sample,
        balls=photoset.mirror_balls,
        patches=photoset.white_patches,
    )
    if samples is None:
        return None
    clear = np.ones(len(samples), bool)
    for ball in photoset.mirror_balls:
        clear &= np.hypot(*(samples.points[:, :2] - ball.center[:2]).T) > _CAUSTIC * ball.radius
    samples = samples.keep(clear)
    if len(samples) < _FEWEST:
        return None
    level = samples.value.mean(axis=1)
    noise = samples.variance.mean(axis=1) / samples.variance.shape[1]
    close = close_paper(
        board,
        lambda pixels: reader.near(sight.view, pixels),
        camera,
        sight.pose,
        sample=photoset.sample,
        balls=photoset.mirror_balls,
        patches=photoset.white_patches,
    )
    noise = np.maximum(noise, (local_noise(samples, level) * level) ** 2)
    return Reading(samples, level, noise, close=close)


def is_dark(reading: Reading) -> bool:
    """Whether nothing stands out of the noise, of neither the white print's brightest tenth nor all paper's: a lamp
    that failed, a lens cap.

    Either alone may mislead: seen at a slant a board yields ten black samples for each white one, and in a small
    picture the few white ones may all lie in a shadow.
    """
    lit, white = reading.level > _DARK * np.sqrt(reading.noise), reading.samples.white
    return all(float(np.mean(one)) < 0.1 for one in (lit, lit[white]) if len(one))


def _sample_limb(
    photoset: PhotoSet, level: np.ndarray, usable: np.ndarray, camera: Camera, sight: Sight
) -> Limb | None:
    sample = photoset.sample
    if not isinstance(sample, Sphere):
        return None
    center = np.asarray(sample.center, float)
    within = 2.0 + _ASTRAY * sample.radius * _scale(camera, sight, center)
    return settled_limb(level, usable, camera, sight.pose, center, sample.radius, within)


def _sample_edges(
    photoset: PhotoSet, plane: Plane, level: np.ndarray, usable: np.ndarray, camera: Camera, sight: Sight
) -> Edges | None:
    flat = np.asarray(plane.outline, float)
    middle = np.append(flat.mean(0), plane.height)
    astray = _ASTRAY / 2 * float(np.ptp(flat, axis=0).max()) * _scale(camera, sight, middle)
    within = min(2.0 + astray, _FARTHEST_EDGE)
    board = photoset.board  # what is printed around loose markers is not known
    pattern = None if board is None or board.kind == "markers" else draw_print(board)
    return plane_edges(level, usable, camera, sight.pose, plane, within, pattern)


def _ball_limbs(
    balls: tuple[MirrorBall, ...], level: np.ndarray, usable: np.ndarray, camera: Camera, sight: Sight
) -> dict[int, Limb]:
    """Limbs of the mirror balls by number, where they stand out of what is behind them."""
    limbs = {}
    for number, ball in enumerate(balls):
        center = np.asarray(ball.center, float)
        within = 2.0 + _ASTRAY * ball.radius * _scale(camera, sight, center)
        limb = settled_limb(level, usable, camera, sight.pose, center, ball.radius, within)
        if limb is not None:
            limbs[number] = limb
    return limbs


def _scale(camera: Camera, sight: Sight, center: np.ndarray) -> float:
    """Pixels per length unit at a place."""
    return focal(camera) / float(np.linalg.norm(sight.pose.apply(center)))
