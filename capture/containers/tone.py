"""What a file says of its tone curve: how its codes stand for light.

A profile's curve undoes the codes; its primaries are left alone, so that colour stays the camera's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

SAME = 3e-4  # of full scale, by which two curves may differ and be one and the same
GRID = np.linspace(0.0, 1.0, 1025)
NAMES = {"linear": "linear", "srgb": "sRGB", "bt709": "ITU-R BT.709", "pq": "PQ", "hlg": "HLG"}
# ITU-T H.273, table 3: transfer characteristics. 2: unspecified
CICP = {
    1: "bt709",
    6: "bt709",
    11: "bt709",
    12: "bt709",
    14: "bt709",
    15: "bt709",
    8: "linear",
    13: "srgb",
    16: "pq",
    18: "hlg",
}
CICP_GAMMA = {4: 2.2, 5: 2.8, 17: 2.6}  # 17: SMPTE ST 428-1, but for a factor
UNREAD = {9: "logarithmic", 10: "logarithmic"}
# as a parametric curve's numbers
SMPTE_240M = (1 / 0.45, 1 / 1.1115, 0.1115 / 1.1115, 0.25, 4 * 0.0228, 0.0, 0.0)
# exponents of curves from half scale to the whole lie between this and its inverse: PQ has 6.8
STEEPEST = 10.0
ADOBE_GAMMA = 563 / 256  # Adobe RGB (1998), section 4.3.4


@dataclass(frozen=True, slots=True)
class Curve:
    """From codes to light, both as fractions of full scale.

    ``kind`` is "linear", "srgb" (IEC 61966-2-1), "gamma" (numbers: the exponent), "parametric" (numbers g, a, b, c, d,
    e, f: (a x + b)^g + e from d on, c x + f below; ICC.1:2022, section 10.18), "table" (numbers: light at evenly spaced
    codes), or the inverse of a transfer function of ITU-R BT.709 or BT.2100: "bt709", "pq", "hlg".
    """

    kind: str
    numbers: tuple[float, ...] = ()

    def light(self, code: np.ndarray) -> np.ndarray:
        """Linear light (...) of codes (...)."""
        code = np.asarray(code, float)
        if self.kind == "linear":
            return code
        if self.kind == "gamma":
            return np.sign(code) * np.abs(code) ** self.numbers[0]
        if self.kind == "table":
            return np.interp(code, np.linspace(0.0, 1.0, len(self.numbers)), self.numbers)
        if self.kind == "parametric":
            return parametric(code, self.numbers)
        return TRANSFERS[self.kind](code)

    @property
    def name(self) -> str:
        if self.kind == "gamma":
            return f"gamma {self.numbers[0]:.6g}"
        return NAMES.get(self.kind, "a curve of its own")


@dataclass(frozen=True, slots=True)
class Tone:
    """The tone curve of a file: one for all channels, or one a channel."""

    curves: tuple[Curve, ...]
    source: str  # what says so, such as 'ICC profile "Adobe RGB (1998)"'
    told: bool = True  # by the file; else taken from its kind of numbers

    @property
    def name(self) -> str:
        return self.curves[0].name if len(self.curves) == 1 else "a curve for each channel"


LINEAR, SRGB = Curve("linear"), Curve("srgb")


def parametric(code: np.ndarray, numbers: Sequence[float]) -> np.ndarray:
    g, a, b, c, d, e, f = numbers
    return np.where(code >= d, np.maximum(a * code + b, 0.0) ** g + e, c * code + f)


def srgb(code: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1."""
    return np.where(code <= 0.04045, code / 12.92, ((np.maximum(code, 0.0) + 0.055) / 1.055) ** 2.4)


def bt709(code: np.ndarray) -> np.ndarray:
    """ITU-R BT.709-6, item 1.2, from signal to light of the scene."""
    return np.where(code < 0.081, code / 4.5, ((np.maximum(code, 0.0) + 0.099) / 1.099) ** (1 / 0.45))


def pq(code: np.ndarray) -> np.ndarray:
    """ITU-R BT.2100-2, table 4: 1 is 10,000 cd/m^2."""
    m1, m2, c1, c2, c3 = 2610 / 16384, 2523 / 32, 3424 / 4096, 2413 / 128, 2392 / 128
    power = np.clip(code, 0.0, 1.0) ** (1 / m2)
    return (np.maximum(power - c1, 0.0) / (c2 - c3 * power)) ** (1 / m1)


def hlg(code: np.ndarray) -> np.ndarray:
    """ITU-R BT.2100-2, table 5, from signal to light of the scene."""
    a, b, c = 0.17883277, 0.28466892, 0.55991073
    return np.where(code <= 0.5, np.square(code) / 3, (np.exp((np.asarray(code) - c) / a) + b) / 12)


TRANSFERS = {"srgb": srgb, "bt709": bt709, "pq": pq, "hlg": hlg}


@cache
def named(curve: Curve) -> Curve:
    """The curve by its name, where it is sRGB's or straight within SAME."""
    light = curve.light(GRID)
    for known in (LINEAR, SRGB):
        if np.abs(light - known.light(GRID)).max() <= SAME:
            return known
    return curve


def rises(curve: Curve) -> bool:
    """Whether it is one that codes can stand for light by: finite, nowhere falling, neither flat nor a step."""
    with np.errstate(all="ignore"):
        light = curve.light(GRID)
        exponent = float(np.log2(light[-1] / light[len(GRID) // 2]))
    sound = np.isfinite(light).all() and (np.diff(light) >= 0).all() and light[-1] > max(light[0], 0.0)
    return bool(sound and 1 / STEEPEST <= exponent <= STEEPEST)


def difference(one: Curve, other: Curve) -> float:
    """How far two curves lie apart, both 1 at full scale: the greatest difference, in light from a fiftieth of full
    scale up, relative."""
    a, b = (curve.light(GRID) / curve.light(np.array(1.0)) for curve in (one, other))
    bright = np.maximum(a, b) > 0.02
    return float((np.abs(a - b)[bright] / np.maximum(a, b)[bright]).max())


def of_cicp(transfer: int, source: str) -> Tone | None:
    """By a code of ITU-T H.273; None for those that say nothing, or nothing known here.

    Raises ValueError for curves that are known and not read.
    """
    if transfer in UNREAD:
        raise ValueError(f"{source} is {UNREAD[transfer]} (transfer {transfer}), which is not read")
    if transfer == 7:
        return Tone((Curve("parametric", SMPTE_240M),), source)
    if transfer in CICP_GAMMA:
        return Tone((Curve("gamma", (CICP_GAMMA[transfer],)),), source)
    return Tone((Curve(CICP[transfer]),), source) if transfer in CICP else None


def of_exif(colour_space: object, interoperability: object) -> Tone | None:
    """By EXIF's ColorSpace, 1 for sRGB; Adobe RGB is told by the interoperability index R03 (DCF 2.0), or by 2."""
    if colour_space == 1:
        return Tone((SRGB,), "EXIF ColorSpace sRGB")
    if colour_space == 2 or str(interoperability).startswith("R03"):
        return Tone((Curve("gamma", (ADOBE_GAMMA,)),), "EXIF ColorSpace Adobe RGB")
    return None


def untold(*, bits: int, lossy: bool) -> Tone:
    """Of a file that says nothing: pictures of 8 bits, and JPEG, are sRGB, all others linear."""
    if lossy:
        return Tone((SRGB,), "a picture made for the screen", told=False)
    return Tone((SRGB,), "8 bits", told=False) if bits == 8 else Tone((LINEAR,), f"{bits} bits", told=False)
