"""Arithmetic of single pixels and their neighbourhoods, compiled: one pass over a photo instead of ten.

Photos are taken as rows of ``width * channels`` numbers, so that the loops run in vector lanes. The functions
release the interpreter's lock. Unsigned columns for the same reason as in :mod:`reconstruct.reduce.kernel`: an index
that may be negative keeps a loop out of the lanes.
"""

from __future__ import annotations

import numpy as np

from photogonio.capture.jit import jit
from photogonio.capture.robust import OF_SIZE


@jit
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


@jit
def widened(codes, values, result):
    """``values`` (65536,) of the bits ``codes`` of half floats, to ``result``, float32; (h, w, c) both."""
    for y in range(len(codes)):
        bits, row = codes[y].reshape(-1), result[y].reshape(-1)
        for x in range(np.uint64(len(bits))):
            row[x] = values[bits[x]]


@jit
def full(pixels, clip, result):
    """Marks the pixels (h, w) some channel of which, of (h, w, c), is at or above ``clip``; most rows have none."""
    for y in range(len(pixels)):
        row = pixels[y].reshape(-1)
        most = row[0]
        for x in range(np.uint64(len(row))):
            most = max(most, row[x])
        if most >= clip:
            for x in range(pixels.shape[1]):
                for c in range(pixels.shape[2]):
                    result[y, x] |= pixels[y, x, c] >= clip


@jit
def totals(value, level):
    """Sum over channels (h, w) of (h, w, c); three of them are added in vector lanes."""
    for y in range(len(value)):
        row, three = value[y].reshape(-1), np.uint64(3)
        if value.shape[2] == 3:
            for x in range(np.uint64(value.shape[1])):
                level[y, x] = row[three * x] + row[three * x + np.uint64(1)] + row[three * x + np.uint64(2)]
        else:
            for x in range(value.shape[1]):
                level[y, x] = value[y, x].sum()


@jit
def mean_level(value, level):
    """Mean over channels (h, w) of (h, w, c), 0 where it is not finite."""
    totals(value, level)
    channels = np.float32(value.shape[2])
    for y in range(len(level)):
        for x in range(np.uint64(level.shape[1])):
            mean = level[y, x] / channels
            level[y, x] = mean if mean - mean == np.float32(0.0) else np.float32(0.0)


@jit
def line_level(pixels, scale, offset, clip, level, usable):
    """Mean over channels (h, w) of ``scale * code + offset`` of codes (h, w, c), and whether all are below ``clip``."""
    channels, height = np.uint64(pixels.shape[2]), len(pixels)
    per = np.float32(scale / pixels.shape[2])
    for y in range(height):
        codes, light, below = pixels[y].reshape(-1), level[y], usable[y]
        if channels == 3:
            for x in range(np.uint64(len(light))):
                a, b, c = codes[3 * x], codes[3 * x + np.uint64(1)], codes[3 * x + np.uint64(2)]
                light[x] = (np.float32(a) + np.float32(b) + np.float32(c)) * per + offset
                below[x] = (a < clip) & (b < clip) & (c < clip)
        else:
            for x in range(np.uint64(len(light))):
                total, free = np.float32(0.0), True
                for c in range(channels):
                    code = codes[channels * x + c]
                    total += np.float32(code)
                    free &= code < clip
                light[x] = total * per + offset
                below[x] = free


@jit
def table_level(pixels, values, clip, level, usable):
    """The same of a curve: ``values`` (codes, c), already over the number of channels."""
    channels, curve = np.uint64(pixels.shape[2]), values.copy().reshape(-1)
    one, two = np.uint64(1), np.uint64(2)
    for y in range(len(pixels)):
        codes, light, below = pixels[y].reshape(-1), level[y], usable[y]
        if channels == 3:
            for x in range(np.uint64(len(light))):
                a, b, c = codes[3 * x], codes[3 * x + one], codes[3 * x + two]
                light[x] = (
                    curve[3 * np.uint64(a)] + curve[3 * np.uint64(b) + one] + curve[3 * np.uint64(c) + two]
                )
                below[x] = (a < clip) & (b < clip) & (c < clip)
        else:
            for x in range(np.uint64(len(light))):
                total, free = np.float32(0.0), True
                for k in range(channels):
                    code = codes[channels * x + k]
                    total += curve[channels * np.uint64(code) + k]
                    free &= code < clip
                light[x] = total
                below[x] = free


