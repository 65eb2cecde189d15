"""Which tone curve makes black print the same share of white, however much light falls on both.

Ink sends on a fixed share of what the paper beside it does. Read by a curve that is not the file's, the share goes with
the light: of sRGB codes read as gamma 2.2 it halves from bright paper to dim. So codes of black and of the white beside
it are undone by each curve that files are commonly written with, and the one under which the share stays is theirs.
Curves that are powers of one another, as gamma 1.8 and 2.2, make as steady a share: the print alone leaves them open
but for the ink, which is no paler or deeper than inks are. Veils of light, and a wrong black level, are allowed for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from photogonio.capture import robust
from photogonio.capture.containers.tone import ADOBE_GAMMA, LINEAR, SRGB, Curve, difference
from photogonio.capture.linear.encoding import Encoding

CURVES = (LINEAR, SRGB, Curve("bt709"), *(Curve("gamma", (power,)) for power in (1.8, 2.2, 2.4)))
SAME = 0.02  # relative difference of two curves that are one
SURE = 12.0  # by which the logarithm of odds, doubled, must favour another curve
_BIN, _IN_BIN = 0.2, 12  # of the logarithm of light, and samples that one must hold
_UNEVEN = 0.01  # relative: by which print is blacker in one place than in another
_TOGETHER = 4.0  # samples whose errors go together
_CHANNELS = 3  # that are asked
_PHOTO = 2.0  # readings that the bins of a photo count as: their errors go together
_BEST = 0.35  # of the errors expected, below which no curve is any better
INK, _INKS = 0.05, 0.5  # share of black in white, and how far inks differ, in its logarithm
_INK_HELD = 0.05  # as far as evenly lit print, which knows no ink from a veil, is held to it
# what a veil, as a share of the middle white, and a black level, of full scale, may be: as it is read, and by another
# curve; less than none is rare
_VEIL, _LIFT, _LESS = 0.05, 0.02, (0.005, 0.001)
# error of a power by lamps that mirror balls show, and how much it has to say
_LEAST_POWER, _POWER_SAYS = 0.05, 20.0
_PLAUSIBLE = (
    9.0  # of the same logarithm: what explains the print by an ink or veil beyond it explains nothing
)
_ROUNDS, _WILD = 25, 2.0
_CODES = np.linspace(0.0, 1.0, 4097)


@dataclass(frozen=True, slots=True)
class PrintLevels:
    """One photo's black print and the white beside it, as codes were read: signal, 1 at full scale."""

    white: np.ndarray  # (n, c)
    black: np.ndarray  # (n, c)
    encoding: Encoding  # by which they were read
    steps: float  # codes of full scale

    @property
    def coarse(self) -> np.ndarray:
        """Standard deviation (n, c) by which black is rounded to whole codes."""
        found = np.empty_like(self.black)
        for channel, level in enumerate(self.black.T):
            light = _light(self.encoding, self.black.shape[1], channel)
            found[:, channel] = np.interp(level, light, np.gradient(light, _CODES))
        return found / self.steps / np.sqrt(12)


@dataclass(frozen=True, slots=True)
class Power:
    """By which power white paper, as it was read, grows with the light on it."""

    value: float
    error: float

    def against(self, expected: float) -> float:
        """Minus twice the logarithm of how likely it is; a lamp's beam, or a second light, makes it anything."""
        return min(((self.value - expected) / np.hypot(self.error, _LEAST_POWER)) ** 2, _POWER_SAYS)


@dataclass(frozen=True, slots=True)
class Steady:
    """How steady one curve makes the share of black in white."""

    misfit: float  # of the errors expected, the middle one
    ink: float  # the share
    unlikely: float  # of its ink, veil and black level, minus twice the logarithm

    @property
    def odd_ink(self) -> float:
        """The same of its ink alone."""
        return float(np.log(self.ink / INK) / _INKS) ** 2


@dataclass(frozen=True, slots=True)
class ToneVerdict:
    """What the print says of the curve."""

    curve: Curve  # under which the share of black is steadiest
    read_curve: Curve  # by which codes were read
    read: Steady  # as the codes were read
    best: Steady  # by ``curve``
    odds: dict[
        Curve, float
    ]  # twice their logarithm, of every curve that is likely, against the one that was read

    @property
    def surer(self) -> float:
        """Twice the logarithm of the odds for ``curve``, 0 if it is the one that was read."""
        return self.odds[self.curve]

    @property
    def contradicted(self) -> bool:
        return self.surer >= SURE

    @property
    def unsteady(self) -> bool:
        """Whether that is so whatever ink it is."""
        return self.surer - self.read.odd_ink >= SURE


@dataclass(frozen=True, slots=True)
class _Bins:
    """Middle levels of a photo's print by how bright it is, all photos and channels after one another."""

    photo: np.ndarray  # (m,) int
    channel: np.ndarray  # (m,) int
    white: np.ndarray  # (m,)
    black: np.ndarray  # (m,)
    error: np.ndarray  # (m,) standard error of black


def told_by_levels(photos: Sequence[PrintLevels], power: Power | None = None) -> ToneVerdict | None:
    """What photos that were read by one and the same curve say of it; None if they show too little print. ``power``:
    by which white was seen to grow with light."""
    bins = binned(photos)
    if bins is None:
        return None
    read = read_curve(photos[0].encoding)
    own = steadiness(bins, photos, None)
    count = _PHOTO * len(np.unique(bins.photo))
    found = {one: steadiness(bins, photos, one) for one in CURVES if difference(one, read) > SAME}
    surer = {read: 0.0}
    for curve, other in found.items():
        if other.unlikely > _PLAUSIBLE:
            continue
        surer[curve] = count * _closer(own.misfit, other.misfit) + own.unlikely - other.unlikely
        if power is not None:
            surer[curve] += power.against(1.0) - power.against(power_between(bins, photos, curve))
    best = max(surer, key=lambda curve: surer[curve])
    return ToneVerdict(best, read, own, found.get(best, own), surer)


