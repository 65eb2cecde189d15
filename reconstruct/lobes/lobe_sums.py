"""Compiled sums of lobes, many pairs side by side. Called through photogonio.reconstruct.lobes.lobe.

Sines of the half vector are sums of squares, never 1 - cos^2: narrow lobes and grazing pairs keep their digits. Loops
run over lanes without a branch that depends on the lane; every pair is computed alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from photogonio.capture.jit import contracted, inlined
from photogonio.reconstruct.modes.kernel import LANES, TURN, TURN_REST, short_sine


@dataclass(frozen=True, slots=True)
class LobeTerms:
    """A lobe as compiled code takes it."""

    axes: np.ndarray  # (3,) roughness along and across, azimuth of the first, radians
    turning: bool
    peak: bool  # about a direction, without Fresnel's term and masking:
    forward: bool  # the mirror direction, not the light's own
    separable: bool
    beckmann: bool
    f0: float  # of the exact dielectric formula; below 0: Schlick's, whose f0 is in the factors
    table: np.ndarray  # (k,) 1 - E of a coat at even steps of cos; (0,) of others
    entered: Callable[..., np.ndarray] | None  # of a coat that turns: angles to (1 - E(i)) (1 - E(r))
    factors: np.ndarray  # (2, c) of the lobe, and of (1 - h.i)^5 of it, or of (1 - E(i)) (1 - E(r))
    halfway: bool = False  # a peak that is a cosine power of the half vector


def add_lobe(
    terms: LobeTerms, angles: Sequence[np.ndarray], result: np.ndarray, base: np.ndarray | None = None
) -> None:
    """Add a lobe to ``result`` (n, c), 1/sr; ``angles`` theta_i, phi_i, theta_r, phi_r (n,), radians, up to pi / 2.

    With ``base`` (c,), the lobe and it take the place of what was in ``result``.
    """
    angles = [_plain(angle) for angle in angles]
    if terms.peak:
        if base is not None:
            result[:] = base
        if terms.halfway:
            _add_power(*angles, terms.axes[0], terms.factors[0], result)
            return
        if terms.forward:
            angles[3] = angles[3] + math.pi
        _add_peak(*angles, terms.beckmann, terms.axes[0], terms.factors[0], result)
        return
    entered = np.empty(0) if terms.entered is None else terms.entered(*angles)
    kind = (terms.turning, terms.separable, terms.beckmann)
    _add_mirror(
        *angles,
        terms.axes,
        kind,
        terms.f0,
        terms.table,
        entered,
        terms.factors,
        _NO_BASE if base is None else base,
        result,
    )


def _plain(angle: np.ndarray) -> np.ndarray:
    """As compiled code takes it, whatever was given: a copy only where there must be one."""
    flags = angle.flags
    fit = angle.dtype == np.float64 and flags.c_contiguous and flags.writeable and flags.aligned
    return angle if fit else np.array(angle, float)


def above_horizon(theta_i: np.ndarray, theta_r: np.ndarray) -> bool:
    """Whether no polar angle (n,), radians, lies below the horizon, and all are numbers."""
    return bool(_all_above(_plain(theta_i), _plain(theta_r)))


@contracted
def _all_above(theta_i, theta_r):
    most = 0.5 * math.pi
    found = True
    for j in range(len(theta_i)):
        found &= (abs(theta_i[j]) <= most) & (abs(theta_r[j]) <= most)
    return found


_NO_BASE = np.empty(0)


def mirror_values(
    interface: tuple[float, float, float, bool, bool, float], angles: Sequence[np.ndarray]
) -> np.ndarray:
    """(n,) a dielectric's mirror lobe of weight 1; ``interface`` as :class:`.coat.Interface` lists it."""
    along, across, azimuth, beckmann, separable, f0 = interface
    angles = [np.array(angle, float) for angle in angles]
    result = np.zeros((len(angles[0]), 1))
    kind = (along != across, separable, beckmann)
    axes, factors = np.array([along, across, azimuth]), np.array([[1.0], [0.0]])
    _add_mirror(*angles, axes, kind, f0, np.empty(0), np.empty(0), factors, _NO_BASE, result)
    return result[:, 0]


@contracted
def _add_mirror(theta_i, phi_i, theta_r, phi_r, axes, kind, f0, table, entered, factors, base, result):
    turning, separable, beckmann = kind
    cos_i, cos_r, hidden_i, hidden_r = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES)
    length2, aside, lobe, other = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.zeros(LANES)
    index = (1.0 + math.sqrt(max(f0, 0.0))) / (1.0 - math.sqrt(max(f0, 0.0)))
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
                spread = up + aside[j]
                root_i = math.sqrt(hidden_i[j] * hidden_i[j] + cos_i[j] * cos_i[j])
                root_r = math.sqrt(hidden_r[j] * hidden_r[j] + cos_r[j] * cos_r[j])
                hiding = 2.0 * (cos_r[j] * root_i + cos_i[j] * root_r)
                if separable:
                    hiding = (cos_i[j] + root_i) * (cos_r[j] + root_r)
                lobe[j] = scale * length2[j] * length2[j] / (spread * spread * hiding)
        if f0 >= 0.0:
            _reflect(length2, index, lobe)
        else:
            for j in range(LANES):
                miss = 1.0 - min(0.5 * math.sqrt(length2[j]), 1.0)
                square = miss * miss
                other[j] = lobe[j] * (square * square * miss)
        if len(table):
            _enter(table, cos_i, other)
            _enter(table, cos_r, hidden_r)
            for j in range(LANES):
                other[j] *= hidden_r[j]
        if len(entered):
            for j in range(count):
                other[j] = entered[start + j]
        _put(lobe, other, factors, base, start, count, result)


