"""What is sought beside a tone curve, where each unknown stands among all, and what is expected of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from photogonio.calib.response.curve import BENDS, anchors, prior
from photogonio.calib.response.paper_codes import PaperCodes
from photogonio.capture import robust

_INK, _INKS, _INKS_APART = 0.05, 0.3, 0.1  # ink's share of white, how inks differ, and how its channels do
_GREY, _GREYS = 0.3, 1.0  # the same of grey print, of which next to nothing is known
_EVEN = 0.005  # light that is everywhere, as a share of the lamp's
_LENS = 0.1  # what a lens may darken towards the corner, its logarithm
# of a lamp's strength from photo to photo: least and most that it is taken to vary, and over how it is seen to
_ALIKE = (0.004, 0.05, 2.0)
NO_SCATTER = _ALIKE[1]
_BESIDE = 150.0  # that a lamp on the camera stands beside the lens, about, millimetres
# that it stands before the lens or behind it, millimetres, and more the further beside it
_DEPTH = (5.0, 0.3)
_VEIL = 0.003  # of white, over the whole picture
# how far off strengths' logarithms and lamps, over their distance, may be at first: next to nothing is known
_STRENGTH, _REACH = 3.0, 1.0
_LOWEST = (
    0.3  # height over distance at which a lamp is first sought, at least: one that starts too low stays there
)


@dataclass(frozen=True, slots=True)
class Unknowns:
    """Where each unknown stands."""

    channels: int
    lights: tuple[str, ...]
    photos: int
    middles: tuple[float, ...]  # of the direct light of each photo, about: that is 1
    tones: int = 1  # of print that is not white: black, and greys
    attached: tuple[str, ...] = ()  # lights that move with the camera

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
        return self.ink + self.tones * self.channels

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
        inks = self.ink + channel + self.channels * np.arange(self.tones)
        shared = [self.lens, self.lens + 1, self.veil]
        return np.concatenate([bend, bend + (channel + 1) * BENDS, own, inks, shared])

    @property
    def size(self) -> int:
        return self.veil + 1


def strengths_of(layout: Unknowns, photos: Sequence[PaperCodes], name: str) -> list[tuple[np.ndarray, float]]:
    """Of a light's photos: which unknowns are its strengths there, and what makes them those at one exposure."""
    own = [k for k, one in enumerate(photos) if one.light == name]
    return [
        (
            layout.strengths + k * layout.channels + np.arange(layout.channels),
            float(np.log(layout.middles[k] * photos[k].exposure)),
        )
        for k in own
    ]


def scatter_of(layout: Unknowns, photos: Sequence[PaperCodes], values: np.ndarray, name: str) -> float:
    """By how much a lamp that shone in several photos was not as strong in all of them, its logarithm."""
    strong = np.array([values[at].mean() - by for at, by in strengths_of(layout, photos, name)])
    if len(strong) < 3:
        return _ALIKE[1]
    return float(np.clip(_ALIKE[2] * robust.scatter(strong), *_ALIKE[:2]))


def raised(place: np.ndarray) -> np.ndarray:
    """A lamp's place (3,), not below the board nor just above it, as a wrong curve may have it."""
    least = _LOWEST * float(np.linalg.norm(place[:2]))
    return np.append(place[:2], max(float(place[2]), least))


def expectations(
    layout: Unknowns,
    photos: Sequence[PaperCodes],
    values: np.ndarray,
    alike: dict[str, float],
    drawn: float = 1.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Rows over all unknowns in standard deviations, and what they are expected to be, of a curve as strong as
    ``drawn``."""
    bends = np.vstack([prior(layout.channels, drawn), anchors(layout.channels)])
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
            elif not own.attached:
                hold(at + axis, values[at + axis], _REACH * float(np.linalg.norm(values[at : at + 3])))
            else:
                side = float(np.hypot(*values[at : at + 2]))
                depth = _DEPTH[0] * own.millimetre + _DEPTH[1] * side
                hold(at + axis, 0.0, _BESIDE * own.millimetre if axis < 2 else depth)
        lit = strengths_of(layout, photos, name)
        for which, by in lit:
            for channel in range(layout.channels):
                row = np.zeros(layout.size)
                for others, _ in lit:
                    row[others[channel]] -= 1.0 / len(lit)
                row[which[channel]] += 1.0
                sigma = alike[name] * np.sqrt(layout.channels)
                rows.append(row[None] / sigma)
                expected.append(np.array([(by - np.mean([b for _, b in lit])) / sigma]))
    for k in range(layout.strengths, layout.places):
        hold(k, values[k], _STRENGTH)
    for k in range(layout.photos):
        hold(layout.even + k, 0.0, _EVEN)
    for tone in range(layout.tones):
        usual, differ = (_INK, _INKS) if tone == 0 else (_GREY, _GREYS)
        first = layout.ink + tone * layout.channels
        mean = np.zeros(layout.size)
        mean[first : first + layout.channels] = 1.0 / (layout.channels * differ)
        rows.append(mean[None])
        expected.append(np.array([np.log(usual) / differ]))
        for k in range(layout.channels):
            row = np.zeros(layout.size)
            row[first : first + layout.channels] = -1.0 / (layout.channels * _INKS_APART)
            row[first + k] += 1.0 / _INKS_APART
            rows.append(row[None])
            expected.append(np.zeros(1))
    hold(layout.lens, 0.0, _LENS)
    hold(layout.lens + 1, 0.0, _LENS)
    hold(layout.veil, 0.0, _VEIL)
    return np.vstack(rows), np.concatenate(expected)
