"""The lamp's place from how it lights the board: falloff, angle, and the shadows of balls of known place.

On a flat diffuse print the radiance is rho S z / r^3 (z the lamp's height), so the pattern of light over the board
tells where the lamp is. Light that the sample throws onto the board is modelled and its amount fitted along.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from photogonio.calib.detect.paper import PaperSamples
from photogonio.calib.detect.paper_near_balls import INK, Close
from photogonio.calib.geometry.visibility import direct, lit_fraction
from photogonio.calib.shading.derivatives import slopes
from photogonio.calib.shading.interreflection import Thrown
from photogonio.calib.shading.kernel import lens, light_on_board, straight_light
from photogonio.calib.shading.model_error import Shown, shown
from photogonio.calib.shading.parameters import BALL, EVEN, LOCAL, SHARED, THROWN, TILTS

_FLOOR = 0.003  # relative error of the model at one place
_SHADOW_FLOOR = 0.03  # the same within a shadow or its edge, over the light beside it
_CLOSE_FLOOR = 0.04  # the same close to a polished ball, whose edge of shadow is small
_CLOSE_LIT = 0.15  # the same in full light there: a polished ball throws light around it
# of how uneven a pixel's print is: a shadow's edge may leave its white side or its black one lit
_UNEVEN = 0.6
_GLARE = 0.002  # of white print's radiance: what reaches black print among it
_BOUNCE_ERROR = 0.2  # relative error of the modelled bounce, common to a square
_TUKEY = 5.0
_STEPS = 15
_PRIOR = np.array([0.3, 1.0, 0.0, 0.0, 0.0, 0.5])  # of the local values after the first four
_IS_EVEN = np.arange(4, LOCAL) == EVEN
_PRIOR_SIGMA = np.array([0.3, 1.0, 0.0005])  # of the first three of them; even light looks like a nearer lamp
# least and most of what balls throw, for its error
_PLAUSIBLE = np.array([[0.15, 0.5, 0.0], [0.6, 2.0, 1.0]])
_POLISHED = 0.5  # of the last: chrome, steel, a silvered ball
_EVEN_PLANE = 0.01  # the last with a flat sample, whose own bounce is not modelled
_EVEN_ANY = 0.3  # the last where nothing is taken for granted
_SLOPE = 0.001  # relative, over half the board: how even paper and lens are
_SLOPE_BOUNCE = 0.15  # of the bounce over the direct light: what its model may tilt
_SLOPE_BEAM = 0.02  # for each power of the cosine: a beam whose axis passes by the sample by some degrees
_HELD = 0.003  # of the lamp's distance: a smaller move changes the bounce, a few per cent of the light, by about 1 %
_MIDDLE = 2000  # samples, about, that tell a median


@dataclass(frozen=True, slots=True)
class Ball:
    """A ball that throws a shadow."""

    center: np.ndarray  # (3,)
    radius: float


@dataclass(frozen=True, slots=True)
class Scene:
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

    def moved(self, shared: np.ndarray) -> Scene:
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
class Reading:
    """One view's paper in gray."""

    samples: PaperSamples
    level: np.ndarray  # (n,) radiance
    noise: np.ndarray  # (n,) its variance
    beside: tuple[float, float] = (
        0.0,
        0.0,
    )  # white paper's radiance without the lamp, where known, and its error
    close: Close | None = None  # paper close to polished balls

    @property
    def span(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest x and y, (2,) each, of the paper that is seen: from -1 to 1 go the tilts of its light."""
        flat = self.samples.points[:, :2]
        return flat.min(0), flat.max(0)


@dataclass(frozen=True, slots=True)
class ShadingFit:
    """One view's shading: the lamp, and what it says about it and what it shares with the other views."""

    local: np.ndarray  # (LOCAL,)
    normal: np.ndarray  # (LOCAL + shared,) * 2 information matrix, deflated for errors common to a square
    gradient: np.ndarray  # (LOCAL + shared,) of half the weighted squares, likewise
    rms: float  # relative to the direct light, of the samples believed
    believed: float  # share of the samples
    cost: float  # mean robust loss
    level: float  # of white paper by the lamp alone, in the middle of the board's samples, radiance
    beside: np.ndarray  # (2,) the same by light that is everywhere, as the paper alone has it, and its error
    shown: Shown  # of the model's error in shadows

    @property
    def place(self) -> np.ndarray:
        return self.local[:3]

    def covariance(self) -> np.ndarray:
        """(3, 3) of the place with the shared values held."""
        return np.linalg.inv(self.normal[:LOCAL, :LOCAL])[:3, :3]


@dataclass(frozen=True, slots=True)
class _Weighing:
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


def lit(points: np.ndarray, light: np.ndarray, scene: Scene) -> np.ndarray:
    """Share of the lamp visible from board points (n, 3), (n,)."""
    blur = float(np.hypot(scene.blur, scene.soft))
    return lit_fraction(points, np.asarray(light, float), scene.lamp_radius, scene.table, blur)


@dataclass(frozen=True, slots=True)
class _Board:
    """What of a view's paper stays while its lamp is sought; what is close to polished balls comes last."""

    reading: Reading
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
    known: dict[bytes, Thrown] = field(default_factory=dict)  # what balls throw, by their table

    @classmethod
    def of(cls, reading: Reading) -> _Board:
        samples, close = reading.samples, reading.close
        low, high = (end[:, None] for end in reading.span)
        crowd = len(reading.level) / max(len(np.unique(samples.square)), 1)
        spread = np.zeros((len(samples), 3)) if samples.spread is None else samples.spread
        white = samples.white.astype(float)
        aside = np.zeros(len(samples)) if samples.aside is None else samples.aside
        own = [samples.points, white, reading.level, reading.noise, samples.square, spread, aside]
        floor = np.repeat([[_FLOOR], [_SHADOW_FLOOR]], len(reading.level), axis=1)
        if close is not None:
            more = [close.points, close.white, close.level, close.noise, close.square, close.spread]
            more.append(np.zeros(len(close.level)) if close.aside is None else close.aside)
            own = [np.concatenate(both) for both in zip(own, more, strict=True)]
            floor = np.concatenate([floor, _close_floor(close)], axis=1)
        across = (2 * np.ascontiguousarray(own[0][:, :2].T) - low - high) / (high - low)
        return cls(reading, *own, floor, across, crowd)

    def light(self, values: np.ndarray, scene: Scene) -> _Light:
        """At ``values`` (LOCAL + shared,)."""
        scene, found = scene.moved(values[LOCAL:]), np.empty((4, len(self.level)))
        lamp = values[:3].copy(), float(np.exp(values[3])), scene.black, scene.lamp_radius
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
        own = slice(len(self.reading.level))
        return _Light(found, _middle(found[1, own], found[0, own]))

    def even(self, place: np.ndarray, scene: Scene) -> float:
        """Direct light in the middle of the samples of a lamp at ``place`` (3,)."""
        own = self.points[: len(self.reading.level)]
        return float(
            np.median(straight_light(own[:: _thin(len(own))], place, scene.narrow, np.array(scene.aim)))
        )

    def thrown(self, scene: Scene) -> Thrown:
        """What the scene's balls throw, worked out once for all places of the lamp."""
        balls = scene.table
        key = balls.tobytes()
        if key not in self.known:
            split = len(scene.polished)
            sample = None if scene.sample is None else balls[split]
            self.known[key] = Thrown.onto(self.points, sample, balls[:split])
        return self.known[key]

    def residual(self, light: _Light, values: np.ndarray, weighing: _Weighing) -> np.ndarray:
        """(n,) in standard errors."""
        return (self.level - light.radiance(values, weighing.thrown)) / weighing.sigma


def _close_floor(close: Close) -> np.ndarray:
    """Relative error (2, n) of the model in full light and in shadow, close to polished balls."""
    glare = _GLARE * (1.0 - close.white) / np.maximum(close.white, INK)
    return np.stack([_CLOSE_LIT + glare, _CLOSE_FLOOR + glare + _UNEVEN * close.uneven])


@dataclass(frozen=True, slots=True)
class _Light:
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


def _middle(above: np.ndarray, below: np.ndarray) -> float:
    """Median of a ratio, of enough samples to tell it."""
    step = _thin(len(above))
    return float(np.median(above[::step] / below[::step]))


def _thin(count: int) -> int:
    """Of how many samples one tells a median."""
    return max(1, count // _MIDDLE)


def _weigh(
    board: _Board, values: np.ndarray, scene: Scene, light: _Light, last: _Weighing | None = None
) -> tuple[_Weighing, np.ndarray]:
    """The errors, and the residual (n,) in them. ``last``, of the same shared values, has the bounce where the lamp
    has hardly moved since."""
    reading, now = board.reading, scene.moved(values[LOCAL:])
    place = values[:3].copy()
    if last is not None and np.linalg.norm(place - last.place) < _HELD * np.linalg.norm(place):
        thrown, place = last.thrown, last.place
    else:
        thrown = board.thrown(now).of(place)
    indirect = light.tone * (thrown @ np.clip(values[THROWN], *_PLAUSIBLE))
    sigma, most, share = _errors(board, light, indirect, scene.error)
    own = slice(len(reading.level))
    slope = _SLOPE + _SLOPE_BEAM * max(now.narrow, 0.0)
    bounced = _middle(indirect[own], np.maximum(light.bare[own], 1e-300))
    slope = float(np.hypot(slope, _SLOPE_BOUNCE * bounced))
    prior = np.concatenate([_PRIOR_SIGMA, [slope, slope, _POLISHED]])
    if now.sample is None:
        prior[2] = _EVEN_PLANE
    beside = np.array(reading.beside) / (np.exp(values[3]) * light.even)
    expected, prior[2] = np.where(_IS_EVEN, beside[0], _PRIOR), np.hypot(prior[2], beside[1])
    residual = (board.level - light.radiance(values, thrown)) / sigma
    bound = _TUKEY * max(1.4826 * float(np.median(np.abs(residual))), 1.0) * most
    return _Weighing(sigma, bound, share, thrown, place, expected, prior), residual


def _errors(
    board: _Board, light: _Light, indirect: np.ndarray, factor: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Standard errors (n,) where the model's in shadows is ``factor`` of what is expected; how many times larger they
    may be at most, which tells what is no error but dirt; and the share of the expected one, where that is much."""
    shade, far = light.shaded < 0.99 * light.bare, np.arange(len(light.bare)) < len(board.reading.level)
    floor = (np.where(shade, board.floor[1], board.floor[0]) * light.bare) ** 2
    most = board.noise + floor + board.crowd * (_BOUNCE_ERROR * indirect) ** 2
    told = np.where(shade & far, floor, 0.0)
    variance = most - (1 - factor**2) * told
    least = np.sqrt(np.maximum(most / variance, 1.0))
    return np.sqrt(variance), least, np.where(told > most / 2, told / variance, 0.0)


def _cost(residual: np.ndarray, values: np.ndarray, weighing: _Weighing) -> float:
    """Half the sum of Tukey's loss and of the priors."""
    outside = 1 - np.minimum((residual / weighing.bound) ** 2, 1)
    prior = (values[4:LOCAL] - weighing.expected) / weighing.prior
    lost = float(np.sum(weighing.bound**2 * (1 - outside * outside * outside))) / 6
    return lost + 0.5 * float(prior @ prior)


def fit_shading(reading: Reading, scene: Scene, start: np.ndarray, steps: int = _STEPS) -> ShadingFit:
    """Fit one view's lamp from ``start``: a place (3,), or the local values (LOCAL,) of an earlier fit.

    Levenberg-Marquardt with Tukey's weights on the local values; the shared ones stay and get derivatives.
    """
    board = _Board.of(reading)
    values, light = _fitted(board, scene, start, steps)
    return _finish(board, values, scene, light)


def fit_local(reading: Reading, scene: Scene, start: np.ndarray) -> np.ndarray:
    """The local values (LOCAL,) of :func:`fit_shading` alone."""
    return _fitted(_Board.of(reading), scene, start, _STEPS)[0][:LOCAL]


def _fitted(board: _Board, scene: Scene, start: np.ndarray, steps: int) -> tuple[np.ndarray, _Light]:
    """All values where the fit ends, and the light there."""
    local = start if len(start) == LOCAL else start_values(board.reading, scene, start)
    values = np.concatenate([local, scene.shared])
    damping, weighing = 1e-3, None
    light = board.light(values, scene)
    for _ in range(steps):
        weighing, residual = _weigh(board, values, scene, light, weighing)
        normal, slope, _ = _normal(board, values, scene, light, weighing, residual, LOCAL)
        moved = _step(board, values, scene, weighing, normal, slope, residual, damping)
        if moved is None:
            break
        step, light, damping = moved
        values[:LOCAL] += step
        if step @ normal @ step < 1e-3:
            break
    return values, light


def fits_better(reading: Reading, scene: Scene, one: ShadingFit, other: ShadingFit) -> bool:
    """Whether ``one`` explains the reading better than ``other``, under errors that are the same for both: each fit's
    own grow with the bounce that it supposes, which makes a wrong place with much of it look good."""
    values = [np.concatenate([fit.local, scene.shared]) for fit in (one, other)]
    board = _Board.of(reading)
    lights = [board.light(each, scene) for each in values]
    own = [_weigh(board, each, scene, light)[0] for each, light in zip(values, lights, strict=True)]
    sigma, bound = np.sqrt(own[0].sigma * own[1].sigma), np.maximum(own[0].bound, own[1].bound)
    alike = [replace(weighing, sigma=sigma, bound=bound) for weighing in own]
    first, second = (
        _cost(board.residual(light, each, weighing), each, weighing)
        for each, light, weighing in zip(values, lights, alike, strict=True)
    )
    return first < second


def _step(
    board: _Board,
    values: np.ndarray,
    scene: Scene,
    weighing: _Weighing,
    normal: np.ndarray,
    slope: np.ndarray,
    residual: np.ndarray,
    damping: float,
) -> tuple[np.ndarray, _Light, float] | None:
    """A damped step (LOCAL,) that lowers the cost, the light after it, and the next damping; None if there is none."""
    cost = _cost(residual, values, weighing)
    while damping < 1e8:
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -slope)
        tried = values.copy()
        tried[:LOCAL] += step
        if tried[2] > 0:
            light = board.light(tried, scene)
            if _cost(board.residual(light, tried, weighing), tried, weighing) <= cost:
                return step, light, max(damping / 8, 1e-9)
        damping *= 8
    return None


def start_values(reading: Reading, scene: Scene, place: np.ndarray) -> np.ndarray:
    """(LOCAL,) values at a light's place: the strength as the median over what is lit."""
    values = np.concatenate([place, [0.0], _PRIOR, scene.shared])
    points = reading.samples.points
    model = direct(points, place) * np.where(reading.samples.white, 1.0, scene.black)
    chosen = (lit(points, place, scene) > 0.9) & (model > 0)
    strength = float(np.median(reading.level[chosen] / model[chosen])) if chosen.any() else 1.0
    values[3] = np.log(max(strength, 1e-300))
    return values[:LOCAL]


def _normal(
    board: _Board,
    values: np.ndarray,
    scene: Scene,
    light: _Light,
    weighing: _Weighing,
    residual: np.ndarray,
    count: int,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normal matrix and slope of the first ``count`` values, and the samples' weighted scores by the local ones,
    (LOCAL, n)."""
    design = slopes(board, values, scene, light, weighing.thrown, count)
    weight = 1 - np.minimum((residual / weighing.bound) ** 2, 1)
    design *= weight / weighing.sigma
    normal, slope = design @ design.T, -design @ (weight * residual)
    score = design[:LOCAL] * weight
    for k in range(4, LOCAL):
        normal[k, k] += weighing.prior[k - 4] ** -2.0
        slope[k] += (values[k] - weighing.expected[k - 4]) * weighing.prior[k - 4] ** -2.0
    return normal, slope, score


def _finish(board: _Board, values: np.ndarray, scene: Scene, light: _Light) -> ShadingFit:
    weighing, residual = _weigh(board, values, scene, light)
    normal, slope, score = _normal(board, values, scene, light, weighing, residual, len(values))
    inflation = _inflation(normal[:4, :4], score[:4] * residual, board.square)
    own = slice(len(board.reading.level))
    inlier = (np.abs(residual) < 0.7 * weighing.bound)[own]
    relative = (residual * weighing.sigma / np.maximum(light.bare, 1e-300))[own][inlier]
    rms = float(np.sqrt(np.mean(relative**2))) if inlier.any() else float("nan")
    cost = _cost(residual, values, weighing) / len(residual)
    even = _even_alone(values, normal[:LOCAL, :LOCAL], slope[:LOCAL], weighing)
    share = even * [1.0, np.sqrt(inflation)]
    level = float(np.exp(values[3]) * light.even)
    believed = float(inlier.mean())
    told = weighing.share > 0
    seen = shown(
        score[:LOCAL, told],
        residual[told],
        normal[:LOCAL, :LOCAL],
        board.square[told],
        weighing.share[told],
        scene.error,
    )
    return ShadingFit(
        values[:LOCAL], normal / inflation, slope / inflation, rms, believed, cost, level, share * level, seen
    )


def _even_alone(values: np.ndarray, normal: np.ndarray, slope: np.ndarray, weighing: _Weighing) -> np.ndarray:
    """(2,) even light as it would be without its narrow prior, and its standard error: one more step."""
    freed, pulled = normal.copy(), slope.copy()
    held = weighing.prior[2] ** -2.0
    freed[EVEN, EVEN] += _EVEN_ANY**-2.0 - held
    pulled[EVEN] += values[EVEN] * _EVEN_ANY**-2.0 - (values[EVEN] - weighing.expected[2]) * held
    inverse = np.linalg.pinv(freed, hermitian=True)
    return np.array([values[EVEN] - inverse[EVEN] @ pulled, np.sqrt(inverse[EVEN, EVEN])])


def _inflation(normal: np.ndarray, each: np.ndarray, square: np.ndarray) -> float:
    """How much larger the variance is than for independent samples: squares' summed scores against theirs."""
    summed = np.stack([np.bincount(square, one) for one in each])
    return max(float(np.trace(np.linalg.pinv(normal) @ (summed @ summed.T)) / len(each)), 1.0)
