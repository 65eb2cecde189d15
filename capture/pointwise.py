"""Arithmetic of single pixels and their neighbourhoods, compiled: one pass over a photo instead of ten.

Photos are taken as rows of ``width * channels`` numbers, so that the loops run in vector lanes. The functions
release the interpreter's lock. Unsigned columns for the same reason as in :mod:`reconstruct.stages`: an index that
may be negative keeps a loop out of the lanes.
"""

from __future__ import annotations

import numba
import numpy as np

_jit = numba.njit(cache=True, nogil=True, error_model="numpy")


@_jit
def scaled(pixels, top, left, scale, offset, slope, read, step, value, variance):
    """``value = scale * code + offset`` and ``variance = read + slope * max(value, 0) + (step * value)^2``.

    ``pixels`` (rows, m) are a whole photo's, of which ``value`` and ``variance`` (h, n) take a part from row
    ``top`` and number ``left`` on; ``slope`` and ``read`` are (n,). All but the pixels are float32.
    """
    shift = np.uint64(left)
    for y in range(len(value)):
        codes, light, noise = pixels[top + y], value[y], variance[y]
        for x in range(np.uint64(len(light))):
            signal = np.float32(codes[x + shift]) * scale + offset
            part = signal * step
            light[x] = signal
            noise[x] = max(signal, np.float32(0.0)) * slope[x] + read[x] + part * part


@_jit
def gray(value, variance, level, noise):
    """Mean over channels, and its standard deviation, (h, w) each, of (h, w, c)."""
    channels = np.uint64(value.shape[2])
    per = np.float32(1.0 / value.shape[2])
    for y in range(len(value)):
        for x in range(np.uint64(value.shape[1])):
            total, spread = np.float32(0.0), np.float32(0.0)
            for c in range(channels):
                total += value[y, x, c]
                spread += variance[y, x, c]
            level[y, x] = total * per
            noise[y, x] = np.sqrt(spread) * per


@_jit
def extremes(level, noise, reach, result):
    """Marks pixels (h, w) that are an extreme of their 3 x 3 and lie ``reach`` sigmas off the ring around those.

    The ring's mean over its 16 pixels counts. Two pixels along the border are never marked.
    """
    height, width = level.shape
    one, two = np.uint64(1), np.uint64(2)
    for y in range(2, height - 2):
        a, b, c, d, e = level[y - 2], level[y - 1], level[y], level[y + 1], level[y + 2]
        for x in range(two, np.uint64(width) - two):
            p, m, q, n = x + one, x - one, x + two, x - two
            top = max(b[m], b[x], b[p], c[m], c[p], d[m], d[x], d[p])
            low = min(b[m], b[x], b[p], c[m], c[p], d[m], d[x], d[p])
            ring = a[n] + a[m] + a[x] + a[p] + a[q] + e[n] + e[m] + e[x] + e[p] + e[q]
            ring += b[n] + b[q] + c[n] + c[q] + d[n] + d[q]
            off = c[x] - ring * np.float32(1.0 / 16.0)
            peak = (c[x] >= top) & (off > reach * noise[y, x])
            pit = (c[x] <= low) & (-off > reach * noise[y, x])
            result[y, x] = peak | pit
