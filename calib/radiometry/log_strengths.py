"""Strengths of lamps as one linear model of logarithms: a reading is a lamp's strength times a factor of what was read.

The unknowns are the logarithms of the strengths and of those factors. Weights are Cauchy's until they settle, then
Tukey's, by the residual that each row has to what the others make of it (Maronna et al., "Robust statistics", 2019).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from photogonio.capture import robust

_CAUCHY, _TUKEY = 2.385, 4.685  # standard errors: 95 % as sharp as least squares where errors are normal
_ROUNDS = 20
_SETTLED = 1e-3  # change of weights
_LEAST_WEIGHT = 1e-6  # so that what nothing else tells stays told
_LEAST_ERROR = 1e-6  # of a logarithm
_ALONE = 1e-9  # what the others have to say of a row at the least, as a share of it


@dataclass(frozen=True, slots=True)
class LogReading:
    """The sum of some unknowns, as it was read."""

    unknowns: tuple[str, ...]
    value: np.ndarray  # (c,) logarithm
    error: np.ndarray  # (c,) of it
    doubted: bool = False  # whether it counts less where the others contradict it


@dataclass(frozen=True, slots=True)
class Solution:
    """All unknowns, by name."""

    value: dict[str, np.ndarray]  # (c,)
    error: dict[str, np.ndarray]  # (c,)


def solve(rows: Sequence[LogReading]) -> Solution:
    """What fits all rows best, and how sure it is by their errors. Every unknown must be told by some of them."""
    names = list(dict.fromkeys(name for row in rows for name in row.unknowns))
    design = np.array([[float(name in row.unknowns) for name in names] for row in rows])
    value = np.array([row.value for row in rows])
    error = np.maximum([row.error for row in rows], _LEAST_ERROR)
    doubted = np.array([row.doubted for row in rows])
    weight = np.ones(len(rows))
    for redescending in (False, True) if doubted.any() else ():
        for _ in range(_ROUNDS):
            off = _contradiction(design, value, error, weight)
            of_loss = (
                robust.tukey_weight(off, _TUKEY) ** 2 if redescending else 1 / (1 + (off / _CAUCHY) ** 2)
            )
            before, weight = weight, np.where(doubted, np.maximum(of_loss, _LEAST_WEIGHT), 1.0)
            if np.abs(weight - before).max() < _SETTLED:
                break
    found, covariance = _least_squares(design, value, error, weight)
    sigma = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)).T
    return Solution(dict(zip(names, found, strict=True)), dict(zip(names, sigma, strict=True)))


def _contradiction(
    design: np.ndarray, value: np.ndarray, error: np.ndarray, weight: np.ndarray
) -> np.ndarray:
    """How far each row (n,) lies from what the others say, in standard errors of the difference; the largest of all
    channels."""
    found, covariance = _least_squares(design, value, error, weight)
    said = ((design @ covariance) * design).sum(2).T  # (n, c) variance of what the fit says of each row
    own = weight[:, None] * said / error**2  # its share in that
    rest = np.maximum(1 - own, _ALONE)
    off = np.abs(value - design @ found) / rest
    return (off / np.sqrt(error**2 + said / rest)).max(1)


def _least_squares(
    design: np.ndarray, value: np.ndarray, error: np.ndarray, weight: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Unknowns (k, c) and their covariance (c, k, k)."""
    found, covariance = [], []
    for channel in range(value.shape[1]):
        sharp = weight / error[:, channel] ** 2
        inverse = np.linalg.inv((design.T * sharp) @ design)
        found.append(inverse @ (design.T @ (sharp * value[:, channel])))
        covariance.append(inverse)
    return np.array(found).T, np.array(covariance)
