"""How the noise of measured rows grows: with f, and toward grazing, told by twins and by what a smooth fit misses.

A table that states no errors is weighed as if they were the same everywhere, which no bright row is lost by; how far a
fresh reading may lie from f is another matter, and for that the data are asked.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls
from scipy.spatial import cKDTree
from scipy.special import ndtri

from photogonio.reconstruct.brdf.fresh import steepness
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.table.neighbours import places

SAME = np.radians(0.3)  # between pairs that are the same, or reciprocal twins
ROUNDS = 8  # of weighing squares by what is expected of them
FAR = 9.0  # variances: a square beyond counts as that
LEAST = 1e-3  # of the mean variance
HELD = 0.95  # of readings, that an interval is to hold


@dataclass(frozen=True, slots=True)
class NoiseTold:
    """The standard deviation of a row is the root of the sum of the squares of three, one a channel."""

    constant: np.ndarray  # (c,) 1/sr
    relative: np.ndarray  # (c,) of f
    grazing: np.ndarray  # (c,) of f times how far the steeper direction is from the normal, 1 / cos - 1

    def at(self, cells: Cells, value: np.ndarray) -> np.ndarray:
        """(n, c) where f is ``value`` (n, c), 1/sr."""
        parts = _terms(cells, value)
        squares = np.stack([self.constant, self.relative, self.grazing]) ** 2
        return np.sqrt(np.einsum("nkc,kc->nc", parts, squares))

    def plain(self) -> dict[str, list[float]]:
        """JSON values."""
        return {name: getattr(self, name).tolist() for name in self.__slots__}


def noise_told(cells: Cells, said: np.ndarray, leverage: np.ndarray) -> NoiseTold:
    """Of what a fit that ``said`` (n, c) misses of ``cells``, and of rows that were read again or as reciprocal twins.

    ``leverage`` (n,) is each row's share in what the fit says of it, by which it misses less than noise is.
    """
    size = np.maximum(np.abs(said).mean(0), np.finfo(float).tiny)
    squares = (cells.value - said) ** 2 / (1.0 - np.clip(leverage, 0.0, 0.9))[:, None]
    terms = _terms(cells, said)
    one, other = _twins(cells)
    squares = np.concatenate([squares, 0.5 * (cells.value[one] - cells.value[other]) ** 2])
    terms = np.concatenate([terms, 0.5 * (terms[one] + terms[other])])
    found = [_parts(terms[:, :, c] / [1.0, s**2, s**2], squares[:, c] / s**2, s) for c, s in enumerate(size)]
    return NoiseTold(*np.array(found).T)


@dataclass(frozen=True, slots=True)
class FreshReading:
    """How far a reading that the fit has not seen may lie from what it says."""

    noise: NoiseTold
    widened: np.ndarray  # (c,) by which rows left out lay further off than noise and standard errors say

    def deviation(self, cells: Cells, value: np.ndarray, error: np.ndarray) -> np.ndarray:
        """(n, c) 1/sr, so that 1.96 of them on either side hold 95 %; ``error`` (n, c) is the standard error of f."""
        return self.widened * np.hypot(error, self.noise.at(cells, value))

    def plain(self) -> dict[str, object]:
        """JSON values."""
        return {"noise": self.noise.plain(), "widened": self.widened.tolist()}


def fresh_reading(cells: Cells, noise: NoiseTold, left_out: np.ndarray, error: np.ndarray) -> FreshReading:
    """By rows that a fit ``left_out`` (n, c), with standard errors (n, c): their own quantile is taken, whatever the
    distribution is (conformal prediction: Vovk, Gammerman & Shafer 2005)."""
    off = np.abs(cells.value - left_out) / np.maximum(
        np.hypot(error, noise.at(cells, left_out)), np.finfo(float).tiny
    )
    level = min(HELD * (1.0 + 1.0 / len(cells)), 1.0)
    return FreshReading(noise, np.quantile(off, level, axis=0) / float(ndtri(0.5 + 0.5 * HELD)))


def _terms(cells: Cells, value: np.ndarray) -> np.ndarray:
    """(n, 3, c) what the three variances are multiplied by."""
    far = steepness(np.maximum(cells.theta_i, cells.theta_r))[:, None]
    return np.stack([np.ones_like(value), value**2, (far * value) ** 2], axis=1)


def _parts(terms: np.ndarray, squares: np.ndarray, size: float) -> tuple[float, float, float]:
    """The roots of what ``squares`` (k,) over ``size`` squared are the sums of, of ``terms`` (k, 3): as likely as may
    be, single large ones cut."""
    if not squares.any():  # rows that are hit exactly tell of none
        return 0.0, 0.0, 0.0
    least = LEAST * max(float(squares.mean()), np.finfo(float).tiny)
    expected = np.full_like(squares, max(float(squares.mean()), np.finfo(float).tiny))
    parts = np.zeros(3)
    for _ in range(ROUNDS):
        weight = 1.0 / expected
        parts = nnls(terms * weight[:, None], np.minimum(squares, FAR * expected) * weight)[0]
        expected = np.maximum(terms @ parts, least)
    constant, relative, grazing = np.sqrt(parts)
    return constant * size, relative, grazing


def _twins(cells: Cells) -> tuple[np.ndarray, np.ndarray]:
    """Rows (t,) and (t,) that should read the same: repeated, mirrored or exchanged ones, each pair once."""
    at = places(cells.theta_i, cells.theta_r, cells.dphi)
    back = places(cells.theta_r, cells.theta_i, cells.dphi)
    tree = cKDTree(at)
    near = [*tree.query_ball_point(at, SAME), *tree.query_ball_point(back, SAME)] if len(at) <= 4000 else []
    pairs = {(k % len(at), j) for k, found in enumerate(near) for j in found if k % len(at) < j}
    both = np.array(sorted(pairs), int).reshape(-1, 2)
    return both[:, 0], both[:, 1]