@inlined
def _reflect(length2, index, lobe):
    """Times the reflectance of a smooth dielectric, unpolarised; ``length2`` is 4 (h.i)^2."""
    less = 1.0 / (index * index)
    for j in range(LANES):
        cos2 = min(0.25 * length2[j], 1.0)
        cos, inside = math.sqrt(cos2), math.sqrt(1.0 - (1.0 - cos2) * less)
        s_less, s_more = cos - index * inside, cos + index * inside
        p_less, p_more = index * cos - inside, index * cos + inside
        one, two, both = s_less * p_more, p_less * s_more, s_more * p_more
        lobe[j] *= 0.5 * (one * one + two * two) / (both * both)


@inlined
def _enter(table, cos, entered):
    """1 - E of directions, on straight lines between even steps of cos."""
    pieces = len(table) - 1
    for j in range(LANES):
        place = cos[j] * pieces
        k = min(int(place), pieces - 1)
        entered[j] = table[k] + (table[k + 1] - table[k]) * (place - k)


@inlined
def _put(lobe, other, factors, base, start, count, result):
    """The two parts with their factors, added to what is there or to the base."""
    if result.shape[1] == 3 and len(base):  # what is asked for most
        a0, a1, a2 = factors[0, 0], factors[0, 1], factors[0, 2]
        b0, b1, b2 = factors[1, 0], factors[1, 1], factors[1, 2]
        for j in range(count):
            result[start + j, 0] = base[0] + a0 * lobe[j] + b0 * other[j]
            result[start + j, 1] = base[1] + a1 * lobe[j] + b1 * other[j]
            result[start + j, 2] = base[2] + a2 * lobe[j] + b2 * other[j]
        return
    for j in range(count):
        for c in range(result.shape[1]):
            before = base[c] if len(base) else result[start + j, c]
            result[start + j, c] = before + factors[0, c] * lobe[j] + factors[1, c] * other[j]


@inlined
def _lanes(theta_i, phi_i, theta_r, phi_r, start, count, cos_i, cos_r, sin_i, sin_r, length2, aside):
    """Cosines and sines of both directions, and squared length and tangential part of their sum; lanes beyond
    ``count`` repeat the last."""
    for j in range(LANES):
        at = start + min(j, count - 1)
        cos_i[j], cos_r[j], aside[j] = theta_i[at], theta_r[at], phi_r[at] - phi_i[at]
    for j in range(LANES):
        turns = np.rint(aside[j] * (0.5 / math.pi))
        sine = short_sine(0.5 * ((aside[j] - turns * TURN) - turns * TURN_REST))
        half_i, half_r = _shorter_sine(0.5 * cos_i[j]), _shorter_sine(0.5 * cos_r[j])
        rest_i, rest_r = math.sqrt(1.0 - half_i * half_i), math.sqrt(1.0 - half_r * half_r)
        sin_i[j], sin_r[j] = 2.0 * half_i * rest_i, 2.0 * half_r * rest_r
        cos_i[j] = max((rest_i - abs(half_i)) * (rest_i + abs(half_i)), 1e-17)
        cos_r[j] = max((rest_r - abs(half_r)) * (rest_r + abs(half_r)), 1e-17)
        apart = sin_i[j] - sin_r[j]
        aside[j] = apart * apart + 4.0 * sin_i[j] * sin_r[j] * (1.0 - sine * sine)
        up = cos_i[j] + cos_r[j]
        length2[j] = max(up * up + aside[j], 1e-30)


@inlined
def _shorter_sine(x):
    """sin(x) to rounding for |x| <= pi / 4, by Taylor's series."""
    square, series = x * x, 1.0
    for k in range(8, 0, -1):
        series = 1.0 - square * (1.0 / (2 * k * (2 * k + 1))) * series
    return x * series


@inlined
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


@contracted
def _beckmann_seen(separable, hidden_i, hidden_r, cos_i, cos_r):
    """G / (4 cos_i cos_r) of Gaussian slopes."""
    lost_i, lost_r = _beckmann_lambda(hidden_i, cos_i), _beckmann_lambda(hidden_r, cos_r)
    both = lost_i * lost_r if separable else 0.0
    return 0.25 / max(cos_i * cos_r * (1.0 + lost_i + lost_r + both), 1e-300)


@contracted
def _beckmann_lambda(hidden, cos):
    """Smith's Lambda of Gaussian slopes (Smith 1967)."""
    a = max(cos, 1e-30) / max(abs(hidden), 1e-30)
    if a > 6.0:  # below rounding
        return 0.0
    return 0.5 * (math.exp(-a * a) / (a * math.sqrt(math.pi)) - math.erfc(a))


@contracted
def _add_power(theta_i, phi_i, theta_r, phi_r, roughness, weight, result):
    """Blinn and Phong's cosine power of the half vector."""
    a2 = roughness * roughness
    for n in range(len(theta_i)):
        up = math.cos(theta_i[n]) + math.cos(theta_r[n])
        sin_i, sin_r = math.sin(theta_i[n]), math.sin(theta_r[n])
        between = math.cos(0.5 * (phi_r[n] - phi_i[n]))
        aside = (sin_i - sin_r) ** 2 + 4.0 * sin_i * sin_r * between * between
        cos2 = up * up / max(up * up + aside, 1e-30)
        density = cos2 ** (1.0 / a2 - 1.0) / (math.pi * a2)
        for c in range(result.shape[1]):
            result[n, c] += 0.25 * weight[c] * density


@contracted
def _add_peak(theta_i, phi_i, theta_r, phi_r, beckmann, roughness, weight, result):
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
