"""Compiled sums of lobes, many pairs side by side. Called through photogonio.reconstruct.lobes.lobe.

Sines of the half vector are sums of squares, never 1 - cos^2: narrow lobes and grazing pairs keep their digits. Loops
run over lanes without a branch that depends on the lane; every pair is computed alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numba
import numpy as np
from photogonio.reconstruct.lobes.interface import cubic_piece, dielectric_fresnel
from photogonio.reconstruct.modes.kernel import HALF_PI_REST, LANES, TURN, TURN_REST, short_sine

_jit = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
_inline = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"}, inline="always")


@dataclass(frozen=True, slots=True)
class LobeTerms:
    """A lobe as compiled code takes it."""

    axes: np.ndarray  # (3,) roughness along and across, azimuth of the first, radians
    turning: bool
    retro: bool
    separable: bool
    beckmann: bool
    f0: float  # of the exact dielectric formula; below 0: Schlick's, whose f0 is in the factors
    table: np.ndarray  # (k, 4) E of a coat, as pieces of cubics in sqrt(cos); (0, 4) of others
    entered: Callable[..., np.ndarray] | None  # of a coat that turns: angles to (1 - E(i)) (1 - E(r))
    factors: np.ndarray  # (2, c) of the lobe, and of (1 - h.i)^5 of it, or of (1 - E(i)) (1 - E(r))


def add_lobe(terms: LobeTerms, angles: Sequence[np.ndarray], result: np.ndarray) -> None:
    """Add a lobe to ``result`` (n, c), 1/sr; ``angles`` theta_i, phi_i, theta_r, phi_r (n,), radians, up to pi / 2."""
    angles = [np.array(angle, float) for angle in angles]
    if terms.retro:
        _add_retro(*angles, terms.beckmann, terms.axes[0], terms.factors[0], result)
        return
    entered = np.empty(0) if terms.entered is None else terms.entered(*angles)
    kind = (terms.turning, terms.separable, terms.beckmann)
    _add_mirror(*angles, terms.axes, kind, terms.f0, terms.table, entered, terms.factors, result)


def mirror_values(
    interface: tuple[float, float, float, bool, bool, float], angles: Sequence[np.ndarray]
) -> np.ndarray:
    """(n,) a dielectric's mirror lobe of weight 1; ``interface`` as :class:`.coat.Interface` lists it."""
    along, across, azimuth, beckmann, separable, f0 = interface
    angles = [np.array(angle, float) for angle in angles]
    result = np.zeros((len(angles[0]), 1))
    kind = (along != across, separable, beckmann)
    axes, factors = np.array([along, across, azimuth]), np.array([[1.0], [0.0]])
    _add_mirror(*angles, axes, kind, f0, np.empty((0, 4)), np.empty(0), factors, result)
    return result[:, 0]


@_jit
def _add_mirror(theta_i, phi_i, theta_r, phi_r, axes, kind, f0, table, entered, factors, result):
    turning, separable, beckmann = kind
    cos_i, cos_r, hidden_i, hidden_r = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES)
    length2, aside, lobe, other = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.zeros(LANES)
    scale = 1.0 / (math.pi * axes[0] * axes[1])
    for start in range(0, len(theta_i), LANES):
        count = min(LANES, len(theta_i) - start)
        _lanes(theta_i, phi_i, theta_r, phi_r, start, count, cos_i, cos_r, hidden_i, hidden_r, length2, aside)
        if turning:
            _stretch(theta_i, phi_i, theta_r, phi_r, start, count, axes, hidden_i, hidden_r, aside)
        else:
            for j in range(LANES):
                hidden_i[j], hidden_r[j] = axes[0] * hidden_i[j], axes[0] * hidden_r[j]
                aside[j] /= axes[0] * axes[0]
        if beckmann:
            for j in range(count):
                up = (cos_i[j] + cos_r[j]) ** 2
                density = scale * math.exp(-aside[j] / max(up, 1e-300)) * (length2[j] / max(up, 1e-300)) ** 2
                lobe[j] = density * _beckmann_seen(separable, hidden_i[j], hidden_r[j], cos_i[j], cos_r[j])
        else:
            for j in range(LANES):
                up = (cos_i[j] + cos_r[j]) ** 2
                spread = length2[j] / (up + aside[j])
                root_i = math.sqrt(hidden_i[j] * hidden_i[j] + cos_i[j] * cos_i[j])
                root_r = math.sqrt(hidden_r[j] * hidden_r[j] + cos_r[j] * cos_r[j])
                seen = 0.5 / (cos_r[j] * root_i + cos_i[j] * root_r)
                if separable:
                    seen = 1.0 / ((cos_i[j] + root_i) * (cos_r[j] + root_r))
                lobe[j] = scale * spread * spread * seen
        for j in range(LANES):
            half = min(0.5 * math.sqrt(length2[j]), 1.0)
            miss = 1.0 - half
            other[j] = lobe[j] * miss * miss * miss * miss * miss
            length2[j] = half
        if f0 >= 0.0:
            for j in range(LANES):
                lobe[j] *= dielectric_fresnel(length2[j], f0)
                other[j] = 0.0
        if len(table):
            for j in range(count):
                other[j] = (1.0 - cubic_piece(table, cos_i[j])) * (1.0 - cubic_piece(table, cos_r[j]))
        if len(entered):
            for j in range(count):
                other[j] = entered[start + j]
        for j in range(count):
            for c in range(result.shape[1]):
                result[start + j, c] += factors[0, c] * lobe[j] + factors[1, c] * other[j]


