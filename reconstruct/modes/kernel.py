"""Compiled sums over modes, many pairs side by side. Called through photogonio.reconstruct.modes.basis.

Inner loops run over lanes and touch few distinct rows each, so that the compiler can prove them independent
and uses vector instructions. Every lane is computed alone: results do not depend on how pairs are grouped.
"""

from __future__ import annotations

import math

import numpy as np

from photogonio.capture.jit import contracted, inlined
from photogonio.reconstruct.modes.zernike import fill_radial

LANES = 64  # pairs side by side: the table of order 8 then stays in the first cache
GROUP = 4  # modes summed at a time
TILE = 16  # modes transposed at a time: two lines of the cache
HALF_PI_REST = 6.123233995736766e-17  # pi / 2 less its double
TURN = float(np.float32(2 * math.pi))  # few digits, so that its whole multiples are exact
TURN_REST = (2 * math.pi - TURN) + 4 * HALF_PI_REST
# sine and cosine to rounding for |x| <= pi / 4: coefficients of fdlibm's k_sin.c and k_cos.c (Sun Microsystems, 1993)
_S3, _S5, _S7 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
_S9, _S11, _S13 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
_C4, _C6, _C8 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
_C10, _C12, _C14 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11
_TAYLOR = tuple((-1) ** k / math.factorial(2 * k + 1) for k in range(1, 11))


