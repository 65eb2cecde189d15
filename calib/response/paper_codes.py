"""What photos of unknown tone curve show of print and sample, as codes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from photogonio.calib.detect.paper import PaperPlaces, PaperSamples, covered, paper_places, sample_paper
from photogonio.calib.geometry.board import board_size, millimetre
from photogonio.calib.geometry.camera import Pose
from photogonio.calib.geometry.print_map import square_pitch
from photogonio.calib.geometry.visibility import behind_ball
from photogonio.calib.setup import Setup, ViewSetup
from photogonio.capture.linear.encoding import Coded
from photogonio.capture.linear.signal import Windows
from photogonio.capture.photoset import GreyPatch, PhotoSet, Plane, View, WhitePatch
from photogonio.capture.radiance import RadianceImage

ReadWindows = Callable[[View, Windows], RadianceImage]
ReadCoded = Callable[[View], Coded | None]

_ACROSS, _APART = 300, 3.0  # samples along the board; radii of mirror balls that they are away from them
_FEWEST, _CELLS = (
    8,
    12,
)  # samples of one square that count, and squares of white print and of black that a photo needs
_FLOOR = 0.15  # of a step between codes: what the mean of many is not better known than
_SHADED, _LIT_BY = (
    1.15,
    1.8,
)  # radii about a ball's shadow, and about its foot, in which paper is not its lamp's alone
_PHOTOS = 16  # that are asked
_SAMPLE_POINTS = 16  # along the sample
# number of the first grey among squares; samples along each, and what of its side is left at the edges
_GREYS, _GREY_SAMPLES, _INNER = 1_000_000, 12, 0.2
_OF_ONE = 1000  # squares of one grey, at most
_WHITES, _PATCHES = 4, 8  # squares of white print that a photo needs where patches help, or of those alone
_STEEPEST = 0.5  # of a ball: cosine to the camera
_GRID = np.linspace(0.0, 1.0, 4096)


@dataclass(frozen=True, slots=True)
class PaperCodes:
    """One photo's print as codes, each the mean over one square of the board, and where its lamp was taken to stand."""

    points: np.ndarray  # (n, 3) world
    white: np.ndarray  # (n,) bool
    code: np.ndarray  # (n, c) fractions of full scale
    noise: np.ndarray  # (n, c) standard error of them
    square: np.ndarray  # (n,) int
    tone: (
        np.ndarray
    )  # (n,) int, which print that is not white: 0 black, else the number of a grey; 0 for white
    aside: np.ndarray  # (n,) of :meth:`calib.geometry.camera.Camera.aside`
    pose: Pose
    light: str
    place: np.ndarray  # (3,) world
    attached: bool  # the lamp moves with the camera
    exposure: float = 1.0  # signal over radiance
    sure: float = np.inf  # standard error of the place, where something else tells it
    millimetre: float = 1.0  # in the unit of length of all places

    @property
    def bright(self) -> np.ndarray:
        """(n,) bool, all but black print."""
        return self.white | (self.tone > 0)

    @property
    def whitest(self) -> np.ndarray:
        """(n,) bool, white print, or what is most like it where there is none."""
        if self.white.any():
            return self.white
        level = self.code.mean(axis=1)
        tones = np.unique(self.tone[self.bright])
        return self.tone == max(tones, key=lambda tone: float(np.median(level[self.tone == tone])))


@dataclass(frozen=True, slots=True)
class CodeReader:
    """How a set's photos are read."""

    windows: ReadWindows
    coded: ReadCoded


def paper_codes(photoset: PhotoSet, setup: Setup, read: CodeReader) -> list[tuple[PaperCodes, np.ndarray]]:
    """Of up to _PHOTOS sample views that show enough print under a near lamp: its codes, and the sample's middle code
    (c,), NaN where it cannot be read."""
    views = {view.name: view for view in photoset.views("sample")}
    near = [one for one in setup.views if one.light.kind == "point"]
    some = np.unique(np.linspace(0, len(near) - 1, min(_PHOTOS, len(near))).astype(int)).tolist()
    found = []
    for one in (near[k] for k in some if near):
        codes = _of_view(photoset, setup, one, views[one.name], read)
        if codes is not None:
            found.append((codes, sample_code(setup, one, views[one.name], read)))
    return found


