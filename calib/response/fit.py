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

from photogonio.calib.response.curve import BENDS, Curves, anchors, basis, prior
from photogonio.calib.response.paper_codes import PaperCodes
from photogonio.capture import robust
from photogonio.capture.containers.tone import srgb

_ROUNDS, _TUKEY = 25, 5.0
_STILL = 1e-4  # of a code's logarithm of light, by which the curve moves in a round that is the last
_MODEL = 0.0015  # relative error of the light on one square of white print
_INK_MODEL = 0.006  # of black print: the lens's glare, and shine
_INK, _INKS, _INKS_APART = 0.05, 0.3, 0.1  # ink's share of white, how inks differ, and how its channels do
_EVEN = 0.005  # light that is everywhere, as a share of the lamp's
_LENS = 0.1  # what a lens may darken towards the corner, its logarithm
# of a lamp's strength from photo to photo: least and most that it is taken to vary, and over how it is seen to
_ALIKE = (0.004, 0.05, 2.0)
_BESIDE = 150.0  # that a lamp on the camera stands beside the lens, about, length units
# that it stands before the lens or behind it, and more the further beside it
_DEPTH = (5.0, 0.3)
_VEIL = 0.003  # of white, over the whole picture
_STEP = 0.1  # of a lamp's distance that it moves in a round, at most
_WIDE = 64.0  # of the errors expected, in which all is believed at first
_ANCHORED = 1e-4
_ENDS = 0.01  # share of the codes that lies beyond what is called seen, at either end
_GRID = np.linspace(0.002, 1.0, 1500)
_SHAPES, _STEEP = basis(_GRID), np.gradient(np.log(srgb(_GRID)), _GRID)
_LEAST_RISE = 1e-6


@dataclass(frozen=True, slots=True)
class _Layout:
    """Where each unknown stands."""

    channels: int
    lights: tuple[str, ...]
    photos: int
    middles: tuple[float, ...]  # of the direct light of each photo, about: that is 1

    @property
    def strengths(self) -> int:
        return (1 + self.channels) * BENDS

    @property
    def places(self) -> int:
        return self.strengths + self.photos * self.channels

    @property
    def even(self) -> int:
        return self.places + 3 * len(self.lights)

    @property
    def ink(self) -> int:
        return self.even + self.photos

    @property
    def lens(self) -> int:
        return self.ink + self.channels

    @property
    def veil(self) -> int:
        return self.lens + 2

    def asked(self, light: str, number: int, channel: int) -> np.ndarray:
        """The unknowns (k,) that a channel of a photo hangs on."""
        bend, place = np.arange(BENDS), self.places + 3 * self.lights.index(light)
        own = [
            self.strengths + number * self.channels + channel,
            place,
            place + 1,
            place + 2,
            self.even + number,
        ]
        shared = [self.ink + channel, self.lens, self.lens + 1, self.veil]
        return np.concatenate([bend, bend + (channel + 1) * BENDS, own, shared])

    @property
    def size(self) -> int:
        return self.veil + 1


@dataclass(frozen=True, slots=True)
class FittedResponse:
    curves: Curves
    places: dict[str, np.ndarray]  # (3,) of lamps; in the camera's frame of those attached
    ink: np.ndarray  # (c,)
    misfit: float  # relative, of white print
    black_misfit: float  # of black
    veil: float  # light over whole pictures, a share of white
    lens: np.ndarray  # (2,) terms of what it darkens


def fit_response(photos: Sequence[PaperCodes]) -> FittedResponse:
    """The curve of photos that were taken with one and the same."""
    channels = photos[0].code.shape[1]
    lights = tuple(dict.fromkeys(one.light for one in photos))
    middles = tuple(float(np.median(_direct(one.place - one.points)[0])) for one in photos)
    layout = _Layout(channels, lights, len(photos), middles)
    values, scale = _start(layout, photos), np.full(2, _WIDE)
    alike = dict.fromkeys(lights, _ALIKE[1])
    for _ in range(2):
        held, expected = _priors(layout, photos, values, alike)
        values, scale = _settled(layout, photos, values, scale, (held, expected))
        alike = {name: _scatter(layout, photos, values, name) for name in lights}
    return _finished(layout, photos, values, scale, held)