@contracted
def isotropic_sum(n, l, before, before2, a, b, c, theta_i, theta_r, dphi, first, second, weights, result):
    """result (k, c) = sum over modes of [R_p(i) R_q(r) + R_q(i) R_p(r)] cos(l dphi), p = ``first``, q =
    ``second``, times ``weights`` (m, d); m is a multiple of GROUP, d of 3 and at least c. The wave is put
    into R(i), whose rows have one l each.
    """
    rho, slant, outer = np.empty(2 * LANES), np.empty(2 * LANES), np.empty(2 * LANES)
    table, wave = np.empty((len(n), 2 * LANES)), np.empty((max(l.max(), 1) + 1, LANES))
    total, flat = np.empty((weights.shape[1] // 3, 3 * LANES)), result.reshape(-1)
    for start in range(0, len(theta_i), LANES):
        count = min(LANES, len(theta_i) - start)
        _elevations(theta_i, theta_r, start, count, rho, slant, outer)
        fill_radial(n, l, before, before2, a, b, c, rho, slant, outer, table)
        _waves(dphi, start, count, wave)
        for t in range(len(n)):
            azimuth = l[t]
            for j in range(LANES):
                table[t, j] *= wave[azimuth, j]
        total[:, :] = 0.0
        for mode in range(0, len(first), GROUP):
            for three in range(len(total)):
                if result.shape[1] == 1:
                    _add_one_channel(table, first, second, weights, mode, total[0])
                else:
                    _add_group(table, first, second, weights, mode, 3 * three, total[three])
        if result.shape[1] == 3:  # side by side in memory
            rows, three = flat[3 * start : 3 * (start + count)], total[0]
            for j in range(count):
                rows[3 * j], rows[3 * j + 1] = three[j], three[LANES + j]
                rows[3 * j + 2] = three[2 * LANES + j]
        else:
            for channel in range(result.shape[1]):
                for j in range(count):
                    result[start + j, channel] = total[channel // 3, channel % 3 * LANES + j]


@inlined
def _add_group(table, first, second, weights, mode, channel, total):
    """Add GROUP modes to three channels. Inlined early: as a call it is not vectorised."""
    p0, p1, p2, p3 = first[mode], first[mode + 1], first[mode + 2], first[mode + 3]
    q0, q1, q2, q3 = second[mode], second[mode + 1], second[mode + 2], second[mode + 3]
    w, x, y = (
        weights[mode : mode + 4, channel],
        weights[mode : mode + 4, channel + 1],
        weights[mode : mode + 4, channel + 2],
    )
    w0, w1, w2, w3 = w[0], w[1], w[2], w[3]
    x0, x1, x2, x3 = x[0], x[1], x[2], x[3]
    y0, y1, y2, y3 = y[0], y[1], y[2], y[3]
    for j in range(LANES):
        e0 = table[p0, j] * table[q0, LANES + j] + table[q0, j] * table[p0, LANES + j]
        e1 = table[p1, j] * table[q1, LANES + j] + table[q1, j] * table[p1, LANES + j]
        e2 = table[p2, j] * table[q2, LANES + j] + table[q2, j] * table[p2, LANES + j]
        e3 = table[p3, j] * table[q3, LANES + j] + table[q3, j] * table[p3, LANES + j]
        total[j] += (w0 * e0 + w1 * e1) + (w2 * e2 + w3 * e3)
        total[LANES + j] += (x0 * e0 + x1 * e1) + (x2 * e2 + x3 * e3)
        total[2 * LANES + j] += (y0 * e0 + y1 * e1) + (y2 * e2 + y3 * e3)


@inlined
def _add_one_channel(table, first, second, weights, mode, total):
    """The same of the first channel alone: two fifths of the work less. Written out again, since shared lines
    are not vectorised."""
    p0, p1, p2, p3 = first[mode], first[mode + 1], first[mode + 2], first[mode + 3]
    q0, q1, q2, q3 = second[mode], second[mode + 1], second[mode + 2], second[mode + 3]
    w = weights[mode : mode + 4, 0]
    w0, w1, w2, w3 = w[0], w[1], w[2], w[3]
    for j in range(LANES):
        e0 = table[p0, j] * table[q0, LANES + j] + table[q0, j] * table[p0, LANES + j]
        e1 = table[p1, j] * table[q1, LANES + j] + table[q1, j] * table[p1, LANES + j]
        e2 = table[p2, j] * table[q2, LANES + j] + table[q2, j] * table[p2, LANES + j]
        e3 = table[p3, j] * table[q3, LANES + j] + table[q3, j] * table[p3, LANES + j]
        total[j] += (w0 * e0 + w1 * e1) + (w2 * e2 + w3 * e3)


@contracted
def paired_design(
    n, l, before, before2, a, b, c, theta_i, theta_r, dphi, first, second, azimuth, weights, sign, design
):
    """design (k, m): weight [R_p(i) R_q(r) + sign R_q(i) R_p(r)] times the azimuth's wave.

    The wave is cos(l dphi) where ``sign`` is positive and sin(l dphi) where it is negative.
    """
    rho, slant, outer = np.empty(2 * LANES), np.empty(2 * LANES), np.empty(2 * LANES)
    table, wave = np.empty((len(n), 2 * LANES)), np.empty((max(l.max(), 1) + 1, LANES))
    block = np.empty((TILE, LANES))
    for start in range(0, len(theta_i), LANES):
        count = min(LANES, len(theta_i) - start)
        _elevations(theta_i, theta_r, start, count, rho, slant, outer)
        fill_radial(n, l, before, before2, a, b, c, rho, slant, outer, table)
        _waves(dphi, start, count, wave)
        if sign < 0:
            _turn_to_sines(dphi, start, count, wave)
        for tile in range(0, len(first), TILE):
            size = min(TILE, len(first) - tile)
            for k in range(size):
                mode = tile + k
                p, q, around, weight = first[mode], second[mode], azimuth[mode], weights[mode]
                for j in range(LANES):
                    product = table[p, j] * table[q, LANES + j] + sign * (table[q, j] * table[p, LANES + j])
                    block[k, j] = weight * product * wave[around, j]
            for j in range(count):
                for k in range(size):
                    design[start + j, tile + k] = block[k, j]


@inlined
def _take(angle, start, count, lanes):
    """LANES angles from ``start``; lanes beyond ``count`` repeat the last."""
    if count == LANES:
        given = angle[start : start + LANES]
        for j in range(LANES):
            lanes[j] = given[j]
    else:
        for j in range(LANES):
            lanes[j] = angle[start + min(j, count - 1)]


@contracted
def _waves(dphi, start, count, wave):
    """wave[l] = cos(l dphi) by Chebyshev's recurrence; lanes beyond ``count`` repeat the last pair."""
    _take(dphi, start, count, wave[1])
    for j in range(LANES):
        wave[0, j] = 1.0 + 0.0 * wave[1, j]  # not a number where dphi is none
    for j in range(LANES):
        turns = np.rint(wave[1, j] * (0.5 / math.pi))
        half = 0.5 * ((wave[1, j] - turns * TURN) - turns * TURN_REST)
        sine = short_sine(half)
        wave[1, j] = 1.0 - 2.0 * sine * sine
    for k in range(2, len(wave)):
        for j in range(LANES):
            wave[k, j] = 2.0 * wave[1, j] * wave[k - 1, j] - wave[k - 2, j]


@contracted
def _turn_to_sines(dphi, start, count, wave):
    """wave[l] = sin(l dphi): sin(0) and sin(dphi) begin the same recurrence."""
    for j in range(LANES):
        angle = dphi[start + min(j, count - 1)]
        turn = 2.0 * wave[1, j]
        wave[0, j], wave[1, j] = 0.0, math.sin(angle)
        for k in range(2, len(wave)):
            wave[k, j] = turn * wave[k - 1, j] - wave[k - 2, j]


@contracted
def _elevations(theta_i, theta_r, start, count, rho, slant, outer):
    """What :func:`fill_radial` needs of both angles: incident in the first LANES, exit in the rest."""
    _take(theta_i, start, count, rho[:LANES])
    _take(theta_r, start, count, rho[LANES:])
    for j in range(2 * LANES):
        sine, other = half_turn(0.5 * rho[j])
        cosine = (other - abs(sine)) * (other + abs(sine))
        outer[j] = 1.0 if cosine <= 0.5 else 0.0
        slant[j] = -2.0 * cosine if cosine <= 0.5 else 4.0 * sine * sine - 1.0
        rho[j] = math.sqrt(2.0) * sine


@inlined
def half_turn(x):
    """Sine and cosine of half a polar angle, |x| <= pi / 4, to rounding, without a call."""
    square = x * x
    odd = _S3 + square * (_S5 + square * (_S7 + square * (_S9 + square * (_S11 + square * _S13))))
    even = _C4 + square * (_C6 + square * (_C8 + square * (_C10 + square * (_C12 + square * _C14))))
    return x + x * square * odd, 1.0 - 0.5 * square + square * square * even


@inlined
def short_sine(x):
    """sin(x) to rounding for |x| <= pi / 2, by Taylor's series: no call, so that loops are vectorised."""
    square = x * x
    series = _TAYLOR[9]
    for k in range(8, -1, -1):
        series = _TAYLOR[k] + square * series
    return x + x * square * series
