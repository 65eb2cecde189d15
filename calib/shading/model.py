"""The board's light as modelled: what stands on the board, and what a lamp at some place makes of the paper."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.special import ndtr

from photogonio.calib.detect.paper_near_balls import INK, Close
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.geometry.visibility import lit_fraction
from photogonio.calib.shading.interreflection import Thrown
from photogonio.calib.shading.kernel import lens, light_on_board, straight_light
from photogonio.calib.shading.parameters import BALL, EVEN, LOCAL, PATCHES, SHARED, THROWN, TILTS
from photogonio.calib.shading.sights import Sights
from photogonio.capture import robust

_FLOOR = 0.003  # relative error of the model at one place
_SHADOW_FLOOR = 0.03  # the same within a shadow or its edge, over the light beside it
_CLOSE_FLOOR = 0.04  # the same close to a polished ball, whose edge of shadow is small
_CLOSE_LIT = 0.15  # the same in full light there: a polished ball throws light around it
# of how uneven a pixel's print is: a shadow's edge may leave its white side or its black one lit
_UNEVEN = 0.6
_GLARE = 0.002  # of white print's radiance: what reaches black print among it
_DIM = 4.0  # of its noise: what is brighter loses none of it at a code of 0
_MIDDLE = 2000  # samples, about, that tell a median
# logarithm of white patches' light, over their reflectance, over the paper's, and its standard error: paper's own is
# about 0.8
USUAL_PATCHES = (0.22, 0.3)
_STRONGEST = 100.0  # logarithm of a strength: a trial beyond goes astray, and not over the range of numbers


@dataclass(frozen=True, slots=True)
class Ball:
    """A ball that throws a shadow."""

    center: np.ndarray  # (3,)
    radius: float


@dataclass(frozen=True, slots=True)
class ShadingScene:
    """What stands on the board, as far as it changes the board's light."""

    polished: tuple[Ball, ...]
    sample: Ball | None  # a plane sample throws no light and no shadow on the board
    lamp_radius: float
    black: float  # radiance of black print over white
    blur: float  # of a shadow's edge by lens and pixels, length on the board, where no sample tells its own
    soft: float = 0.0  # by which fits widen it besides
    narrow: float = 0.0  # power of the cosine with which the lamp's light falls off beside its axis
    aim: tuple[float, float, float] = (0.0, 0.0, 0.0)  # where that axis points
    error: float = 1.0  # of the model's expected error in shadows, what the set shows
    falloff: tuple[float, float] = (0.0, 0.0)  # of the lens: logarithm's terms in aside and its square
    patches: tuple[float, float] = USUAL_PATCHES  # as all views have it
    ink: float = 0.015  # relative error of black print that is common to a square in full light
    bent: bool = False  # by a tone curve that is not known well: how paper's light falls off is not believed

    def moved(self, shared: np.ndarray) -> ShadingScene:
        """The scene with ``shared`` (SHARED + BALL k,) in place of its own values."""
        sample = None if self.sample is None else Ball(shared[:3], float(shared[3]))
        return replace(
            self,
            polished=tuple(Ball(b[:3], float(b[3])) for b in shared[SHARED:].reshape(-1, BALL)),
            sample=sample,
            lamp_radius=float(np.exp(shared[4])),
            black=float(np.exp(shared[5])),
            narrow=float(shared[6]),
            falloff=(float(shared[7]), float(shared[8])),
        )

    @property
    def shared(self) -> np.ndarray:
        """(SHARED + BALL k,) values that all views have in common, of k polished balls; inverse of :meth:`moved`."""
        sphere = [0.0, 0.0, 0.0, 1.0] if self.sample is None else [*self.sample.center, self.sample.radius]
        polished = [value for b in self.polished for value in (*b.center, b.radius)]
        own = [np.log(self.lamp_radius), np.log(self.black), self.narrow, *self.falloff]
        return np.array([*sphere, *own, *polished])

    @property
    def table(self) -> np.ndarray:
        """(k, 4) centres and radii of all balls, the polished ones first."""
        balls = self.polished + (() if self.sample is None else (self.sample,))
        return np.array([[*b.center, b.radius] for b in balls], float).reshape(-1, 4)


