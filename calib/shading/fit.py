"""The lamp's place from how it lights the board: falloff, angle, and the shadows of balls of known place.

On a flat diffuse print the radiance is rho S z / r^3 (z the lamp's height), so the pattern of light over the board
tells where the lamp is. Light that the sample throws onto the board is modelled and its amount fitted along.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.geometry.visibility import direct
from photogonio.calib.shading.derivatives import slopes
from photogonio.calib.shading.model import LightOnPaper, LitPaper, ShadingScene, Weighing, lit, median_ratio
from photogonio.calib.shading.model_error import ErrorShown, shown
from photogonio.calib.shading.parameters import EVEN, LOCAL, PATCHES, STRENGTH, THROWN
from photogonio.capture import robust

_BOUNCE_ERROR = 0.2  # relative error of the modelled bounce, common to a square
_TUKEY = 5.0
_STEPS = 15
_STILL = 1e-3  # squared standard errors of a step after which a fit has ended
# of the largest of an information matrix: a value that nothing in a photo tells stays as it is
_NO_SAY = 1e-30
_SAME = 0.25  # squared standard errors within which two fits are on their way to one place
# of the local values after the first four but the last, which is the scene's
_PRIOR = np.array([0.3, 1.0, 0.0, 0.0, 0.0, 0.5])
_IS_EVEN = np.arange(4, LOCAL) == EVEN
_PRIOR_SIGMA = np.array([0.3, 1.0, 0.0005])  # of the first three of them; even light looks like a nearer lamp
# least and most of what balls throw, for its error
_PLAUSIBLE = np.array([[0.15, 0.5, 0.0], [0.6, 2.0, 1.0]])
_POLISHED = 0.5  # of the last: chrome, steel, a silvered ball
_EVEN_PLANE = 0.01  # the last with a flat sample, whose own bounce is not modelled
_EVEN_ANY = 0.3  # the last where nothing is taken for granted
_SLOPE = 0.001  # relative, over half the board: how even paper and lens are
_SLOPE_BOUNCE = 0.15  # of the bounce over the direct light: what its model may tilt
# where codes stand for light by a curve that print told, and black for a veil besides: the slope, a sample's error in
# full light, and how many times less sure a view is of its lamp, for sharpened edges of shadows lie elsewhere
_SLOPE_BENT, _FLOOR_BENT, _BENT = 0.03, 0.02, 3.0
_SLOPE_BEAM = 0.02  # for each power of the cosine: a beam whose axis passes by the sample by some degrees
_PATCHES_VARY = 0.001  # relative: by what patches' light over paper's differs from view to view
_NOTHING = 1e-9  # of what is expected of a value: what tells no more says nothing
# samples of a square of black print, and such squares, that tell what they have in common
_OF_SQUARE, _SQUARES = 4, 8
_INKS = (0.001, 0.03)  # least and most that this is taken for
_INK_SHARE = 0.5  # of white in a sample: with less it is ink's
_HELD = 0.003  # of the lamp's distance: a smaller move changes the bounce, a few per cent of the light, by about 1 %


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
    shown: ErrorShown  # of the model's error in shadows
    patches: np.ndarray  # (2,) log of patches' light over paper's, by this view alone, and 1 / its error^2
    ink: float  # relative error of black print that squares in full light show to have in common; NaN: too few do

    @property
    def place(self) -> np.ndarray:
        return self.local[:3]

    def covariance(self) -> np.ndarray:
        """(3, 3) of the place with the shared values held."""
        return np.linalg.inv(self.normal[:LOCAL, :LOCAL])[:3, :3]


def _weigh(
    board: LitPaper,
    values: np.ndarray,
    scene: ShadingScene,
    light: LightOnPaper,
    last: Weighing | None = None,
) -> tuple[Weighing, np.ndarray]:
    """The errors, and the residual (n,) in them. ``last``, of the same shared values, has the bounce where the lamp
    has hardly moved since."""
    reading, now = board.reading, scene.moved(values[LOCAL:])
    place = values[:3].copy()
    if last is not None and np.linalg.norm(place - last.place) < _HELD * np.linalg.norm(place):
        thrown, place = last.thrown, last.place
    else:
        thrown = board.thrown(now).of(place)
    indirect = light.tone * (thrown @ np.clip(values[THROWN], *_PLAUSIBLE))
    sigma, most, share = _errors(board, light, indirect, scene)
    own = slice(len(reading.level))
    slope = _SLOPE + _SLOPE_BEAM * max(now.narrow, 0.0)
    bounced = median_ratio(indirect[own], np.maximum(light.bare[own], 1e-300))
    slope = float(np.hypot(slope, _SLOPE_BOUNCE * bounced + _SLOPE_BENT * now.bent))
    mean, error = now.patches
    prior = np.concatenate([_PRIOR_SIGMA, [slope, slope, _POLISHED, error]])
    if now.sample is None:
        prior[2] = _EVEN_PLANE
    beside = np.array(reading.beside) / (np.exp(values[3]) * max(light.even, 1e-300))
    usual = np.append(_PRIOR, mean)
    expected, prior[2] = np.where(_IS_EVEN, beside[0], usual), np.hypot(prior[2], beside[1])
    residual = (board.level - board.shown(light.radiance(values, thrown))[0]) / sigma
    bound = _TUKEY * max(float(robust.deviation(residual)), 1.0) * most
    return Weighing(sigma, bound, share, thrown, place, expected, prior), residual


def _errors(
    board: LitPaper, light: LightOnPaper, indirect: np.ndarray, scene: ShadingScene
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Standard errors (n,) where the model's in shadows is as the scene has it; how many times larger they may be at
    most, which tells what is no error but dirt; and the share of the expected one, where that is much."""
    shade, far = light.shaded < 0.99 * light.bare, np.arange(len(light.bare)) < len(board.reading.level)
    full = board.floor[0] + _FLOOR_BENT * scene.bent
    floor = (np.where(shade, board.floor[1], full) * light.bare) ** 2
    most = board.noise + floor + board.crowd * (_BOUNCE_ERROR * indirect) ** 2
    told = np.where(shade & far, floor, 0.0)
    ink = _lit_ink(board, light)
    most = most + np.where(ink, board.crowd * (scene.ink * light.bare) ** 2, 0.0)
    variance = most - (1 - scene.error**2) * told
    least = np.sqrt(np.maximum(most / variance, 1.0))
    return np.sqrt(variance), least, np.where(told > most / 2, told / variance, 0.0)


