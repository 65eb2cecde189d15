"""Compiled sums over modes, many pairs side by side. Called through reconstruct.modes."""

from __future__ import annotations

import math

import numba
import numpy as np

from reconstruct.zernike import LANES, fill_radial

_jit = numba.njit(cache=True, nogil=True, error_model="numpy")


@_jit
def isotropic_sum(
    n, l, before, before2, a, b, c, theta_i, theta_r, dphi, first, second, bounds, weighted, result
):
    """result (k, c) = sum over modes; ``bounds[l]:bounds[l + 1]`` are the modes of azimuthal order l."""
    channels = weighted.shape[1]
    at_i, at_r = np.empty((len(n), LANES)), np.empty((len(n), LANES))
    turn, older, wave = np.empty(LANES), np.empty(LANES), np.empty(LANES)
    partial, total = np.empty((channels, LANES)), np.empty((channels, LANES))
    product = np.empty(LANES)
    rho, cos = np.empty(LANES), np.empty(LANES)
    for start in range(0, len(theta_i), LANES):
        stop = min(start + LANES, len(theta_i))
        _elevation(n, l, before, before2, a, b, c, theta_i, start, stop, rho, cos, at_i)
        _elevation(n, l, before, before2, a, b, c, theta_r, start, stop, rho, cos, at_r)
        for j in range(LANES):
            turn[j] = math.cos(dphi[min(start + j, stop - 1)])
            wave[j], older[j] = 1.0, turn[j]
        total[:, :] = 0.0
        for azimuth in range(len(bounds) - 1):
            partial[:, :] = 0.0
            for mode in range(bounds[azimuth], bounds[azimuth + 1]):
                p, q = first[mode], second[mode]
                for j in range(LANES):
                    product[j] = at_i[p, j] * at_r[q, j] + at_i[q, j] * at_r[p, j]
                for channel in range(channels):
                    factor = weighted[mode, channel]
                    for j in range(LANES):
                        partial[channel, j] += factor * product[j]
            for channel in range(channels):
                for j in range(LANES):
                    total[channel, j] += wave[j] * partial[channel, j]
            for j in range(LANES):  # Chebyshev: cos((l + 1) d) = 2 cos(d) cos(l d) - cos((l - 1) d)
                wave[j], older[j] = 2.0 * turn[j] * wave[j] - older[j], wave[j]
        for j in range(stop - start):
            for channel in range(channels):
                result[start + j, channel] = total[channel, j]


@_jit
def paired_design(
    n, l, before, before2, a, b, c, theta_i, theta_r, dphi, first, second, azimuth, weights, sign, design
):
    """design (k, m): weight (R_first(i) R_second(r) + sign R_second(i) R_first(r)) times the azimuth's wave.

    The wave is cos(l dphi) where ``sign`` is positive and sin(l dphi) where it is negative.
    """
    largest = 1
    for mode in range(len(azimuth)):
        largest = max(largest, azimuth[mode])
    at_i, at_r = np.empty((len(n), LANES)), np.empty((len(n), LANES))
    wave = np.empty((largest + 1, LANES))
    rho, cos = np.empty(LANES), np.empty(LANES)
    for start in range(0, len(theta_i), LANES):
        stop = min(start + LANES, len(theta_i))
        _elevation(n, l, before, before2, a, b, c, theta_i, start, stop, rho, cos, at_i)
        _elevation(n, l, before, before2, a, b, c, theta_r, start, stop, rho, cos, at_r)
        for j in range(stop - start):
            turn = math.cos(dphi[start + j])
            wave[0, j] = 1.0 if sign > 0 else 0.0
            wave[1, j] = turn if sign > 0 else math.sin(dphi[start + j])
            for k in range(2, largest + 1):
                wave[k, j] = 2.0 * turn * wave[k - 1, j] - wave[k - 2, j]
        for j in range(stop - start):
            for mode in range(len(first)):
                p, q = first[mode], second[mode]
                product = at_i[p, j] * at_r[q, j] + sign * (at_i[q, j] * at_r[p, j])
                design[start + j, mode] = weights[mode] * product * wave[azimuth[mode], j]


@_jit
def _elevation(n, l, before, before2, a, b, c, theta, start, stop, rho, cos, table):
    for j in range(LANES):
        angle = theta[min(start + j, stop - 1)]
        cos[j], rho[j] = math.cos(angle), math.sqrt(2.0) * math.sin(0.5 * angle)
    fill_radial(n, l, before, before2, a, b, c, rho, cos, table)
