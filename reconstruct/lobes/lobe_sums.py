"""Compiled sums of lobes, many pairs side by side. Called through photogonio.reconstruct.lobes.lobe.

Loops run over lanes without a branch that depends on the lane; every pair is computed alone.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from photogonio.capture.jit import contracted, inlined
from photogonio.reconstruct.lobes.lanes import both_directions, stretch
from photogonio.reconstruct.modes.kernel import LANES


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
_BELOW_ONE = 1.0 - 2.0**-53


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
    cos_i, cos_r, sin_i, sin_r = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES)
    length2, aside, lobe, other = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.zeros(LANES)
    under, place, flat = np.empty(LANES), np.empty(LANES, np.int32), result.reshape(-1)
    rough, slope = axes[0], 1.0 / (axes[0] * axes[0])
    if turning:  # which stretches both
        rough, slope = 1.0, 1.0
    scale = 1.0 / (math.pi * axes[0] * axes[1])
    for start in range(0, len(theta_i), LANES):
        count = min(LANES, len(theta_i) - start)
        both_directions(
            theta_i, phi_i, theta_r, phi_r, start, count, cos_i, cos_r, sin_i, sin_r, length2, aside
        )
        if turning:
            stretch(theta_i, phi_i, theta_r, phi_r, start, count, axes, sin_i, sin_r, aside)
        if beckmann:
            for j in range(count):
                up = max((cos_i[j] + cos_r[j]) ** 2, 1e-300)
                density = scale * math.exp(-slope * aside[j] / up) * (length2[j] / up) ** 2
                seen = _beckmann_seen(separable, rough * sin_i[j], rough * sin_r[j], cos_i[j], cos_r[j])
                lobe[j], under[j] = density * seen, 1.0
        else:
            for j in range(LANES):
                up = (cos_i[j] + cos_r[j]) ** 2
                spread = up + slope * aside[j]
                hidden_i, hidden_r = rough * sin_i[j], rough * sin_r[j]
                root_i = math.sqrt(hidden_i * hidden_i + cos_i[j] * cos_i[j])
                root_r = math.sqrt(hidden_r * hidden_r + cos_r[j] * cos_r[j])
                hiding = 2.0 * (cos_r[j] * root_i + cos_i[j] * root_r)
                if separable:
                    hiding = (cos_i[j] + root_i) * (cos_r[j] + root_r)
                lobe[j], under[j] = scale * (length2[j] * length2[j]), spread * spread * hiding
        if f0 >= 0.0:
            _reflect(length2, f0, lobe, under)
        else:
            for j in range(LANES):
                miss = 1.0 - min(0.5 * math.sqrt(length2[j]), 1.0)
                square = miss * miss
                lobe[j] /= under[j]
                other[j] = lobe[j] * (square * square * miss)
        if len(table):
            _enter(table, cos_i, cos_r, place, under, aside, other)
        if len(entered):
            for j in range(count):
                other[j] = entered[start + j]
        _put(lobe, other, factors, base, start, count, result, flat)


@inlined
def _reflect(length2, f0, lobe, under):
    """``lobe`` over ``under``, times the reflectance of a smooth dielectric, unpolarised; ``length2`` is 4 (h.i)^2.

    With C and G the squared cosines outside and inside, Fresnel's two squares over a common denominator are
    (n^2 - 1)^2 ((1 - C)^2 / n^2 + C G) / ((C + n^2 G + t) (n^2 C + G + t)), t = 2 n sqrt(C G): one root, and no
    difference of what is nearly alike.
    """
    index = (1.0 + math.sqrt(f0)) / (1.0 - math.sqrt(f0))
    square, less = index * index, 1.0 / (index * index)
    for j in range(LANES):
        outside = min(0.25 * length2[j], 1.0)
        rest = 1.0 - outside
        inside = 1.0 - rest * less
        twice = 2.0 * index * math.sqrt(outside * inside)
        s_more, p_more = outside + square * inside + twice, square * outside + inside + twice
        part = (square - 1.0) ** 2 * (rest * rest * less + outside * inside)
        lobe[j] = part * lobe[j] / (under[j] * (s_more * p_more))


@inlined
def _enter(table, cos_i, cos_r, place, low, high, entered):
    """(1 - E(i)) (1 - E(r)), on straight lines between even steps of cos. Loops that look up do nothing else, and the
    rest is vectorised."""
    pieces = len(table) - 1
    for j in range(LANES):
        entered[j] = 1.0
    for cos in (cos_i, cos_r):
        for j in range(LANES):
            place[j] = np.int32(min(_BELOW_ONE, cos[j]) * pieces)  # in this order, of a NaN the last
        for j in range(LANES):
            low[j], high[j] = table[place[j]], table[place[j] + 1]
        for j in range(LANES):
            entered[j] *= low[j] + (high[j] - low[j]) * (cos[j] * pieces - place[j])


@inlined
def _put(lobe, other, factors, base, start, count, result, flat):
    """The two parts with their factors, added to what is there or to the base; ``flat`` is ``result``, whose
    numbers then have a step that the compiler knows."""
    if result.shape[1] == 3 and len(base):  # what is asked for most
        a0, a1, a2 = factors[0, 0], factors[0, 1], factors[0, 2]
        b0, b1, b2 = factors[1, 0], factors[1, 1], factors[1, 2]
        c0, c1, c2 = base[0], base[1], base[2]
        rows = flat[3 * start : 3 * (start + count)]
        for j in range(count):
            rows[3 * j] = c0 + a0 * lobe[j] + b0 * other[j]
            rows[3 * j + 1] = c1 + a1 * lobe[j] + b1 * other[j]
            rows[3 * j + 2] = c2 + a2 * lobe[j] + b2 * other[j]
        return
    for j in range(count):
        for c in range(result.shape[1]):
            before = base[c] if len(base) else result[start + j, c]
            result[start + j, c] = before + factors[0, c] * lobe[j] + factors[1, c] * other[j]


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
