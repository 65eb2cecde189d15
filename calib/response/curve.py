"""A tone curve as sRGB's of codes that are moved: smoothly, all channels alike but for a little of each one's own.

A camera's program bends the picture that would be sRGB by a curve such as an artist draws, an S, a lifted toe, a
shoulder: smooth from code to code. So the code that sRGB would have is the code and a smooth function of it; that tells
codes between those of black and white print that no print shows.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import BSpline

from photogonio.calib.response.family import moved_by_them
from photogonio.capture.containers.tone import srgb

KNOTS = 12
BENDS = KNOTS + 2
ANCHOR = 0.8  # code against which the light of others is quoted
LEAST = 1e-3  # of the code that sRGB would have: its light is nothing
# how far codes are moved otherwise than by the curves of a family, and over which part of the codes that changes: by
# what an artist draws, and by finer things; a channel beside the others
_DRAWN, _FINE, _OWN = (0.03, 0.45), (0.006, 0.18), (0.003, 0.4)
# turns at either end, a toe or a shoulder: how far, over which part of the codes, and which end
_TURNS = ((0.02, 0.06, 1.0), (0.02, 0.15, 1.0), (0.02, 0.06, 0.0))
_FAMILY = 1.0  # how strong a curve of the family may be, over those that are there
_ENDS = 0.06  # by how much the ends of the codes are moved
_BEYOND = 0.5  # of the logarithm of light beyond codes that were seen: how wrong it may be
_HELD = 1e-2  # by how much bends of the family are smooth where no code asks for them
_DOUBTS = 10  # independent ways in which the bends err, that are kept
_LOOSE = 1e-3  # of these, by which each coefficient is free


@cache
def _knots() -> np.ndarray:
    step = 1.0 / (KNOTS - 1)
    return step * np.arange(-3, KNOTS + 3)


def basis(codes: np.ndarray) -> np.ndarray:
    """The spline's functions (n, BENDS) at codes (n,), fractions of full scale."""
    knots = _knots()
    return BSpline.design_matrix(np.clip(codes, knots[3], knots[-4]), knots, 3).toarray()


def steepness(moved: np.ndarray) -> np.ndarray:
    """Slope (n,) of the logarithm of sRGB's light by the code."""
    moved, step = np.maximum(moved, LEAST), 1e-4
    return (np.log(srgb(moved + step)) - np.log(srgb(moved))) / step


def log_srgb(moved: np.ndarray) -> np.ndarray:
    """Logarithm (n,) of sRGB's light."""
    return np.log(srgb(np.maximum(moved, LEAST)))


def prior(channels: int, drawn: float = 1.0) -> np.ndarray:
    """Rows (m, (1 + channels) BENDS) of what is expected of the bends, each in its standard deviations: the common
    one's, of which ``drawn`` says how strong a curve it is, then each channel's own."""
    places = _knots()[2:-2]
    apart = places[:, None] - places
    common = sum(size**2 * np.exp(-0.5 * (apart / reach) ** 2) for size, reach in (_DRAWN, _FINE))
    for size, reach, end in _TURNS:
        turn = size * np.exp(-np.abs(places - end) / reach)
        common = common + turn[:, None] * turn
    common = common + _FAMILY**2 * _of_family()
    own = _OWN[0] ** 2 * np.exp(-0.5 * (apart / _OWN[1]) ** 2)
    blocks = [drawn**2 * common, *[own] * channels]
    rows = [_placed(_whitened(one), block, channels) for block, one in enumerate(blocks)]
    return np.vstack(rows)


@cache
def _of_family() -> np.ndarray:
    """Second moments (BENDS, BENDS) of the bends that make sRGB's codes of those of curves that are known."""
    codes, moved = moved_by_them()
    held = np.vstack([basis(codes), _HELD * np.diff(np.eye(BENDS), 2, axis=0)])
    bends = np.linalg.lstsq(held, np.vstack([moved, np.zeros((BENDS - 2, moved.shape[1]))]), rcond=None)[0]
    return bends @ bends.T / bends.shape[1]