def _of_view(
    photoset: PhotoSet, setup: Setup, one: ViewSetup, view: View, read: CodeReader
) -> PaperCodes | None:
    coded = read.coded(view)
    if photoset.board is None or coded is None:
        return None
    step = float(board_size(photoset.board).max()) / _ACROSS
    places = paper_places(photoset, setup.camera, one.pose, step=step, apart=_APART)
    samples = None if places is None else sample_paper(places, partial(_near, read.windows, view))
    if samples is None or samples.aside is None:
        return None
    samples = with_greys(samples, photoset, setup, one, partial(_near, read.windows, view))
    samples = samples.keep(_by_its_lamp_alone(samples, setup, one))
    if not len(samples):
        return None
    code = codes_of(samples.value * coded.exposure, coded)
    entry = next((e for e in photoset.lights if e.id == view.light), None)
    attached = entry is not None and entry.attached_to == "camera"
    name = entry.id if entry is not None and attached else one.light.id
    told = one.light.source in ("given", "camera", "markers")
    sure = float(np.sqrt(np.trace(one.light.covariance) / 3)) if told else np.inf
    found = _means(samples, code, coded.steps, one, (name, attached, coded.exposure, sure))
    return None if found is None else replace(found, millimetre=millimetre(photoset))


def _near(windows: ReadWindows, view: View, pixels: np.ndarray) -> RadianceImage:
    return windows(view, Windows(pixels, 0, 1))


