"""One radiance from an exposure series.

Each exposure counts with the inverse of its variance, as Granados et al., "Optimal HDR reconstruction with
linear digital cameras", CVPR 2010. The variance is that of the signal which all exposures together expect
in the exposure, not of its own noisy reading: else low readings would count more and the mean come out low.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from photogonio.capture import robust
from photogonio.capture.linear.noise import NoiseModel
from photogonio.capture.linear.signal import Signal, grown

NEARLY_FULL = 0.97  # of white: what the shorter exposures expect above it is not taken from a longer one
NOMINAL = 0.005  # of a step's logarithm that is left as stated
WRONG = 0.25  # relative error of a stated step that rounding on a dial does not explain
WELL = (0.05, 0.9)  # signal of pixels that tell the step
SURE = 10.0  # signal to noise of the darker ones
LEAST_PIXELS = 500
GHOST_REACH = 6.0  # standard deviations by which an exposure contradicts the others
GHOST_SHARE = 0.05  # relative difference that nominal exposure times explain


@dataclass(frozen=True, slots=True)
class Merged:
    value: np.ndarray  # (h, w, c) float32 radiance
    variance: np.ndarray
    saturated: np.ndarray  # (h, w) bool, in every exposure
    ghost: np.ndarray  # (h, w) bool


def trimmed(signals: Sequence[Signal], factors: Sequence[float]) -> list[float]:
    """Exposures as the photos themselves show them: 1/15 s on a camera's dial is 1/16 s, and 1/60 is 1/64.

    The step between neighbours is the ratio of their sums over pixels well exposed in both. Stated steps
    within NOMINAL of that are kept; the mean of the logarithms is kept in any case. Raises ValueError if a
    step is so far off that the statement must be wrong.
    """
    order = np.argsort(factors, kind="stable")
    logs = np.log(np.asarray(factors, float))
    shift = np.zeros(len(factors))
    for a, b in pairwise(order):
        stated = logs[b] - logs[a]
        measured = exposure_step(signals[a], signals[b])
        if measured is not None and abs(measured - stated) > NOMINAL:
            if abs(measured - stated) > np.log1p(WRONG):
                what = f"photo {b + 1} of this bracket is {np.exp(measured):.3g} times as bright as the next darker"
                raise ValueError(f"{what}, but its stated exposure is {np.exp(stated):.3g} times as long")
            shift[b] = shift[a] + measured - stated
        else:
            shift[b] = shift[a]
    return list(np.exp(logs + shift - shift.mean()))


def exposure_step(dark: Signal, bright: Signal) -> float | None:
    """Logarithm of the ratio of two exposures of one view; None if too few pixels tell."""
    good = ~(grown(dark.saturated) | grown(bright.saturated))[..., None]
    good = (
        good & (bright.value > WELL[0]) & (bright.value < WELL[1]) & (dark.value**2 > SURE**2 * dark.variance)
    )
    if good.sum() < LEAST_PIXELS:
        return None
    low, high = dark.value[good].astype(float), bright.value[good].astype(float)
    ratio = np.log(high / low)
    middle = np.median(ratio)
    near = np.abs(ratio - middle) <= 3 * robust.deviation(ratio - middle) + 1e-6
    return float(np.log(high[near].sum() / low[near].sum()))


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
    if noise.black is not None:  # dim light has no less noise than black, of which codes show half
        least = noise.black.astype(np.float32)
        variances = [
            np.maximum(one, least / np.float32(f**2)) for one, f in zip(variances, factors, strict=True)
        ]
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