def _closer(own: float, other: float) -> float:
    """How much nearer another curve brings the print than the one it was read by, in squares of its errors. One that
    leaves it farther off than errors do, and than its own does, speaks against itself: whatever white's power says,
    which a second light or a lamp that balls show poorly makes anything."""
    floor, expected = max(other, _BEST), max(own, 1.0)
    return (max(own, floor) / floor) ** 2 - (max(other, expected) / expected) ** 2


def read_curve(encoding: Encoding) -> Curve:
    """The curve alone of an encoding that is no table."""
    if encoding.kind == "gamma":
        power = encoding.gamma
        return Curve("gamma", (2.2 if abs(power - ADOBE_GAMMA) < 1e-3 else power,))
    if encoding.kind == "curves":
        return encoding.curves[0]
    return {"srgb": SRGB}.get(encoding.kind, LINEAR)


def binned(photos: Sequence[PrintLevels]) -> _Bins | None:
    """Middle shares of black in white by the logarithm of light; None if there are none."""
    rows: list[tuple[float, ...]] = []
    for photo, one in enumerate(photos):
        channels = one.white.shape[1]
        for channel in np.unique(np.linspace(0, channels - 1, min(channels, _CHANNELS)).astype(int)):
            lit = one.white[:, channel] > 0
            white, black, coarse = (a[lit, channel] for a in (one.white, one.black, one.coarse))
            kind = np.floor(np.log(white) / _BIN).astype(int)
            for here in (kind == k for k in np.unique(kind)):
                if here.sum() < _IN_BIN:
                    continue
                share = black[here] / white[here]
                middle, light = float(robust.median(share)), float(robust.median(white[here]))
                scatter = float(robust.deviation(share - middle)) * np.sqrt(_TOGETHER / here.sum())
                rounded = float(robust.median(coarse[here])) / light
                error = np.sqrt(scatter**2 + rounded**2 + (_UNEVEN * middle) ** 2)
                rows.append((photo, channel, light, middle * light, error * light))
    if not rows:
        return None
    found = np.array(rows).T
    return _Bins(found[0].astype(int), found[1].astype(int), *found[2:])


def steadiness(bins: _Bins, photos: Sequence[PrintLevels], curve: Curve | None) -> Steady:
    """Of the print read by ``curve`` instead; by what it was read if None."""
    if curve is not None:
        bins = _reread(bins, photos, curve)
    channels = np.unique(bins.channel)
    middle = np.array([robust.median(bins.white[bins.photo == k]) for k in bins.photo])
    columns = [np.where(bins.channel == c, bins.white, 0.0) for c in channels]
    design = np.column_stack([*columns, middle, np.ones(len(middle))]) / bins.error[:, None]
    target, share = bins.black / bins.error, np.sqrt(_PHOTO * len(np.unique(bins.photo)) / len(middle))
    usual = np.array([*np.full(len(channels), INK), 0.0, 0.0])
    weight, found, miss = np.ones(len(target)), np.zeros(design.shape[1]), target
    for _ in range(_ROUNDS):
        most = [
            big if curve is None and value >= 0 else little
            for big, little, value in zip((_VEIL, _LIFT), _LESS, found[-2:], strict=True)
        ]
        held = np.diag(1.0 / np.array([*np.full(len(channels), _INK_HELD), *most]))
        rows = np.vstack([design * (share * weight)[:, None], held])
        found = np.linalg.lstsq(rows, np.append(target * share * weight, held @ usual), rcond=None)[0]
        miss = target - design @ found
        scale = float(robust.deviation(miss)) + 1e-12
        weight = 1.0 / np.sqrt(np.maximum(1.0, np.abs(miss) / (_WILD * scale)))
    ink = float(np.exp(np.mean(np.log(np.maximum(found[: len(channels)], 1e-6)))))
    away = found[-2:] / np.array(most)
    steady = Steady(float(robust.deviation(miss)), ink, float(away @ away))
    return replace(steady, unlikely=steady.unlikely + steady.odd_ink)


def power_between(bins: _Bins, photos: Sequence[PrintLevels], curve: Curve) -> float:
    """By which power white, as it was read, grows with the light that it has by another curve."""
    light = _reread(bins, photos, curve).white
    x, y = np.log(np.maximum(light, 1e-9)), np.log(bins.white)
    x = x - x.mean()
    return float(x @ y / max(float(x @ x), 1e-12))


def _reread(bins: _Bins, photos: Sequence[PrintLevels], curve: Curve) -> _Bins:
    """The levels that the same codes are by another curve."""
    white, black, high, low = (
        a.copy()
        for a in (bins.white, bins.black, bins.black + bins.error, np.maximum(bins.black - bins.error, 0.0))
    )
    for photo, channel in {(int(p), int(c)) for p, c in zip(bins.photo, bins.channel, strict=True)}:
        here = (bins.photo == photo) & (bins.channel == channel)
        own, channels = photos[photo].encoding, photos[photo].white.shape[1]
        read = _light(own, channels, channel)
        light = _light(replace(own, kind="curves", curves=(curve,)), channels, channel)
        for level in (white, black, high, low):
            level[here] = np.interp(level[here], read, light)
    error = np.maximum((high - low) / 2, 1e-9)
    return replace(bins, white=white, black=black, error=error)


def _light(encoding: Encoding, channels: int, channel: int) -> np.ndarray:
    """Signal of codes from 0 to full scale, of one channel."""
    return encoding.linear(np.repeat(_CODES[:, None], channels, axis=1), channels)[:, channel]
