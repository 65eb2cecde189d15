"""The lamp's place from how it lights the board: falloff, angle, and the shadows of balls of known place.

On a flat diffuse print the radiance is rho S z / r^3 (z the lamp's height), so the pattern of light over the board
tells where the lamp is. Light that the sample throws onto the board is modelled and its amount fitted along.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from calib.bounce import bounce_columns
from calib.occlusion import direct, lit_fraction
from calib.paper import PaperSamples

LOCAL = 9  # x, y, z, log strength of white, diffuse bounce, glossy bounce, even light, slopes along x and y
SHARED = 6  # sample x, y, z and radius, log lamp radius, log of black over white
_FLOOR = 0.003  # relative error of the model at one place
_SHADOW_FLOOR = 0.03  # the same within a shadow or its edge, over the light beside it
_BOUNCE_ERROR = 0.2  # relative error of the modelled bounce, common to a square
_TUKEY = 5.0
_STEPS = 15
_PRIOR = np.array([0.3, 1.0, 0.0, 0.0, 0.0])  # of the local values after the first four
_PRIOR_SIGMA = np.array([0.3, 1.0, 0.0005])  # of the first three of them; even light looks like a nearer lamp
_EVEN_PLANE = 0.01  # the last with a flat sample, whose own bounce is not modelled
_EVEN_ANY = 0.3  # the last where nothing is taken for granted
_SLOPE = 0.001  # relative, over half the board: how even paper and lens are
_SLOPE_BOUNCE = 0.15  # of the bounce over the direct light: what its model may tilt
_HELD = 0.003  # of the lamp's distance: a smaller move changes the bounce, a few per cent of the light, by about 1 %
_STEP = 1e-4  # for derivatives: of the lamp's distance, in length units of the sample, of the logarithm
_MOVING = (0, 1, 2, *range(LOCAL, LOCAL + SHARED - 1))  # values whose derivatives need differences


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
    blur: float  # of a shadow's edge by lens and pixels, length on the board

    def moved(self, shared: np.ndarray) -> Scene:
        """The scene with ``shared`` (SHARED,) in place of its own values."""
        sample = None if self.sample is None else Ball(shared[:3], float(shared[3]))
        return replace(
            self, sample=sample, lamp_radius=float(np.exp(shared[4])), black=float(np.exp(shared[5]))
        )

    @property
    def shared(self) -> np.ndarray:
        """(SHARED,) values that all views have in common; inverse of :meth:`moved`."""
        sphere = [0.0, 0.0, 0.0, 1.0] if self.sample is None else [*self.sample.center, self.sample.radius]
        return np.array([*sphere, np.log(self.lamp_radius), np.log(self.black)])


@dataclass(frozen=True, slots=True)
class Reading:
    """One view's paper in gray."""

    samples: PaperSamples
    level: np.ndarray  # (n,) radiance
    noise: np.ndarray  # (n,) its variance


@dataclass(frozen=True, slots=True)
class ShadingFit:
    """One view's shading: the lamp, and what it says about it and what it shares with the other views."""

    local: np.ndarray  # (LOCAL,)
    normal: np.ndarray  # (LOCAL + SHARED,) * 2 information matrix, deflated for errors common to a square
    gradient: np.ndarray  # (LOCAL + SHARED,) of half the weighted squares, likewise
    rms: float  # relative to the direct light, of the samples believed
    believed: float  # share of the samples
    cost: float  # mean robust loss
    level: float  # of white paper by the lamp alone, in the middle of the board's samples, radiance
    beside: np.ndarray  # (2,) the same by light that is everywhere, as the paper alone has it, and its error

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
    bound: float  # Tukey's, in sigmas
    thrown: np.ndarray  # (n, 2) the sample's bounce
    place: np.ndarray  # (3,) of the lamp that it was worked out for
    across: np.ndarray  # (n, 2) board coordinates from -1 to 1
    prior: np.ndarray  # (LOCAL - 4,) standard errors of the local values after the first four


def lit(points: np.ndarray, light: np.ndarray, scene: Scene) -> np.ndarray:
    """Share of the lamp visible from board points (n, 3), (n,)."""
    balls = scene.polished + (() if scene.sample is None else (scene.sample,))
    table = np.array([[*b.center, b.radius] for b in balls], float).reshape(-1, 4)
    return lit_fraction(points, np.asarray(light, float), scene.lamp_radius, table, scene.blur)


@dataclass(frozen=True, slots=True)
class _Parts:
    """The model's factors at some values; radiance = tone (straight share tilt + thrown b + even e)."""

    tone: np.ndarray  # (n,) strength, and black print's share of it
    straight: np.ndarray  # (n,) direct light
    share: np.ndarray  # (n,) of the lamp that is seen
    tilt: np.ndarray  # (n,)
    even: float

    def radiance(self, values: np.ndarray, thrown: np.ndarray) -> np.ndarray:
        return self.tone * (
            self.straight * self.share * self.tilt + thrown @ values[4:6] + values[6] * self.even
        )