@_inline
def _lanes(theta_i, phi_i, theta_r, phi_r, start, count, cos_i, cos_r, sin_i, sin_r, length2, aside):
    """Cosines and sines of both directions, and squared length and tangential part of their sum; lanes beyond
    ``count`` repeat the last."""
    for j in range(LANES):
        at = start + min(j, count - 1)
        cos_i[j], cos_r[j], aside[j] = theta_i[at], theta_r[at], phi_r[at] - phi_i[at]
    for j in range(LANES):
        turns = np.rint(aside[j] * (0.5 / math.pi))
        sine = short_sine(0.5 * ((aside[j] - turns * TURN) - turns * TURN_REST))
        sin_i[j], sin_r[j] = short_sine(cos_i[j]), short_sine(cos_r[j])
        cos_i[j] = short_sine((0.5 * math.pi - cos_i[j]) + HALF_PI_REST)
        cos_r[j] = short_sine((0.5 * math.pi - cos_r[j]) + HALF_PI_REST)
        apart = sin_i[j] - sin_r[j]
        aside[j] = apart * apart + 4.0 * sin_i[j] * sin_r[j] * (1.0 - sine * sine)
        up = cos_i[j] + cos_r[j]
        length2[j] = max(up * up + aside[j], 1e-30)


@_inline
def _stretch(theta_i, phi_i, theta_r, phi_r, start, count, axes, hidden_i, hidden_r, aside):
    """Tangential parts as the slopes feel them: of both directions times, of their sum over the roughness."""
    along, across, azimuth = axes[0], axes[1], axes[2]
    for j in range(count):
        sin_i, sin_r = hidden_i[j], hidden_r[j]
        x_i, y_i = sin_i * math.cos(phi_i[start + j] - azimuth), sin_i * math.sin(phi_i[start + j] - azimuth)
        x_r, y_r = sin_r * math.cos(phi_r[start + j] - azimuth), sin_r * math.sin(phi_r[start + j] - azimuth)
        hidden_i[j] = math.sqrt((along * x_i) ** 2 + (across * y_i) ** 2)
        hidden_r[j] = math.sqrt((along * x_r) ** 2 + (across * y_r) ** 2)
        aside[j] = ((x_i + x_r) / along) ** 2 + ((y_i + y_r) / across) ** 2


@_jit
def _beckmann_seen(separable, hidden_i, hidden_r, cos_i, cos_r):
    """G / (4 cos_i cos_r) of Gaussian slopes."""
    lost_i, lost_r = _beckmann_lambda(hidden_i, cos_i), _beckmann_lambda(hidden_r, cos_r)
    both = lost_i * lost_r if separable else 0.0
    return 0.25 / max(cos_i * cos_r * (1.0 + lost_i + lost_r + both), 1e-300)


@_jit
def _beckmann_lambda(hidden, cos):
    """Smith's Lambda of Gaussian slopes (Smith 1967)."""
    a = max(cos, 1e-30) / max(abs(hidden), 1e-30)
    if a > 6.0:  # below rounding
        return 0.0
    return 0.5 * (math.exp(-a * a) / (a * math.sqrt(math.pi)) - math.erfc(a))


@_jit
def _add_retro(theta_i, phi_i, theta_r, phi_r, beckmann, roughness, weight, result):
    a2 = roughness * roughness
    for n in range(len(theta_i)):
        half = math.sin(0.5 * (theta_i[n] - theta_r[n]))
        turn = math.sin(0.5 * (phi_r[n] - phi_i[n]))
        sine2 = min(half * half + math.sin(theta_i[n]) * math.sin(theta_r[n]) * turn * turn, 1.0)
        cos2 = max(1.0 - sine2, 1e-12)
        if beckmann:
            density = math.exp(-sine2 / (cos2 * a2)) / (math.pi * a2 * cos2 * cos2)
        else:
            spread = a2 * cos2 + sine2
            density = a2 / (math.pi * spread * spread)
        for c in range(result.shape[1]):
            result[n, c] += 0.25 * weight[c] * density