def _cost(residual: np.ndarray, values: np.ndarray, weighing: Weighing) -> float:
    """Half the sum of Tukey's loss and of the priors."""
    outside = robust.tukey_weight(residual, weighing.bound)
    prior = (values[4:LOCAL] - weighing.expected) / weighing.prior
    lost = float(np.sum(weighing.bound**2 * (1 - outside * outside * outside))) / 6
    return lost + 0.5 * float(prior @ prior)


@dataclass(frozen=True, slots=True)
class Stand:
    """Where a fit stands."""

    board: LitPaper
    values: np.ndarray  # (LOCAL + shared,)
    scene: ShadingScene
    light: LightOnPaper  # at these values
    normal: np.ndarray | None = None  # (LOCAL, LOCAL) information matrix before the last step
    ended: bool = False  # whether more steps would change nothing

    @property
    def local(self) -> np.ndarray:
        return self.values[:LOCAL]

    def reached_by(self, values: np.ndarray) -> bool:
        """Whether local ``values`` lie within the errors of where this fit ended: they would end there too."""
        if not self.ended or self.normal is None:
            return False
        apart = values[:LOCAL] - self.local
        return bool(apart @ self.normal @ apart < _SAME)


def fit_shading(
    reading: PaperReading, scene: ShadingScene, start: np.ndarray, steps: int = _STEPS
) -> ShadingFit:
    """Fit one view's lamp from ``start``: a place (3,), or the local values (LOCAL,) of an earlier fit.

    Levenberg-Marquardt with Tukey's weights on the local values; the shared ones stay and get derivatives.
    """
    return shading_of(stepped(LitPaper.of(reading), scene, start, steps))


def fit_local(board: LitPaper, scene: ShadingScene, start: np.ndarray) -> np.ndarray:
    """The local values (LOCAL,) of :func:`fit_shading` alone."""
    return stepped(board, scene, start, _STEPS).local


def stepped(
    board: LitPaper,
    scene: ShadingScene,
    start: np.ndarray,
    steps: int,
    beside: Stand | None = None,
) -> Stand:
    """Where :func:`fit_shading` ends; :func:`shading_of` makes the fit of it, which costs as much as two steps.
    A fit that comes within its errors of one that ended, ``beside`` it, would end there too, and takes no more steps.
    """
    local = start if len(start) == LOCAL else start_values(board.reading, scene, start)
    values = np.concatenate([local, scene.shared])
    damping, weighing, normal, ended = 1e-3, None, None, False
    light = board.light(values, scene)
    for _ in range(steps):
        if beside is not None and beside.reached_by(values):
            break
        weighing, residual = _weigh(board, values, scene, light, weighing)
        now = Stand(board, values, scene, light)
        normal, slope, *_ = _normal(now, weighing, residual, LOCAL)
        _add_sights(board, values, normal, slope)
        moved = _step(now, weighing, normal, slope, residual, damping)
        ended = moved is None
        if moved is None:
            break
        step, light, damping = moved
        values[:LOCAL] += step
        ended = bool(step @ normal @ step < _STILL)
        if ended:
            break
    return Stand(board, values, scene, light, normal, ended)


