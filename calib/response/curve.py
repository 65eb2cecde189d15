"""A tone curve as sRGB's and what bends it: a spline, one for all channels and a small one of each channel's own."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import BSpline

from photogonio.capture.containers.tone import srgb

KNOTS = 14  # along the root of the code, which lies between code and logarithm: fine in the dark as in light
_FIRST = 0.08  # root of the code at which they begin
BENDS = KNOTS + 2
ANCHOR = 0.8  # code at which the bend is 0: exposure knows no other scale
# what curves of cameras do, standard deviations: the bend's slope against the logarithm of light, how that changes from
# one knot to the next, and how a channel differs from the others
_SLOPE, _CHANGE, _SUDDEN, _OWN, _OWN_CHANGE = 0.4, 0.12, 0.08, 0.02, 0.01
_NARROW = 0.2  # of the logarithm of light, the least between knots


@cache
def _knots() -> np.ndarray:
    inner = np.linspace(_FIRST, 1.0, KNOTS)
    step = inner[1] - inner[0]
    return inner[0] + step * np.arange(-3, KNOTS + 3)


def _root(codes: np.ndarray) -> np.ndarray:
    knots = _knots()
    return np.clip(np.sqrt(np.maximum(codes, 0.0)), knots[3], knots[-4])


def basis(codes: np.ndarray) -> np.ndarray:
    """The spline's functions (n, BENDS) at codes (n,), fractions of full scale; below the first knot as there."""
    return BSpline.design_matrix(_root(codes), _knots(), 3).toarray()


def prior(channels: int) -> np.ndarray:
    """Rows (m, (1 + channels) BENDS) of what is expected of the bends, each in its standard deviations: the common
    one's, then each channel's own."""
    centres = np.maximum(_knots()[2:-2], _FIRST / 2)
    light = np.log(srgb(centres**2))
    first, second, third = (np.diff(np.eye(BENDS), order, axis=0) for order in (1, 2, 3))
    step = np.maximum(np.diff(light), _NARROW)
    common = np.vstack(
        [first / (_SLOPE * step)[:, None] / np.sqrt(len(first)), second / _CHANGE, third / _SUDDEN]
    )
    own = np.vstack([first / _OWN, second / _OWN_CHANGE])
    return np.vstack(
        [_placed(common, 0, channels), *(_placed(own, c + 1, channels) for c in range(channels))]
    )


def _placed(rows: np.ndarray, block: int, channels: int) -> np.ndarray:
    wide = np.zeros((len(rows), (1 + channels) * BENDS))
    wide[:, block * BENDS : (block + 1) * BENDS] = rows
    return wide


def anchors(channels: int) -> np.ndarray:
    """Rows (1 + channels, ...) that are 0: the bends at the anchor."""
    at = basis(np.array([ANCHOR]))
    return np.vstack([_placed(at, block, channels) for block in range(1 + channels)])


@dataclass(frozen=True, slots=True)
class Curves:
    """Of all channels."""

    bends: np.ndarray  # (1 + c, BENDS)
    covariance: np.ndarray  # of all of them, after one another
    seen: tuple[float, float]  # codes between which the print told it

    @property
    def channels(self) -> int:
        return len(self.bends) - 1

    def log_light(self, codes: np.ndarray, channel: int) -> np.ndarray:
        """Logarithm (n,) of the light of codes (n,), but for a constant."""
        base = np.log(np.maximum(srgb(np.maximum(codes, 1e-6)), 1e-12))
        return base + basis(codes) @ (self.bends[0] + self.bends[channel + 1])

    def error_between(self, codes: np.ndarray, others: np.ndarray, channel: int) -> np.ndarray:
        """Standard errors (n,) of the logarithm of the ratio of the light of codes and of others, (n,) each."""
        apart = basis(codes) - basis(others)
        wide = np.zeros((len(codes), self.bends.size))
        wide[:, :BENDS] = apart
        wide[:, (channel + 1) * BENDS : (channel + 2) * BENDS] = apart
        return np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", wide, self.covariance, wide), 0.0))

    def table(self, size: int = 1024) -> np.ndarray:
        """Light (size, c) at evenly spaced codes: 0 at 0, 1 at full scale, rising."""
        codes = np.linspace(0.0, 1.0, size)
        light = np.exp(np.column_stack([self.log_light(codes, c) for c in range(self.channels)]))
        light[0] = 0.0
        light = np.maximum.accumulate(light, axis=0) + 1e-9 * codes[:, None]
        return light / light[-1]