def with_greys(
    samples: PaperSamples,
    photoset: PhotoSet,
    setup: Setup,
    one: ViewSetup,
    near: Callable[[np.ndarray], RadianceImage | None],
) -> PaperSamples:
    """The samples, and those of grey print and white patches, each in squares of its own from _GREYS on."""
    width, height = setup.camera.size
    parts = [samples]
    for square, corner, sides, level in _parts_of_greys(photoset):
        flat = corner + _inner_grid() * sides
        points = np.column_stack([flat, np.full(len(flat), level)])
        pixels = setup.camera.project(one.pose, points)
        inside = (pixels > 2).all(1) & (pixels[:, 0] < width - 3) & (pixels[:, 1] < height - 3)
        inside &= ~covered(points, one.pose, setup.sample, photoset.mirror_balls, (), float(sides.max()) / 20)
        if not inside.any():
            continue
        points, pixels = points[inside], pixels[inside]
        aside = setup.camera.aside(pixels)
        own = np.full(len(points), square)
        none = np.zeros(len(points), bool)
        places = PaperPlaces(points, none, pixels, own, np.zeros((len(points), 3)), aside)
        found = sample_paper(places, near)
        parts += [] if found is None else [found]
    names = ("points", "white", "value", "variance", "square", "spread", "aside")
    if len(parts) == 1 or samples.spread is None or samples.aside is None:
        return samples
    return PaperSamples(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _inner_grid() -> np.ndarray:
    """Places (n, 2) on the unit square, clear of its sides."""
    side = np.linspace(_INNER, 1 - _INNER, _GREY_SAMPLES)
    return np.column_stack([part.ravel() for part in np.meshgrid(side, side)])


def _parts_of_greys(photoset: PhotoSet) -> list[tuple[int, np.ndarray, np.ndarray, float]]:
    """Number, lowest corner (2,), sides (2,) and height of each square of them: long ones are many, which their lamp
    lights unevenly."""
    found = []
    pitch = 0.0 if photoset.board is None else float(square_pitch(photoset.board))
    patches: list[GreyPatch | WhitePatch] = [*photoset.grey_patches, *photoset.white_patches]
    for tone, patch in enumerate(patches):
        low, high = patch.outline.min(0), patch.outline.max(0)
        corners = (patch.outline == low) | (patch.outline == high)
        if len(patch.outline) != 4 or not corners.all():
            continue  # turned, or no rectangle: its middle is not that of the box around it
        count = np.maximum(np.round((high - low) / max(pitch, 1e-9)).astype(int), 1)
        sides = (high - low) / count
        for k in range(min(int(count.prod()), _OF_ONE)):
            at = np.array([k % count[0], k // count[0]])
            found.append((_GREYS + _OF_ONE * tone + k, low + at * sides, sides, float(patch.height)))
    return found


def _by_its_lamp_alone(samples: PaperSamples, setup: Setup, one: ViewSetup) -> np.ndarray:
    """Samples (n,) bool that lie in no ball's shadow, nor beside one that throws light on them."""
    points = samples.points
    balls = [(ball.center, ball.radius) for ball in setup.mirror_balls]
    if not isinstance(setup.sample, Plane):
        balls.append((setup.sample.center, setup.sample.radius))
    clear = np.ones(len(points), bool)
    for center, radius in balls:
        clear &= ~behind_ball(points, one.light.place, np.asarray(center, float), _SHADED * radius)
        clear &= np.hypot(*(points[:, :2] - center[:2]).T) > _LIT_BY * radius
    return clear


def codes_of(signal: np.ndarray, coded: Coded) -> np.ndarray:
    """Codes (n, c), fractions of full scale, that were read as ``signal`` (n, c): the inverse of the encoding."""
    channels = signal.shape[1]
    light = coded.encoding.linear(np.repeat(_GRID[:, None], channels, axis=1), channels)
    return np.column_stack([np.interp(signal[:, c], light[:, c], _GRID) for c in range(channels)])


def _means(
    samples: PaperSamples,
    code: np.ndarray,
    steps: float,
    one: ViewSetup,
    lamp: tuple[str, bool, float, float],
) -> PaperCodes | None:
    """Of each square and tone one."""
    kinds, group, count = np.unique(
        samples.square * 2 + samples.white, return_inverse=True, return_counts=True
    )

    def mean(values: np.ndarray) -> np.ndarray:
        return np.stack([np.bincount(group, column) for column in values.T], axis=1) / count[:, None]

    middle = mean(code)
    variance = np.maximum(mean(code**2) - middle**2, 0.0) / count[:, None]
    aside = np.zeros(len(code)) if samples.aside is None else samples.aside
    good, white = count >= _FEWEST, kinds % 2 == 1
    grey = kinds // 2 >= _GREYS
    # where the others show what patches are of white print, one photo may do with them alone
    mixed = (good & white).sum() >= _WHITES and (good & (white | grey)).sum() >= _CELLS
    enough = mixed or (good & grey).sum() >= _PATCHES
    if not enough or (good & ~white & ~grey).sum() < _CELLS:
        return None
    name, attached, exposure, sure = lamp
    return PaperCodes(
        points=mean(samples.points)[good],
        white=white[good],
        code=middle[good],
        noise=np.sqrt(variance + (_FLOOR / steps) ** 2)[good],
        square=(kinds // 2)[good],
        tone=np.maximum((kinds // 2 - _GREYS) // _OF_ONE + 1, 0)[good],
        aside=mean(aside[:, None])[good, 0],
        pose=one.pose,
        light=name,
        place=one.light.place,
        attached=attached,
        exposure=exposure,
        sure=sure,
    )


def sample_code(setup: Setup, one: ViewSetup, view: View, read: CodeReader) -> np.ndarray:
    """The middle code (c,) of the sample where the lamp lights it; NaN where none can be read."""
    points = _on_sample(setup, one)
    coded = read.coded(view)
    unknown = np.full(len(setup.channels), np.nan)
    if coded is None or not len(points):
        return unknown
    pixels = np.floor(setup.camera.project(one.pose, points)).astype(int)
    width, height = setup.camera.size
    inside = (pixels > 2).all(1) & (pixels[:, 0] < width - 3) & (pixels[:, 1] < height - 3)
    if not inside.any():
        return unknown
    shown = read.windows(view, Windows(pixels[inside], 0, 1))
    value, valid = shown.value.reshape(-1, shown.value.shape[-1]), ~shown.saturated.ravel()
    return np.median(codes_of(value[valid] * coded.exposure, coded), axis=0) if valid.any() else unknown


def _on_sample(setup: Setup, one: ViewSetup) -> np.ndarray:
    """Points (n, 3) of it that camera and lamp both see."""
    sample = setup.sample
    side = np.linspace(-0.85, 0.85, _SAMPLE_POINTS)
    x, y = (part.ravel() for part in np.meshgrid(side, side))
    if isinstance(sample, Plane):
        middle, reach = sample.outline.mean(0), np.ptp(sample.outline, axis=0) / 2
        return np.column_stack(
            [middle[0] + x * reach[0], middle[1] + y * reach[1], np.full(len(x), sample.height)]
        )
    across = x**2 + y**2 < 1
    toward = np.column_stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0.0))])[across]
    to_camera = one.pose.center - sample.center
    to_camera /= np.linalg.norm(to_camera)
    aside = np.cross([0.0, 0.0, 1.0] if abs(to_camera[2]) < 0.9 else [1.0, 0.0, 0.0], to_camera)
    aside /= np.linalg.norm(aside)
    normals = toward @ np.stack([aside, np.cross(to_camera, aside), to_camera])
    points = sample.center + sample.radius * normals
    lit = np.einsum("ij,ij->i", normals, one.light.toward(points)[0]) > _STEEPEST
    return points[lit & (normals @ to_camera > _STEEPEST)]


def middle_white(photos: Sequence[PaperCodes]) -> list[np.ndarray]:
    """The middle code (c,) of each photo's white print, or of what is most like it."""
    return [np.median(one.code[one.whitest], axis=0) for one in photos]
