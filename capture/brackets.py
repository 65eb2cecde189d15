"""One radiance from an exposure series.

Each exposure counts with the inverse of its variance, as Granados et al., "Optimal HDR reconstruction with
linear digital cameras", CVPR 2010. The variance is that of the signal which all exposures together expect
in the exposure, not of its own noisy reading: else low readings would count more and the mean come out low.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from capture.noise import NoiseModel
from capture.signal import Signal, grown

NEARLY_FULL = 0.97  # of white: what the shorter exposures expect above it is not taken from a longer one
GHOST_REACH = 6.0  # standard deviations by which an exposure contradicts the others
GHOST_SHARE = 0.05  # relative difference that nominal exposure times explain


@dataclass(frozen=True, slots=True)
class Merged:
    value: np.ndarray  # (h, w, c) float32 radiance
    variance: np.ndarray
    saturated: np.ndarray  # (h, w) bool, in every exposure
    ghost: np.ndarray  # (h, w) bool


def merge(signals: Sequence[Signal], factors: Sequence[float], noise: NoiseModel) -> Merged:
    """Radiance from signals of one view; ``factors`` are the exposures, signal over radiance.

    Exposures are taken from the shortest: what the shorter ones expect decides whether a longer one is
    nearly full. Where even the shortest is full its value stays, marked saturated.
    """
    order = np.argsort(factors, kind="stable")
    shape = signals[0].value.shape
    light, time = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    used = []
    for k in order:
        factor = np.float32(factors[k])
        usable = ~grown(signals[k].saturated)[..., None] & np.ones(shape, bool)
        with np.errstate(invalid="ignore", divide="ignore"):
            usable &= ~(factor * light / time > NEARLY_FULL)
        light += np.where(usable, signals[k].value, 0)
        time += np.where(usable, factor, 0)
        used.append(usable)
    none = time == 0
    shortest = signals[order[0]].value / np.float32(factors[order[0]])
    first = np.where(none, shortest, light / np.where(none, 1, time))
    return weigh([signals[k] for k in order], [factors[k] for k in order], used, first, noise)


def weigh(
    signals: Sequence[Signal],
    factors: Sequence[float],
    used: Sequence[np.ndarray],
    first: np.ndarray,
    noise: NoiseModel,
) -> Merged:
    """Inverse-variance mean of the used exposures, the variances being those expected from ``first``."""
    total, weight = np.zeros_like(first), np.zeros_like(first)
    variances = []
    for signal, factor, usable in zip(signals, factors, used, strict=True):
        quantisation = signal.variance - noise.variance(signal.value)
        variance = (noise.variance(first * np.float32(factor)) + quantisation) / np.float32(factor**2)
        variance = np.maximum(variance, np.float32(1e-20))
        total += np.where(usable, signal.value / np.float32(factor) / variance, 0)
        weight += np.where(usable, 1 / variance, 0)
        variances.append(variance)
    none = weight == 0
    value = np.where(none, first, total / np.where(none, 1, weight))
    variance = np.where(none, variances[0], 1 / np.where(none, 1, weight))
    ghost = disagreement(signals, factors, used, value, variances)
    return Merged(value, variance, none.any(axis=2), ghost)


def disagreement(
    signals: Sequence[Signal],
    factors: Sequence[float],
    used: Sequence[np.ndarray],
    value: np.ndarray,
    variances: Sequence[np.ndarray],
) -> np.ndarray:
    """Pixels (h, w) where some exposure contradicts the merged radiance: something moved, or the lamp
    changed.
    """
    ghost = np.zeros(value.shape[:2], bool)
    for signal, factor, usable, variance in zip(signals, factors, used, variances, strict=True):
        off = np.abs(signal.value / np.float32(factor) - value)
        ghost |= (usable & (off > GHOST_REACH * np.sqrt(variance) + GHOST_SHARE * np.abs(value))).any(axis=2)
    return ghost