def _parts(reading: Reading, values: np.ndarray, scene: Scene, across: np.ndarray) -> _Parts:
    points, scene = reading.samples.points, scene.moved(values[LOCAL:])
    straight = direct(points, values[:3])
    tone = np.where(reading.samples.white, 1.0, scene.black) * np.exp(values[3])
    share = lit(points, values[:3], scene)
    return _Parts(tone, straight, share, 1 + across @ values[7:9], float(np.median(straight)))


def _model(reading: Reading, values: np.ndarray, scene: Scene, weighing: _Weighing) -> np.ndarray:
    """Radiance (n,) at ``values`` (LOCAL + SHARED,); the bounce is so smooth in them that it is held."""
    return _parts(reading, values, scene, weighing.across).radiance(values, weighing.thrown)


def _across(points: np.ndarray) -> np.ndarray:
    """Board coordinates (n, 2) from -1 to 1 over what is seen of it."""
    flat = np.ascontiguousarray(points[:, :2].T)
    low, high = flat.min(1), flat.max(1)
    return (2 * points[:, :2] - low - high) / (high - low)


def _weigh(reading: Reading, values: np.ndarray, scene: Scene, last: _Weighing | None = None) -> _Weighing:
    """``last``, of the same shared values, has the bounce where the lamp has hardly moved since."""
    points, samples = reading.samples.points, reading.samples
    now, across = scene.moved(values[LOCAL:]), _across(points)
    thrown, place = np.zeros((len(points), 2)), values[:3].copy()
    if last is not None and np.linalg.norm(place - last.place) < _HELD * np.linalg.norm(place):
        thrown, place = last.thrown, last.place
    elif now.sample is not None:
        thrown = bounce_columns(points, place, now.sample.center, now.sample.radius)
    parts = _parts(reading, values, scene, across)
    bare = parts.tone * parts.straight
    floor = np.where(parts.share < 0.99, _SHADOW_FLOOR, _FLOOR) * bare
    crowd = len(points) / max(len(np.unique(samples.square)), 1)
    indirect = parts.tone * (thrown @ np.clip(values[4:6], _PRIOR[:2] / 2, 2 * _PRIOR[:2]))
    sigma = np.sqrt(reading.noise + floor**2 + crowd * (_BOUNCE_ERROR * indirect) ** 2)
    slope = _SLOPE + _SLOPE_BOUNCE * float(np.median(indirect / np.maximum(bare, 1e-300)))
    prior = np.concatenate([_PRIOR_SIGMA, [slope, slope]])
    if now.sample is None:
        prior[2] = _EVEN_PLANE
    residual = (reading.level - parts.radiance(values, thrown)) / sigma
    bound = _TUKEY * max(1.4826 * float(np.median(np.abs(residual))), 1.0)
    return _Weighing(sigma, bound, thrown, place, across, prior)


def _residual(reading: Reading, values: np.ndarray, scene: Scene, weighing: _Weighing) -> np.ndarray:
    return (reading.level - _model(reading, values, scene, weighing)) / weighing.sigma


def _cost(residual: np.ndarray, values: np.ndarray, weighing: _Weighing) -> float:
    """Half the sum of Tukey's loss and of the priors."""
    inside = np.clip((residual / weighing.bound) ** 2, 0, 1)
    prior = (values[4:LOCAL] - _PRIOR) / weighing.prior
    return float(weighing.bound**2 / 6 * np.sum(1 - (1 - inside) ** 3) + 0.5 * prior @ prior)


def fit_shading(reading: Reading, scene: Scene, start: np.ndarray, steps: int = _STEPS) -> ShadingFit:
    """Fit one view's lamp from ``start``: a place (3,), or the local values (LOCAL,) of an earlier fit.

    Levenberg-Marquardt with Tukey's weights on the local values; the shared ones stay and get derivatives.
    """
    local = start if len(start) == LOCAL else start_values(reading, scene, start)
    values = np.concatenate([local, scene.shared])
    damping, weighing = 1e-3, None
    for _ in range(steps):
        weighing = _weigh(reading, values, scene, weighing)
        residual = _residual(reading, values, scene, weighing)
        cost = _cost(residual, values, weighing)
        normal, slope, _ = _normal(reading, values, scene, weighing, residual, LOCAL)
        moved = _step(reading, values, scene, weighing, normal, slope, cost, damping)
        if moved is None:
            break
        step, damping = moved
        values[:LOCAL] += step
        if step @ normal @ step < 1e-3:
            break
    return _finish(reading, values, scene)


def fits_better(reading: Reading, scene: Scene, one: ShadingFit, other: ShadingFit) -> bool:
    """Whether ``one`` explains the reading better than ``other``, under errors that are the same for both: each fit's
    own grow with the bounce that it supposes, which makes a wrong place with much of it look good."""
    values = [np.concatenate([fit.local, scene.shared]) for fit in (one, other)]
    own = [_weigh(reading, each, scene) for each in values]
    sigma, bound = np.sqrt(own[0].sigma * own[1].sigma), max(own[0].bound, own[1].bound)
    alike = [replace(weighing, sigma=sigma, bound=bound) for weighing in own]
    first, second = (
        _cost(_residual(reading, each, scene, weighing), each, weighing)
        for each, weighing in zip(values, alike, strict=True)
    )
    return first < second