def _add_sights(board: LitPaper, values: np.ndarray, normal: np.ndarray, slope: np.ndarray) -> None:
    """What highlights say of the place goes to the paper's normal matrix and gradient."""
    if board.sights is not None:
        more, down = board.sights.normal(values[:3])
        normal[:3, :3] += more
        slope[:3] += down


def _by_sights(board: LitPaper, values: np.ndarray) -> float:
    return 0.0 if board.sights is None else board.sights.cost(values[:3])


def fits_better(one: Stand, other: Stand) -> bool:
    """Whether ``one`` explains the reading of both, and highlights, better than ``other``, under errors that are the
    same for both: each fit's own grow with the bounce that it supposes, which makes a wrong place with much of it look
    good."""
    own = [_weigh(at.board, at.values, at.scene, at.light)[0] for at in (one, other)]
    sigma, bound = np.sqrt(own[0].sigma * own[1].sigma), np.maximum(own[0].bound, own[1].bound)
    alike = [replace(weighing, sigma=sigma, bound=bound) for weighing in own]
    first, second = (
        _cost(at.board.residual(at.light, at.values, weighing), at.values, weighing)
        + _by_sights(at.board, at.values)
        for at, weighing in zip((one, other), alike, strict=True)
    )
    return first < second


def _step(
    now: Stand,
    weighing: Weighing,
    normal: np.ndarray,
    slope: np.ndarray,
    residual: np.ndarray,
    damping: float,
) -> tuple[np.ndarray, LightOnPaper, float] | None:
    """A damped step (LOCAL,) that lowers the cost, the light after it, and the next damping; None if there is none."""
    cost = _cost(residual, now.values, weighing) + _by_sights(now.board, now.values)
    size = np.diag(normal)
    size = np.maximum(size, _NO_SAY * size.max())
    while damping < 1e8:
        step = np.linalg.solve(normal + damping * np.diag(size), -slope)
        tried = now.values.copy()
        tried[:LOCAL] += step
        if tried[2] > 0:
            light = now.board.light(tried, now.scene)
            paper = _cost(now.board.residual(light, tried, weighing), tried, weighing)
            if paper + _by_sights(now.board, tried) <= cost:
                return step, light, max(damping / 8, 1e-9)
        damping *= 8
    return None


def start_values(reading: PaperReading, scene: ShadingScene, place: np.ndarray) -> np.ndarray:
    """(LOCAL,) values at a light's place: the strength as the median over what is lit."""
    values = np.concatenate([place, [0.0], _PRIOR, scene.patches[:1], scene.shared])
    points = reading.samples.points
    model = direct(points, place) * np.where(reading.samples.white, 1.0, scene.black)
    chosen = (lit(points, place, scene) > 0.9) & (model > 0)
    strength = float(np.median(reading.level[chosen] / model[chosen])) if chosen.any() else 1.0
    values[3] = np.log(max(strength, 1e-300))
    return values[:LOCAL]


