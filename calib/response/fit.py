"""The tone curve that makes paper as bright as its lamp's light has it, and ink one and the same share of that.

All photos together: the curve's bends, every lamp's place, every photo's strength, ink, what the lens darkens. The
logarithm of light, from codes, equals that of (z / r^3 of the lamp); so of white paper and of black print. Ink ties
codes a twentieth in light apart, the light's slope over the sheet ties neighbours; a lamp that stands still, or keeps
its place before the camera, in several photos tells by which power all of it may be bent.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from photogonio.calib.response.curve import BENDS, Curves, steepness
from photogonio.calib.response.paper_codes import PaperCodes
from photogonio.calib.response.paper_light import design_of, direct_light, light_of
from photogonio.calib.response.start_place import likely_place
from photogonio.calib.response.surround_tone import by_surroundings
from photogonio.calib.response.unknowns import NO_SCATTER, Unknowns, expectations, raised, scatter_of
from photogonio.capture import robust
from photogonio.capture.containers.tone import srgb

# rounds and steps until a fit is at its end: lamps may start a fifth of their distance off, and dark codes come last
_ROUNDS, _STEPS = 40, 60
_TUKEY, _LEAST_MISS = 5.0, 0.5
_DAMPING, _DAMPED, _GAINED = (
    1e-3,
    1e6,
    1e-3,
)  # of steps at the end: first, at most; and of the cost, that counts
_DRAWN = (1.0, 0.5, 0.25)  # how strong a curve may be, of those that are known: the likeliest is taken
_STEP = 0.1  # of a lamp's distance that it moves in a round, at most
_SINKS = 0.3  # of its height, that it comes down by in a round, at most
_WIDE = 64.0  # of the errors expected, in which all is believed at first
_ENDS = 0.002  # share of the codes that lies beyond what is called seen, at either end


@dataclass(frozen=True, slots=True)
class FittedResponse:
    curves: Curves
    places: dict[str, np.ndarray]  # (3,) of lamps; in the camera's frame of those attached
    ink: np.ndarray  # (c,)
    misfit: float  # relative, of white print
    black_misfit: float  # of black
    veil: float  # light over whole pictures, a share of white
    lens: np.ndarray  # (2,) terms of what it darkens
    covariance: np.ndarray  # of the lamps' places, after one another
    surround: float = 0.0  # slope of white print's miss by the light round about: see surround_tone


def fit_response(photos: Sequence[PaperCodes]) -> FittedResponse:
    """The curve of photos that were taken with one and the same."""
    channels = photos[0].code.shape[1]
    lights = tuple(dict.fromkeys(one.light for one in photos))
    middles = tuple(float(np.median(direct_light(raised(one.place) - one.points)[0])) for one in photos)
    tones = 1 + max(int(one.tone.max()) for one in photos)
    attached = tuple(dict.fromkeys(one.light for one in photos if one.attached))
    layout = Unknowns(channels, lights, len(photos), middles, tones, attached)
    values = start_values(layout, photos)
    alike = dict.fromkeys(lights, NO_SCATTER)
    values, scale = _approached(layout, photos, values, expectations(layout, photos, values, alike))
    values = _settled(layout, photos, values, scale, expectations(layout, photos, values, alike))
    alike = {name: scatter_of(layout, photos, values, name) for name in lights}
    likeliest = (np.inf, values, values)
    for drawn in _DRAWN:
        expectation = expectations(layout, photos, values, alike, drawn)
        values = _settled(layout, photos, values, scale, expectation)
        unlikely = _unlikely(layout, photos, values, scale, expectation)
        if unlikely < likeliest[0]:
            likeliest = (unlikely, values, expectation[0])
    return _finished(layout, photos, likeliest[1], scale, likeliest[2])


def _unlikely(
    layout: Unknowns,
    photos: Sequence[PaperCodes],
    values: np.ndarray,
    scale: np.ndarray,
    expectation: tuple[np.ndarray, np.ndarray],
) -> float:
    """Minus the logarithm of how likely the codes are under an expectation, but for a constant: Laplace's integral
    about the values that are likeliest (MacKay, Neural Computation 1992)."""
    expected = expectation[0].T @ expectation[0]
    told = _normal(layout, photos, values, scale)[0]
    room = np.linalg.slogdet(told + expected)[1] - np.linalg.slogdet(expected)[1]
    return _cost(layout, photos, values, scale, expectation) + 0.5 * float(room)


def _finished(
    layout: Unknowns, photos: Sequence[PaperCodes], values: np.ndarray, scale: np.ndarray, held: np.ndarray
) -> FittedResponse:
    """What the values say, with the curve's covariance: by how each square pulls at it, since the errors expected of
    single ones are not known so well."""
    expectation = held.T @ held
    inverse = np.linalg.inv(_normal(layout, photos, values, scale)[0] + expectation)
    spread = inverse @ (_scores(layout, photos, values, scale) + expectation) @ inverse
    count = layout.strengths
    codes = np.concatenate([one.code.ravel() for one in photos])
    low, high = (float(np.quantile(codes, part)) for part in (_ENDS, 1 - _ENDS))
    curves = Curves(values[:count].reshape(1 + layout.channels, BENDS), spread[:count, :count], (low, high))
    places = {n: values[layout.places + 3 * k :][:3] for k, n in enumerate(layout.lights)}
    misfit, black = _misfits(layout, photos, values)
    ink, lens = np.exp(values[layout.ink :][: layout.channels]), values[layout.lens : layout.veil]
    around = by_surroundings(layout, photos, values)
    at = slice(layout.places, layout.even)
    return FittedResponse(
        curves, places, ink, misfit, black, float(values[layout.veil]), lens, spread[at, at], around
    )


def _approached(
    layout: Unknowns,
    photos: Sequence[PaperCodes],
    values: np.ndarray,
    expectation: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Values near the end, and how far each photo's black and other print then miss (p, 2), in their errors: at first
    all is believed."""
    (held, expected), scale = expectation, np.full((len(photos), 2), _WIDE)
    for _ in range(_ROUNDS):
        normal, pull, misses = _normal(layout, photos, values, scale)
        pull = pull - held.T @ (held @ values - expected)
        values = values + _shortened(layout, values, np.linalg.solve(normal + held.T @ held, pull))
        scale = np.clip(misses, _LEAST_MISS, np.maximum(scale / 2, 1.0))
    return values, scale