@jit
def calmed(level, floor, result):
    """``level`` (h, w) with each pixel that is above ``4 m + floor`` replaced by m, the median of its 3 x 3; beyond the
    border the nearest pixels count again.

    A pixel is above that of the median where it is above that of five of the nine: counted in vector lanes.
    """
    height, width = level.shape
    four, edge, odd, nine = np.float32(4.0), np.uint64(width - 1), np.empty(width, np.bool_), np.empty(9)
    for y in range(height):
        a, b, c = level[max(y - 1, 0)], level[y], level[min(y + 1, height - 1)]
        found = False
        for x in range(np.uint64(1), edge):
            m, p, v = x - np.uint64(1), x + np.uint64(1), b[x]
            count = np.int32(v > four * a[m] + floor) + np.int32(v > four * a[x] + floor)
            count += np.int32(v > four * a[p] + floor) + np.int32(v > four * b[m] + floor)
            count += np.int32(v > four * v + floor) + np.int32(v > four * b[p] + floor)
            count += np.int32(v > four * c[m] + floor) + np.int32(v > four * c[x] + floor)
            count += np.int32(v > four * c[p] + floor)
            odd[x] = count >= 5
            found |= count >= 5
            result[y, x] = v
        odd[0] = odd[edge] = True
        for x in range(0, width, 1 if found else max(width - 1, 1)):  # the ends in any case
            result[y, x] = b[x]
            if odd[x]:
                for k in range(3):
                    at = min(max(x + k - 1, 0), width - 1)
                    nine[k], nine[3 + k], nine[6 + k] = a[at], b[at], c[at]
                _sort(nine)
                middle = np.float32(nine[4])
                if b[x] > four * middle + floor:
                    result[y, x] = middle


@jit
def halved(level, result):
    """Means of two by two pixels of (h, w), (h / 2, w / 2)."""
    for y in range(len(result)):
        above, below, row = level[2 * y], level[2 * y + 1], result[y]
        for x in range(np.uint64(len(row))):
            left, right = np.uint64(2) * x, np.uint64(2) * x + np.uint64(1)
            row[x] = np.float32(0.25) * (above[left] + above[right] + below[left] + below[right])


@jit
def bounded(level, white, result):
    """level / white between 0 and 1; (h, w) each."""
    for y in range(len(level)):
        for x in range(np.uint64(level.shape[1])):
            result[y, x] = min(max(level[y, x] / white, np.float32(0.0)), np.float32(1.0))


@jit
def toned(level, white, tone):
    """255 sqrt(level / white) between 0 and 255, cut off to integers; (h, w) each."""
    for y in range(len(level)):
        for x in range(np.uint64(level.shape[1])):
            part = min(max(level[y, x] / white, np.float32(0.0)), np.float32(1.0))
            tone[y, x] = np.uint8(np.sqrt(part) * np.float32(255.0))


@jit
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


@jit
def extremes(level, noise, reach, contrast, result):
    """Marks pixels (h, w) that are an extreme of their 3 x 3 and stand off the mean of the 16 around those.

    They do by more than ``reach`` times their noise and more than ``contrast`` times that mean. Two pixels along
    the border are never marked.
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
            mean = ring * np.float32(1.0 / 16.0)
            off, least = c[x] - mean, max(reach * noise[y, x], contrast * abs(mean))
            result[y, x] = ((c[x] >= top) & (off > least)) | ((c[x] <= low) & (-off > least))


@jit
def calm_spots(level, noise, candidates, reach, contrast, calm, calm_noise, result):
    """Marks the 3 x 3 pixels of each candidate (h, w) that stands off a calm ring, the 16 pixels around them.

    It stands off the ring's median by ``reach`` times its noise or the ring's scatter and by ``contrast`` of the
    median; the ring is calm if it goes no farther that way than ``calm`` of the spot's height, or ``calm_noise``
    times the scatter.
    """
    ring = np.empty(16)
    for y in range(2, len(level) - 2):
        for x in range(2, level.shape[1] - 2):
            if candidates[y, x] and _calm_spot(
                level, np.float64(noise[y, x]), y, x, reach, contrast, calm, calm_noise, ring
            ):
                result[y - 1 : y + 2, x - 1 : x + 2] = True


@jit
def _calm_spot(level, noise, y, x, reach, contrast, calm, calm_noise, ring):
    n, total = 0, 0.0
    for dy in range(-2, 3):
        for dx in range(-2, 3):
            if abs(dy) == 2 or abs(dx) == 2:
                ring[n] = level[y + dy, x + dx]
                total += ring[n]
                n += 1
    sign = 1.0 if 16.0 * level[y, x] > total else -1.0  # a bright spot or a dark one
    _sort(ring)
    middle = 0.5 * (ring[7] + ring[8])
    height, unrest = sign * (level[y, x] - middle), max(sign * (ring[0] - middle), sign * (ring[15] - middle))
    if height <= max(reach * noise, contrast * abs(middle)):
        return False
    for k in range(16):
        ring[k] = abs(ring[k] - middle)
    _sort(ring)
    scatter = max(noise, OF_SIZE * 0.5 * (ring[7] + ring[8]))
    return height > reach * scatter and unrest <= max(calm * height, calm_noise * scatter)


@jit
def _sort(values):
    for i in range(1, len(values)):
        value, k = values[i], i
        while k > 0 and values[k - 1] > value:
            values[k] = values[k - 1]
            k -= 1
        values[k] = value