def _whitened(covariance: np.ndarray) -> np.ndarray:
    """Rows whose squares sum to what a covariance makes of a vector."""
    loose = covariance + _LOOSE**2 * np.diag(np.diag(covariance))
    return np.linalg.inv(np.linalg.cholesky(loose))


def _placed(rows: np.ndarray, block: int, channels: int) -> np.ndarray:
    wide = np.zeros((len(rows), (1 + channels) * BENDS))
    wide[:, block * BENDS : (block + 1) * BENDS] = rows
    return wide


def anchors(channels: int) -> np.ndarray:
    """Rows (2, ...) of the ends: no light has about the lowest code, and full scale is full scale."""
    return _placed(basis(np.array([0.0, 1.0])) / _ENDS, 0, channels)


@dataclass(frozen=True, slots=True)
class Curves:
    """Of all channels."""

    bends: np.ndarray  # (1 + c, BENDS)
    covariance: np.ndarray  # of all of them, after one another
    seen: tuple[float, float]  # codes between which the print told it

    @property
    def channels(self) -> int:
        return len(self.bends) - 1

    def moved(self, codes: np.ndarray, channel: int) -> np.ndarray:
        """The codes (n,) that sRGB would have."""
        return codes + basis(codes) @ (self.bends[0] + self.bends[channel + 1])

    def log_light(self, codes: np.ndarray, channel: int) -> np.ndarray:
        """Logarithm (n,) of the light of codes (n,), but for a constant."""
        return log_srgb(self.moved(codes, channel))

    def error_between(self, codes: np.ndarray, others: np.ndarray, channel: int) -> np.ndarray:
        """Standard errors (n,) of the logarithm of the ratio of the light of codes and of others, (n,) each."""
        apart = self._slopes(codes, channel) - self._slopes(others, channel)
        wide = np.zeros((len(codes), self.bends.size))
        wide[:, :BENDS] = apart
        wide[:, (channel + 1) * BENDS : (channel + 2) * BENDS] = apart
        told = np.maximum(np.einsum("ni,ij,nj->n", wide, self.covariance, wide), 0.0)
        return np.sqrt(told + (self._untold(codes, channel) - self._untold(others, channel)) ** 2)

    def doubts(self, codes: np.ndarray) -> np.ndarray:
        """Changes (k, n, c) of the logarithm of light of codes (n,) by one standard deviation of each of k independent
        things: of the bends as they move codes, those that do most, and what no print has told."""
        every, own = basis(codes), np.zeros((self.channels, len(codes), self.bends.size))
        for c in range(self.channels):
            own[c, :, :BENDS] = own[c, :, (c + 1) * BENDS : (c + 2) * BENDS] = every
        wide = own.reshape(-1, self.bends.size)
        energy, turn = np.linalg.eigh(wide @ self.covariance @ wide.T)
        most = np.argsort(energy)[::-1][:_DOUBTS]
        moved = turn[:, most].T * np.sqrt(np.maximum(energy[most], 0.0))[:, None]
        steep = np.stack([steepness(self.moved(codes, c)) for c in range(self.channels)], axis=1)
        untold = np.stack([self._untold(codes, c) for c in range(self.channels)], axis=1)
        bent = np.swapaxes(moved.reshape(-1, self.channels, len(codes)), 1, 2) * steep
        return np.concatenate([bent, untold[None]])

    def _untold(self, codes: np.ndarray, channel: int) -> np.ndarray:
        """What of the logarithm of light (n,) is unsure since no print has such codes."""
        beyond = self.log_light(codes, channel) - self.log_light(np.clip(codes, *self.seen), channel)
        return _BEYOND * beyond

    def _slopes(self, codes: np.ndarray, channel: int) -> np.ndarray:
        return basis(codes) * steepness(self.moved(codes, channel))[:, None]

    def table(self, size: int = 1024) -> np.ndarray:
        """Light (size, c) at evenly spaced codes: 0 at 0, 1 at full scale, rising."""
        codes = np.linspace(0.0, 1.0, size)
        light = np.exp(np.column_stack([self.log_light(codes, c) for c in range(self.channels)]))
        light[0] = 0.0
        light = np.maximum.accumulate(light, axis=0) + 1e-9 * codes[:, None]
        return light / light[-1]