def _normal(
    now: Stand, weighing: Weighing, residual: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Normal matrix and slope of the first ``count`` values, and the samples' scores by them and weights, (count, n)
    and (n,)."""
    design = slopes(now.board, now.values, now.scene, now.light, weighing.thrown, count)
    weight = robust.tukey_weight(residual, weighing.bound)
    design *= now.board.shown(design[STRENGTH])[1] * weight / weighing.sigma
    normal, slope = design @ design.T, -design @ (weight * residual)
    for k in range(4, LOCAL):
        normal[k, k] += weighing.prior[k - 4] ** -2.0
        slope[k] += (now.values[k] - weighing.expected[k - 4]) * weighing.prior[k - 4] ** -2.0
    return normal, slope, design, weight


def shading_of(at: Stand) -> ShadingFit:
    """A fit that ends where it stands: what the paper alone says there, without highlights that led it."""
    board, values, scene, light = at.board, at.values, at.scene, at.light
    weighing, residual = _weigh(board, values, scene, light)
    normal, slope, design, weight = _normal(at, weighing, residual, len(values))
    score = design[:LOCAL] * weight
    inflation = _inflation(normal[:4, :4], score[:4] * residual, board.square)
    inflation *= _BENT**2 if scene.bent else 1.0
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
        values[:LOCAL],
        normal / inflation,
        slope / inflation,
        rms,
        believed,
        cost,
        level,
        share * level,
        seen,
        _patches_alone(values, normal[:LOCAL, :LOCAL], slope[:LOCAL], weighing, inflation),
        _ink_shown(board, light, residual * weighing.sigma),
    )


def _even_alone(values: np.ndarray, normal: np.ndarray, slope: np.ndarray, weighing: Weighing) -> np.ndarray:
    """(2,) even light as it would be without its narrow prior, and its standard error: one more step."""
    freed, pulled = normal.copy(), slope.copy()
    held = weighing.prior[2] ** -2.0
    freed[EVEN, EVEN] += _EVEN_ANY**-2.0 - held
    pulled[EVEN] += values[EVEN] * _EVEN_ANY**-2.0 - (values[EVEN] - weighing.expected[2]) * held
    inverse = np.linalg.pinv(freed, hermitian=True)
    return np.array([values[EVEN] - inverse[EVEN] @ pulled, np.sqrt(inverse[EVEN, EVEN])])


def _patches_alone(
    values: np.ndarray, normal: np.ndarray, slope: np.ndarray, weighing: Weighing, inflation: float
) -> np.ndarray:
    """(2,) what patches' light is over the paper's without what is expected of it, after one more step, and the inverse
    of its variance; 0 of a view that shows none."""
    freed, pulled = normal.copy(), slope.copy()
    held = weighing.prior[PATCHES - 4] ** -2.0
    freed[PATCHES, PATCHES] -= held
    pulled[PATCHES] -= (values[PATCHES] - weighing.expected[PATCHES - 4]) * held
    if freed[PATCHES, PATCHES] <= _NOTHING * held:
        return np.array([values[PATCHES], 0.0])
    others = np.arange(LOCAL) != PATCHES
    cross = np.linalg.solve(freed[np.ix_(others, others)], freed[others, PATCHES])
    told = float(freed[PATCHES, PATCHES] - freed[PATCHES, others] @ cross)
    if told <= _NOTHING * held:
        return np.array([values[PATCHES], 0.0])
    return np.array(
        [values[PATCHES] - float(pulled[PATCHES] - cross @ pulled[others]) / told, told / inflation]
    )


def _lit_ink(board: LitPaper, light: LightOnPaper) -> np.ndarray:
    """Which samples (n,) are black print in full light."""
    return (light.shaded >= 0.99 * light.bare) & (board.white < _INK_SHARE)


def _ink_shown(board: LitPaper, light: LightOnPaper, miss: np.ndarray) -> float:
    """Relative scatter of squares of black print in full light about the model, beyond what noise makes of it; ``miss``
    (n,) is radiance."""
    chosen = _lit_ink(board, light) & (light.bare > 0)
    _, square, count = np.unique(board.square[chosen], return_inverse=True, return_counts=True)
    whole = count >= _OF_SQUARE
    if whole.sum() < _SQUARES:
        return float("nan")
    bare = light.bare[chosen]
    off = (np.bincount(square, miss[chosen] / bare) / count)[whole]
    noise = (np.bincount(square, board.noise[chosen] / bare**2) / count**2)[whole]
    return float(
        np.sqrt(max(float(robust.deviation(off - np.median(off))) ** 2 - float(np.mean(noise)), 0.0))
    )


def pooled_ink(fits: Iterable[ShadingFit], usual: float) -> float:
    """What black print's squares have in common in the middle of all views; ``usual`` where none shows it."""
    told = [one.ink for one in fits if np.isfinite(one.ink)]
    return float(np.clip(np.median(told), *_INKS)) if told else usual


def pooled_patches(fits: Iterable[ShadingFit], usual: tuple[float, float]) -> tuple[float, float]:
    """What all views say of patches' light over the paper's beside what is ``usual``, and its standard error."""
    told = np.array([[usual[0], usual[1] ** -2.0], *(one.patches for one in fits)])
    whole = float(told[:, 1].sum())
    return float(told[:, 0] @ told[:, 1] / whole), float(np.hypot(whole**-0.5, _PATCHES_VARY))


def _inflation(normal: np.ndarray, each: np.ndarray, square: np.ndarray) -> float:
    """How much larger the variance is than for independent samples: squares' summed scores against theirs."""
    summed = np.stack([np.bincount(square, one) for one in each])
    return max(float(np.trace(np.linalg.pinv(normal) @ (summed @ summed.T)) / len(each)), 1.0)