def _finished(
    layout: _Layout, photos: Sequence[PaperCodes], values: np.ndarray, scale: np.ndarray, held: np.ndarray
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
    ink, lens = np.exp(values[layout.ink : layout.lens]), values[layout.lens : layout.veil]
    return FittedResponse(curves, places, ink, misfit, black, float(values[layout.veil]), lens)


def _settled(
    layout: _Layout,
    photos: Sequence[PaperCodes],
    values: np.ndarray,
    scale: np.ndarray,
    expectation: tuple[np.ndarray, np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """The values where the fit ends, and how far white and black print then miss, in their errors."""
    held, expected = expectation
    for _ in range(_ROUNDS):
        normal, pull, misses = _normal(layout, photos, values, scale)
        pull = pull - held.T @ (held @ values - expected)
        step = _shortened(layout, values, np.linalg.solve(normal + held.T @ held, pull))
        values = values + step
        scale = np.clip(misses, 0.5, np.maximum(scale / 2, 1.0))
        if np.abs(step[: layout.strengths]).max() < _STILL:
            break
    return values, scale


def _strengths(layout: _Layout, photos: Sequence[PaperCodes], name: str) -> list[tuple[np.ndarray, float]]:
    """Of a light's photos: which unknowns are its strengths there, and what makes them those at one exposure."""
    own = [k for k, one in enumerate(photos) if one.light == name]
    return [
        (
            layout.strengths + k * layout.channels + np.arange(layout.channels),
            float(np.log(layout.middles[k] * photos[k].exposure)),
        )
        for k in own
    ]


def _scatter(layout: _Layout, photos: Sequence[PaperCodes], values: np.ndarray, name: str) -> float:
    """By how much a lamp that shone in several photos was not as strong in all of them, its logarithm."""
    strong = np.array([values[at].mean() - by for at, by in _strengths(layout, photos, name)])
    if len(strong) < 3:
        return _ALIKE[1]
    return float(np.clip(_ALIKE[2] * robust.scatter(strong), *_ALIKE[:2]))


def _start(layout: _Layout, photos: Sequence[PaperCodes]) -> np.ndarray:
    values = np.zeros(layout.size)
    for k, name in enumerate(layout.lights):
        own = [one for one in photos if one.light == name]
        places = [one.pose.apply(one.place) if one.attached else one.place for one in own]
        values[layout.places + 3 * k : layout.places + 3 * k + 3] = np.median(places, axis=0)
    inks = []
    for k, one in enumerate(photos):
        light = _light(layout, one, k, values)[0]
        lit = one.white
        seen = np.log(np.maximum(srgb(one.code[lit]), 1e-9)) - np.log(light[lit])[:, None]
        at = layout.strengths + k * layout.channels
        values[at : at + layout.channels] = np.median(seen, axis=0)
        dark = np.log(np.maximum(srgb(one.code[~lit]), 1e-9)) - np.log(light[~lit])[:, None]
        inks.append(np.median(dark, axis=0) - np.median(seen, axis=0))
    values[layout.ink : layout.lens] = np.median(inks, axis=0)
    return values


def _priors(
    layout: _Layout, photos: Sequence[PaperCodes], values: np.ndarray, alike: dict[str, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Rows over all unknowns in standard deviations, and what they are expected to be."""
    bends = np.vstack([prior(layout.channels), anchors(layout.channels) / _ANCHORED])
    rows = [np.hstack([bends, np.zeros((len(bends), layout.size - layout.strengths))])]
    expected = [np.zeros(len(bends))]

    def hold(at: int, value: float, sigma: float) -> None:
        row = np.zeros(layout.size)
        row[at] = 1.0 / sigma
        rows.append(row[None])
        expected.append(np.array([value / sigma]))

    for k, name in enumerate(layout.lights):
        own = next(one for one in photos if one.light == name)
        at = layout.places + 3 * k
        for axis in range(3):
            if np.isfinite(own.sure):
                hold(at + axis, values[at + axis], own.sure)
            elif own.attached:
                side = float(np.hypot(*values[at : at + 2]))
                hold(at + axis, 0.0, _BESIDE if axis < 2 else _DEPTH[0] + _DEPTH[1] * side)
        lit = _strengths(layout, photos, name)
        for which, by in lit:
            for channel in range(layout.channels):
                row = np.zeros(layout.size)
                for others, _ in lit:
                    row[others[channel]] -= 1.0 / len(lit)
                row[which[channel]] += 1.0
                sigma = alike[name] * np.sqrt(layout.channels)
                rows.append(row[None] / sigma)
                expected.append(np.array([(by - np.mean([b for _, b in lit])) / sigma]))
    for k in range(layout.photos):
        hold(layout.even + k, 0.0, _EVEN)
    mean = np.zeros(layout.size)
    mean[layout.ink : layout.lens] = 1.0 / (layout.channels * _INKS)
    rows.append(mean[None])
    expected.append(np.array([np.log(_INK) / _INKS]))
    for k in range(layout.channels):
        row = np.zeros(layout.size)
        row[layout.ink : layout.lens] = -1.0 / (layout.channels * _INKS_APART)
        row[layout.ink + k] += 1.0 / _INKS_APART
        rows.append(row[None])
        expected.append(np.zeros(1))
    hold(layout.lens, 0.0, _LENS)
    hold(layout.lens + 1, 0.0, _LENS)
    hold(layout.veil, 0.0, _VEIL)
    return np.vstack(rows), np.concatenate(expected)


def _direct(offset: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Light (n,) on level ground of a lamp of unit strength ``offset`` (n, 3) away, that squared, and its height."""
    squared = (offset**2).sum(1)
    height = np.maximum(offset[:, 2], 1e-3 * np.sqrt(squared))
    return height / squared**1.5, squared, height


def _light(
    layout: _Layout, one: PaperCodes, number: int, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Direct light (n,) over its middle with what is even, its logarithm's slopes (n, 3) by the lamp's place, and what
    is even of it (n,)."""
    at = layout.places + 3 * layout.lights.index(one.light)
    place = values[at : at + 3]
    world = one.pose.inverse().apply(place) if one.attached else place
    offset = world - one.points
    direct, squared, height = _direct(offset)
    middle = layout.middles[number]
    even = values[layout.even + number]
    light = np.maximum(direct / middle + even, 1e-3)
    by_place = -3 * offset / squared[:, None]
    by_place[:, 2] += 1.0 / height
    if one.attached:
        by_place = by_place @ one.pose.rotation.T
    return light, by_place * (direct / middle / light)[:, None], 1.0 / light


def _inverse(bend: np.ndarray, light: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Codes (n,) of the logarithm of light (n,) by a curve's bend, and how steeply that rises with the code (n,)."""
    own = np.log(srgb(_GRID)) + _SHAPES @ bend
    rising = np.maximum.accumulate(own) + _LEAST_RISE * _GRID
    steep = np.gradient(rising, _GRID)
    code = np.interp(light, rising, _GRID)
    return code, np.interp(code, _GRID, steep)


def _design(
    layout: _Layout, one: PaperCodes, number: int, values: np.ndarray, channel: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Derivatives (n, k) by :meth:`_Layout.asked` of the code that the light should have, how far the code is from it
    (n,), and the standard error of that (n,)."""
    light, by_place, by_even = _light(layout, one, number, values)
    code, black = one.code[:, channel], ~one.white
    bend = values[:BENDS] + values[(channel + 1) * BENDS : (channel + 2) * BENDS]
    ink, veil = np.exp(values[layout.ink + channel]), values[layout.veil]
    tone = np.where(black, ink, 1.0) * light
    total = np.maximum(tone + veil, 1e-3 * tone)
    lens = np.column_stack([one.aside, one.aside**2])
    strength = values[layout.strengths + number * layout.channels + channel]
    said = strength + np.log(total) + lens @ values[layout.lens : layout.veil]
    expected, steep = _inverse(bend, said)
    shape, share = basis(expected), tone / total
    design = np.column_stack(
        [
            -shape,
            -shape,
            np.ones(len(code)),
            by_place * share[:, None],
            by_even * share,
            np.where(black, share, 0.0),
            lens,
            1.0 / total,
        ]
    )
    model = np.where(black, _INK_MODEL, _MODEL) / np.interp(code, _GRID, _STEEP)
    return design / steep[:, None], code - expected, np.hypot(one.noise[:, channel], model)


@dataclass(frozen=True, slots=True)
class _Weighed:
    """One photo's channel: derivatives and misses in their standard errors, weighed down where they are wild."""

    asked: np.ndarray  # (k,) the unknowns
    design: np.ndarray  # (n, k)
    miss: np.ndarray  # (n,)
    bare: np.ndarray  # (n,) misses before they are weighed


def _weighed(
    layout: _Layout, photos: Sequence[PaperCodes], values: np.ndarray, scale: np.ndarray
) -> Iterator[tuple[int, _Weighed]]:
    for number, one in enumerate(photos):
        bound = _TUKEY * scale[one.white.astype(int)]
        for channel in range(layout.channels):
            design, miss, error = _design(layout, one, number, values, channel)
            z = miss / error
            weight = robust.tukey_weight(z, bound)
            asked = layout.asked(one.light, number, channel)
            yield number, _Weighed(asked, design * (weight / error)[:, None], weight * z, z)


def _normal(
    layout: _Layout, photos: Sequence[PaperCodes], values: np.ndarray, scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Normal matrix and pull of all unknowns; how far black and white print miss (2,), in their errors."""
    normal, pull = np.zeros((layout.size, layout.size)), np.zeros(layout.size)
    misses: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
    for number, one in _weighed(layout, photos, values, scale):
        normal[np.ix_(one.asked, one.asked)] += one.design.T @ one.design
        pull[one.asked] += one.design.T @ one.miss
        for kind in (0, 1):
            misses[kind].append(one.bare[photos[number].white == kind])
    return normal, pull, np.array([robust.deviation(np.concatenate(each)) for each in misses])


def _scores(
    layout: _Layout, photos: Sequence[PaperCodes], values: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """Sum of the squares of what each square of each photo pulls at the unknowns, all its channels together."""
    pulls = [np.zeros((len(one.code), layout.size)) for one in photos]
    for number, one in _weighed(layout, photos, values, scale):
        pulls[number][:, one.asked] += one.design * one.miss[:, None]
    total = np.zeros((layout.size, layout.size))
    for each in pulls:
        total += each.T @ each
    return total


def _shortened(layout: _Layout, values: np.ndarray, step: np.ndarray) -> np.ndarray:
    """A step that moves no lamp too far at once."""
    for k in range(len(layout.lights)):
        at = slice(layout.places + 3 * k, layout.places + 3 * k + 3)
        far = max(float(np.linalg.norm(values[at])), 100.0)
        moved = float(np.linalg.norm(step[at]))
        if moved > _STEP * far:
            step = step * (_STEP * far / moved)
    return step


def _misfits(layout: _Layout, photos: Sequence[PaperCodes], values: np.ndarray) -> tuple[float, float]:
    """Of white and black print, as shares of their light were the curve sRGB's."""
    white, black = [], []
    for number, one in enumerate(photos):
        for channel in range(layout.channels):
            miss = _design(layout, one, number, values, channel)[1] * np.interp(
                one.code[:, channel], _GRID, _STEEP
            )
            white.append(miss[one.white])
            black.append(miss[~one.white])
    of_white, of_black = (float(robust.deviation(np.concatenate(each))) for each in (white, black))
    return of_white, of_black