@dataclass(frozen=True, slots=True)
class Weighing:
    """Errors expected at the present values, held while a step is tried, so that costs compare."""

    sigma: np.ndarray  # (n,)
    bound: np.ndarray  # (n,) Tukey's, in sigmas
    share: (
        np.ndarray
    )  # (n,) variance of the model's expected error over sigma's, where shadows tell it; else 0
    thrown: np.ndarray  # (n, 3) the balls' bounce; so smooth in the values that it is held
    place: np.ndarray  # (3,) of the lamp that it was worked out for
    expected: np.ndarray  # (LOCAL - 4,) the local values after the first four, where nothing tells them
    prior: np.ndarray  # (LOCAL - 4,) their standard errors


def lit(points: np.ndarray, light: np.ndarray, scene: ShadingScene) -> np.ndarray:
    """Share of the lamp visible from board points (n, 3), (n,)."""
    blur = float(np.hypot(scene.blur, scene.soft))
    return lit_fraction(points, np.asarray(light, float), scene.lamp_radius, scene.table, blur)


@dataclass(frozen=True, slots=True)
class LitPaper:
    """What of a view's paper stays while its lamp is sought; what is close to polished balls comes after it, and white
    patches last."""

    reading: PaperReading
    points: np.ndarray  # (n, 3)
    white: np.ndarray  # (n,) share of white print
    level: np.ndarray  # (n,) radiance
    noise: np.ndarray  # (n,) its variance
    square: np.ndarray  # (n,) int
    spread: np.ndarray  # (n, 3) covariance xx, xy, yy of what a sample stands for on the board
    aside: np.ndarray  # (n,) how far from the middle of the picture, squared
    floor: np.ndarray  # (2, n) relative error of the model in full light and in shadow
    across: np.ndarray  # (2, n) board coordinates from -1 to 1 over what is seen of it
    crowd: float  # samples of a square
    reflectance: np.ndarray  # (k,) of the last samples, those of patches
    cut: np.ndarray  # (n,) noise of a pixel, radiance, where codes end at 0 and cut it off; else 0
    sights: Sights | None = None  # what highlights say of the lamp
    known: dict[bytes, Thrown] = field(default_factory=dict)  # what balls throw, by their table

    @classmethod
    def of(cls, reading: PaperReading, sights: Sights | None = None) -> LitPaper:
        samples, close = reading.samples, reading.close
        low, high = (end[:, None] for end in reading.span)
        crowd = len(reading.level) / max(len(np.unique(samples.square)), 1)
        spread = np.zeros((len(samples), 3)) if samples.spread is None else samples.spread
        white = samples.white.astype(float)
        aside = np.zeros(len(samples)) if samples.aside is None else samples.aside
        own = [samples.points, white, reading.level, reading.noise, samples.square, spread, aside]
        cut = np.sqrt(samples.variance.mean(axis=1)) * (samples.value.min(initial=1.0) == 0.0)
        floor = np.repeat([[_FLOOR], [_SHADOW_FLOOR]], len(reading.level), axis=1)
        if close is not None:
            more = [close.points, close.white, close.level, close.noise, close.square, close.spread]
            more.append(np.zeros(len(close.level)) if close.aside is None else close.aside)
            own = [np.concatenate(both) for both in zip(own, more, strict=True)]
            floor = np.concatenate([floor, _close_floor(close)], axis=1)
            cut = np.concatenate([cut, np.zeros(len(close.level))])
        reflectance = np.zeros(0)
        if (patches := reading.patches) is not None:
            ones, reflectance = np.ones(len(patches)), patches.reflectance
            more = [
                patches.points,
                ones,
                patches.level,
                patches.noise,
                1 + own[4].max(initial=0) + patches.square,
            ]
            more += [patches.spread, patches.aside]
            own = [np.concatenate(both) for both in zip(own, more, strict=True)]
            floor = np.concatenate([floor, np.outer([_FLOOR, _SHADOW_FLOOR], ones)], axis=1)
            cut = np.concatenate([cut, 0.0 * ones])
        across = (2 * np.ascontiguousarray(own[0][:, :2].T) - low - high) / (high - low)
        points, white, level, noise, square, spread, aside = own
        return cls(
            reading,
            points,
            white,
            level,
            noise,
            square,
            spread,
            aside,
            floor,
            across,
            crowd,
            reflectance,
            cut,
            sights,
        )

    def light(self, values: np.ndarray, scene: ShadingScene) -> LightOnPaper:
        """At ``values`` (LOCAL + shared,)."""
        scene, found = scene.moved(values[LOCAL:]), np.empty((4, len(self.level)))
        strength = float(np.exp(np.clip(values[3], -_STRONGEST, _STRONGEST)))
        lamp = values[:3].copy(), strength, scene.black, scene.lamp_radius
        beam, tilts = (scene.narrow, np.array(scene.aim)), values[TILTS].copy()
        light_on_board(
            self.points,
            self.white,
            self.spread,
            self.across,
            *lamp,
            *beam,
            tilts,
            scene.soft**2 / 4,
            scene.table,
            found,
        )
        if any(scene.falloff):
            found[:3] *= lens(self.aside, scene.falloff)
        if len(self.reflectance):
            found[:3, self.of_patches] *= np.exp(values[PATCHES]) * self.reflectance
        own = slice(len(self.reading.level))
        return LightOnPaper(found, median_ratio(found[1, own], found[0, own]))

    @property
    def of_patches(self) -> slice:
        """Which samples are white patches'."""
        return slice(len(self.level) - len(self.reflectance), len(self.level))

    def even(self, place: np.ndarray, scene: ShadingScene) -> float:
        """Direct light in the middle of the samples of a lamp at ``place`` (3,)."""
        own = self.points[: len(self.reading.level)]
        return float(
            robust.median(straight_light(own[:: _thin(len(own))], place, scene.narrow, np.array(scene.aim)))
        )

    def thrown(self, scene: ShadingScene) -> Thrown:
        """What the scene's balls throw, worked out once for all places of the lamp."""
        balls = scene.table
        key = balls.tobytes()
        if key not in self.known:
            split = len(scene.polished)
            sample = None if scene.sample is None else balls[split]
            self.known[key] = Thrown.onto(self.points, sample, balls[:split])
        return self.known[key]

    def residual(self, light: LightOnPaper, values: np.ndarray, weighing: Weighing) -> np.ndarray:
        """(n,) in standard errors."""
        return (self.level - self.shown(light.radiance(values, weighing.thrown))[0]) / weighing.sigma

    def shown(self, radiance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What ``radiance`` (n,) shows as in the mean, and how much that changes with it: codes that end at 0 have no
        noise below it, so that dark paper, as in shadows, shows more than there is."""
        slope = np.ones(len(radiance))
        if not self.cut.any():
            return radiance, slope
        seen, dim = radiance.copy(), (radiance < _DIM * self.cut) & (self.cut > 0)
        size = radiance[dim] / self.cut[dim]
        slope[dim] = ndtr(size)
        seen[dim] = radiance[dim] * slope[dim] + self.cut[dim] * np.exp(-(size**2) / 2) / np.sqrt(2 * np.pi)
        return seen, slope


def _close_floor(close: Close) -> np.ndarray:
    """Relative error (2, n) of the model in full light and in shadow, close to polished balls."""
    glare = _GLARE * (1.0 - close.white) / np.maximum(close.white, INK)
    return np.stack([_CLOSE_LIT + glare, _CLOSE_FLOOR + glare + _UNEVEN * close.uneven])


@dataclass(frozen=True, slots=True)
class LightOnPaper:
    """The model's factors at some values; radiance = shaded tilt + tone (thrown b + even e)."""

    parts: np.ndarray  # (4, n) the four that follow
    even: float  # direct light in the middle of the samples, before the print

    @property
    def tone(self) -> np.ndarray:
        """(n,) strength, and black print's share of it."""
        return self.parts[0]

    @property
    def bare(self) -> np.ndarray:
        """(n,) direct light, as the print sends it on."""
        return self.parts[1]

    @property
    def shaded(self) -> np.ndarray:
        """(n,) what shadows leave of it."""
        return self.parts[2]

    @property
    def tilt(self) -> np.ndarray:
        return self.parts[3]

    def radiance(self, values: np.ndarray, thrown: np.ndarray) -> np.ndarray:
        return self.shaded * self.tilt + self.tone * (thrown @ values[THROWN] + values[EVEN] * self.even)


def median_ratio(above: np.ndarray, below: np.ndarray) -> float:
    """Median of a ratio, of enough samples to tell it."""
    step = _thin(len(above))
    return float(robust.median(above[::step] / np.maximum(below[::step], np.finfo(float).tiny)))


def _thin(count: int) -> int:
    """Of how many samples one tells a median."""
    return max(1, count // _MIDDLE)