def _step(
    reading: Reading,
    values: np.ndarray,
    scene: Scene,
    weighing: _Weighing,
    normal: np.ndarray,
    slope: np.ndarray,
    cost: float,
    damping: float,
) -> tuple[np.ndarray, float] | None:
    """A damped step (LOCAL,) that lowers the cost, and the next damping; None if there is none."""
    while damping < 1e8:
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -slope)
        tried = values.copy()
        tried[:LOCAL] += step
        if tried[2] > 0:
            after = _cost(_residual(reading, tried, scene, weighing), tried, weighing)
            if after <= cost:
                return step, max(damping / 8, 1e-9)
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
    reading: Reading, values: np.ndarray, scene: Scene, weighing: _Weighing, residual: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normal matrix and slope of the first ``count`` values, and the weighted score of each sample."""
    design = _derivatives(reading, values, scene, weighing, count) / weighing.sigma[:, None]
    weight = (1 - np.clip((residual / weighing.bound) ** 2, 0, 1)) ** 2
    score = design * weight[:, None]
    normal, slope = score.T @ design, -score.T @ residual
    for k in range(4, LOCAL):
        normal[k, k] += weighing.prior[k - 4] ** -2.0
        slope[k] += (values[k] - _PRIOR[k - 4]) * weighing.prior[k - 4] ** -2.0
    return normal, slope, score


def _derivatives(
    reading: Reading, values: np.ndarray, scene: Scene, weighing: _Weighing, count: int
) -> np.ndarray:
    """d radiance / d values, (n, count): by differences where lamp and shadows move, else as the model says."""
    parts = _parts(reading, values, scene, weighing.across)
    base = parts.radiance(values, weighing.thrown)
    design = np.empty((len(base), count))
    for k in [k for k in _MOVING if k < count]:
        step = _STEP * (np.linalg.norm(values[:3]) if k < 3 else 1.0)
        moved = values.copy()
        moved[k] += step
        design[:, k] = (_model(reading, moved, scene, weighing) - base) / step
    design[:, 3] = base
    design[:, 4:6] = parts.tone[:, None] * weighing.thrown
    design[:, 6] = parts.tone * parts.even
    design[:, 7:9] = (parts.tone * parts.straight * parts.share)[:, None] * weighing.across
    if count > LOCAL:
        design[:, LOCAL + SHARED - 1] = np.where(reading.samples.white, 0.0, base)
    return design


def _finish(reading: Reading, values: np.ndarray, scene: Scene) -> ShadingFit:
    weighing = _weigh(reading, values, scene)
    residual = _residual(reading, values, scene, weighing)
    normal, slope, score = _normal(reading, values, scene, weighing, residual, LOCAL + SHARED)
    inflation = _inflation(normal[:4, :4], score[:, :4] * residual[:, None], reading.samples.square)
    inlier = np.abs(residual) < 0.7 * weighing.bound
    tone = np.where(reading.samples.white, 1.0, scene.moved(values[LOCAL:]).black) * np.exp(values[3])
    bare = tone * direct(reading.samples.points, values[:3])
    relative = (residual * weighing.sigma / np.maximum(bare, 1e-300))[inlier]
    rms = float(np.sqrt(np.mean(relative**2))) if inlier.any() else float("nan")
    cost = _cost(residual, values, weighing) / len(residual)
    even = _even_alone(values, normal[:LOCAL, :LOCAL], slope[:LOCAL], weighing.prior[2])
    share = even * [1.0, np.sqrt(inflation)]
    level = float(np.exp(values[3]) * np.median(direct(reading.samples.points, values[:3])))
    believed = float(inlier.mean())
    return ShadingFit(
        values[:LOCAL], normal / inflation, slope / inflation, rms, believed, cost, level, share * level
    )


def _even_alone(values: np.ndarray, normal: np.ndarray, slope: np.ndarray, prior: float) -> np.ndarray:
    """(2,) even light as it would be without its narrow prior, and its standard error: one more step."""
    freed, pulled = normal.copy(), slope.copy()
    freed[6, 6] += _EVEN_ANY**-2.0 - prior**-2.0
    pulled[6] -= values[6] * (prior**-2.0 - _EVEN_ANY**-2.0)
    inverse = np.linalg.pinv(freed, hermitian=True)
    return np.array([values[6] - inverse[6] @ pulled, np.sqrt(inverse[6, 6])])


def _inflation(normal: np.ndarray, each: np.ndarray, square: np.ndarray) -> float:
    """How much larger the variance is than for independent samples: squares' summed scores against theirs."""
    summed = np.zeros((int(square.max()) + 1, each.shape[1]))
    np.add.at(summed, square, each)
    return max(float(np.trace(np.linalg.pinv(normal) @ (summed.T @ summed)) / each.shape[1]), 1.0)