def _settled(
    layout: Unknowns,
    photos: Sequence[PaperCodes],
    values: np.ndarray,
    scale: np.ndarray,
    expectation: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """The values at which the cost is least, what is believed being settled."""
    held, expected = expectation
    damping, cost = _DAMPING, _cost(layout, photos, values, scale, expectation)
    for _ in range(_STEPS):
        normal, pull, _ = _normal(layout, photos, values, scale)
        full, pull = normal + held.T @ held, pull - held.T @ (held @ values - expected)
        gained = 0.0
        while damping < _DAMPED and gained <= 0:
            step = np.linalg.solve(full + damping * np.diag(np.diag(full)), pull)
            step = _shortened(layout, values, step)
            gained = cost - _cost(layout, photos, values + step, scale, expectation)
            damping *= 0.2 if gained > 0 else 8.0
        if gained <= 0:
            break
        values, cost = values + step, cost - gained
        if gained < _GAINED:
            break
    return values


def _cost(
    layout: Unknowns,
    photos: Sequence[PaperCodes],
    values: np.ndarray,
    scale: np.ndarray,
    expectation: tuple[np.ndarray, np.ndarray],
) -> float:
    """Half the sum of Tukey's losses, and of what is expected."""
    held, expected = expectation
    lost = 0.0
    for _, one in _weighed(layout, photos, values, scale):
        left = 1 - np.minimum((one.bare / one.bound) ** 2, 1.0)
        lost += float(np.sum((one.bound / one.wider) ** 2 * (1 - left**3))) / 6
    return lost + 0.5 * float(np.sum((held @ values - expected) ** 2))


def start_values(layout: Unknowns, photos: Sequence[PaperCodes]) -> np.ndarray:
    values = np.zeros(layout.size)
    for k, name in enumerate(layout.lights):
        own = [one for one in photos if one.light == name]
        high = [one.place if np.isfinite(one.sure) else likely_place(one, raised(one.place)) for one in own]
        places = [one.pose.apply(p) if one.attached else p for one, p in zip(own, high, strict=True)]
        values[layout.places + 3 * k : layout.places + 3 * k + 3] = np.median(places, axis=0)
    inks = []
    for k, one in enumerate(photos):
        light = light_of(layout, one, k, values)[0]
        lit = one.whitest
        seen = np.log(np.maximum(srgb(one.code[lit]), 1e-9)) - np.log(light[lit])[:, None]
        at = layout.strengths + k * layout.channels
        values[at : at + layout.channels] = np.median(seen, axis=0)
        every = np.log(np.maximum(srgb(one.code), 1e-9)) - np.log(light)[:, None]
        kinds = [every[~one.white & (one.tone == tone)] for tone in range(layout.tones)]
        untold = np.full(layout.channels, np.nan)
        inks_of = [np.median(each, axis=0) if len(each) else untold for each in kinds]
        inks.append(np.concatenate(inks_of) - np.tile(np.median(seen, axis=0), layout.tones))
    values[layout.ink : layout.lens] = np.nanmedian(inks, axis=0)
    return values


@dataclass(frozen=True, slots=True)
class _Weighed:
    """One photo's channel: derivatives and misses in their standard errors, weighed down where they are wild."""

    asked: np.ndarray  # (k,) the unknowns
    design: np.ndarray  # (n, k)
    miss: np.ndarray  # (n,)
    bare: np.ndarray  # (n,) misses before they are weighed
    bound: np.ndarray  # (n,) where they are wild
    wider: np.ndarray  # (n,) by how much errors of this photo are larger than usual


def _weighed(
    layout: Unknowns, photos: Sequence[PaperCodes], values: np.ndarray, scale: np.ndarray
) -> Iterator[tuple[int, _Weighed]]:
    usual = np.median(scale, axis=0)
    for number, one in enumerate(photos):
        kind = one.bright.astype(int)
        bound, wider = _TUKEY * scale[number][kind], np.maximum(scale[number] / usual, 1.0)[kind]
        for channel in range(layout.channels):
            design, miss, error = design_of(layout, one, number, values, channel)
            z = miss / error
            weight = robust.tukey_weight(z, bound) / wider
            asked = layout.asked(one.light, number, channel)
            yield number, _Weighed(asked, design * (weight / error)[:, None], weight * z, z, bound, wider)


def _normal(
    layout: Unknowns, photos: Sequence[PaperCodes], values: np.ndarray, scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normal matrix and pull of all unknowns; how far each photo's black and other print miss (p, 2), in errors."""
    normal, pull = np.zeros((layout.size, layout.size)), np.zeros(layout.size)
    misses: list[list[list[np.ndarray]]] = [[[], []] for _ in photos]
    for number, one in _weighed(layout, photos, values, scale):
        normal[np.ix_(one.asked, one.asked)] += one.design.T @ one.design
        pull[one.asked] += one.design.T @ one.miss
        for kind in (0, 1):
            misses[number][kind].append(one.bare[photos[number].bright == kind])
    scatter = [[robust.deviation(np.concatenate(each)) for each in kinds] for kinds in misses]
    return normal, pull, np.array(scatter)


def _scores(
    layout: Unknowns, photos: Sequence[PaperCodes], values: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """Sum of the squares of what each square of each photo pulls at the unknowns, all channels together, and of what
    each photo's black, and its other print, does: squares err alone, and with their neighbours."""
    pulls = [np.zeros((len(one.code), layout.size)) for one in photos]
    for number, one in _weighed(layout, photos, values, scale):
        pulls[number][:, one.asked] += one.design * one.miss[:, None]
    total = np.zeros((layout.size, layout.size))
    for each, photo in zip(pulls, photos, strict=True):
        kinds = np.stack([each[photo.bright].sum(0), each[~photo.bright].sum(0)])
        total += each.T @ each + kinds.T @ kinds
    return total


def _shortened(layout: Unknowns, values: np.ndarray, step: np.ndarray) -> np.ndarray:
    """A step that moves no lamp too far at once, nor down to the board, where a lamp would stay."""
    for k, name in enumerate(layout.lights):
        at = slice(layout.places + 3 * k, layout.places + 3 * k + 3)
        height, rises = float(values[at][2]), float(step[at][2])
        if name not in layout.attached and height > 0 and rises < -_SINKS * height:
            step = step * (-_SINKS * height / rises)
        far = max(float(np.linalg.norm(values[at])), 100.0)
        moved = float(np.linalg.norm(step[at]))
        if moved > _STEP * far:
            step = step * (_STEP * far / moved)
    return step


def _misfits(layout: Unknowns, photos: Sequence[PaperCodes], values: np.ndarray) -> tuple[float, float]:
    """Of white and black print, as shares of their light were the curve sRGB's."""
    white, black = [], []
    for number, one in enumerate(photos):
        for channel in range(layout.channels):
            miss = design_of(layout, one, number, values, channel)[1] * steepness(one.code[:, channel])
            white.append(miss[one.white])
            black.append(miss[~one.white])
    of_white, of_black = (float(robust.deviation(np.concatenate(each))) for each in (white, black))
    return of_white, of_black
