"""The print laid over windows of a photo, compiled: drawn as the camera blurs it, and moved until it fits."""

from __future__ import annotations

import math

import numpy as np

from photogonio.capture.jit import borrowing, in_lanes, jit
from photogonio.capture.robust import OF_SIZE

FINE = 3  # samples of the pattern across a pixel
_BLUR = 0.5  # pixels, standard deviation of a slight blur
_TUKEY = 4.0
_EDGE_ERROR = 0.04  # of the contrast: pixels on an edge are drawn no better than that
_FEWEST_INLIERS = 0.7
_FEWEST_KNOWN = 0.6  # share of a window that the print fills, and of that what is usable
_WORST_FIT = 0.12  # residual over contrast
_WORST_SIGMA = 0.12  # pixels
_LINEAR = 0.25  # pixels: a smaller step needs no new drawing
_BOLDEST_MOVE = 1.2  # pixels
_CORRELATED = 1.5  # neighbouring pixels share blur: the standard error is larger by so much
_DRAWINGS, _WEIGHINGS = 3, 4
_VALUES = 9  # gain, offset, slopes of both along u and v, blur, shift along u and v

# sums in lanes


def _taps() -> np.ndarray:
    """Weights of the fine samples that make up a pixel: a normal distribution, and the pixel's own width."""
    reach = round(4 * _BLUR * FINE)
    normal = np.exp(-0.5 * (np.arange(-reach, reach + 1) / (_BLUR * FINE)) ** 2)
    return np.convolve(normal / normal.sum(), np.full(FINE, 1 / FINE))


_TAPS = _taps()


@jit
def find_shifts(tone, clear, bare, scale, flat, level, middle, half, shift, sigma):
    """Shift (n, 2) of the photo against the drawn pattern and its standard error (n,), pixels; infinite where they do
    not agree.

    ``tone`` (h, w) float32 is the drawing, of which ``clear`` (h, w) alone counts where ``bare``, ``scale`` its pixels
    per length. ``flat`` (n, 2, 6) takes a pixel's offsets, over the window's half width ``half`` (n,), to board x and
    y. ``level`` (n, s, s) is the photo, NaN where it may not be used, ``middle`` (n, 2) the windows' middles in it.
    """
    for k in range(len(half)):
        shift[k, 0], shift[k, 1] = 0.0, 0.0
        sigma[k] = _fit(tone, clear, bare, scale, flat[k], level[k], middle[k], half[k], shift[k])


@jit
def _fit(tone, clear, bare, scale, flat, level, middle, half, shift):
    """Fills in one window's ``shift`` (2,); its standard error."""
    known, filled, count = _known(clear, bare, scale, flat, half)
    places, light = _usable(known, level, middle, half)
    if not filled or len(places) < max(_FEWEST_KNOWN * count, _VALUES):
        return np.inf
    step, error = np.empty(2), np.inf
    for _ in range(_DRAWINGS):
        drawn = _draw(tone, scale, flat, half, shift)
        error = _solve(_design(drawn, places, half), light, step)
        if not (error < np.inf and math.hypot(shift[0] + step[0], shift[1] + step[1]) <= _BOLDEST_MOVE):
            return np.inf
        shift[0] += step[0]
        shift[1] += step[1]
        if math.hypot(step[0], step[1]) < _LINEAR:
            break
    return error if error < _WORST_SIGMA else np.inf


@borrowing
def _place(flat, u, v):
    """Board x and y of a pixel's offsets over the half width."""
    return _quadratic(flat[0], u, v), _quadratic(flat[1], u, v)


@borrowing
def _quadratic(of, u, v):
    return of[0] + of[1] * u + of[2] * v + of[3] * u * u + of[4] * u * v + of[5] * v * v


@jit
def _known(clear, bare, scale, flat, half):
    """Which pixels of a window (s, s) the print fills, as far as it may be used, whether it fills enough, and how many
    they are."""
    side, (height, width) = 2 * half + 1, clear.shape
    known, filled, count = np.zeros((side, side), np.bool_), 0, 0
    for i in range(side):
        for j in range(side):
            x, y = _place(flat, (j - half) / half, (i - half) / half)
            if x >= 0 and y >= 0 and x * scale <= width and y * scale <= height:
                filled += 1
                row, column = min(int(height - y * scale), height - 1), min(int(x * scale), width - 1)
                known[i, j] = clear[row, column] or not bare
                count += known[i, j]
    return known, filled >= _FEWEST_KNOWN * side * side, count


@jit
def _usable(known, level, middle, half):
    """Rows and columns (n, 2) in a window of the pixels that are known and usable, and their light (n,)."""
    side = 2 * half + 1
    places, light, count = np.empty((side * side, 2), np.int64), np.empty(side * side), 0
    for i in range(side):
        for j in range(side):
            here = level[middle[1] - half + i, middle[0] - half + j]
            if known[i, j] and not math.isnan(here):
                places[count, 0], places[count, 1], light[count] = i, j, here
                count += 1
    return places[:count], light[:count]


@jit
def _draw(tone, scale, flat, half, shift):
    """The pattern with box pixels and a slight blur, moved by ``shift``, one pixel wider than the window."""
    side, reach = 2 * half + 3, (len(_TAPS) - FINE) // 2
    count = FINE * side
    fine = np.empty((count, count))
    for i in range(count):
        v = ((i + 0.5) / FINE - half - 1.5 - shift[1]) / half
        for j in range(count):
            u = ((j + 0.5) / FINE - half - 1.5 - shift[0]) / half
            x, y = _place(flat, u, v)
            fine[i, j] = _tone(tone, x * scale - 0.5, tone.shape[0] - y * scale - 0.5)
    return _thinned(_thinned(fine, reach).T, reach).T


@borrowing
def _tone(tone, x, y):
    """Between four pixels of the drawing (h, w); a half beyond it."""
    height, width = tone.shape
    column, row = math.floor(x), math.floor(y)
    if column < -1 or row < -1 or column >= width or row >= height:
        return 0.5
    u, v = x - column, y - row
    j, i = int(column), int(row)
    if j >= 0 and i >= 0 and j < width - 1 and i < height - 1:
        above = tone[i, j] + u * (tone[i, j + 1] - tone[i, j])
        below = tone[i + 1, j] + u * (tone[i + 1, j + 1] - tone[i + 1, j])
        return above + v * (below - above)
    total = 0.0
    for a in range(2):
        for b in range(2):
            inside = 0 <= i + a < height and 0 <= j + b < width
            share = (v if a else 1.0 - v) * (u if b else 1.0 - u)
            total += share * (tone[i + a, j + b] if inside else 0.5)
    return total


@in_lanes
def _thinned(fine, reach):
    """Every third row (n / 3, m) of ``fine`` (n, m), the rows about it weighed together; those at the edges repeat."""
    count, width = fine.shape
    result = np.zeros((count // FINE, width))
    for i in range(len(result)):
        row = result[i]
        for k in range(len(_TAPS)):
            weight, there = _TAPS[k], fine[min(max(FINE * i - reach + k, 0), count - 1)]
            for j in range(width):
                row[j] += weight * there[j]
    return result


@jit
def _design(drawn, places, half):
    """Derivatives (9, n) of the chosen pixels by gain, offset, their slopes, blur and shift."""
    design = np.empty((_VALUES, len(places)))
    for n in range(len(places)):
        i, j = places[n, 0] + 1, places[n, 1] + 1  # the drawing is a pixel wider
        here, left, right = drawn[i, j], drawn[i, j - 1], drawn[i, j + 1]
        above, below = drawn[i - 1, j], drawn[i + 1, j]
        u, v = (j - 1 - half) / half, (i - 1 - half) / half
        design[0, n], design[1, n], design[2, n], design[3, n] = here, 1.0, u, v
        design[4, n], design[5, n] = here * u, here * v
        design[6, n] = right + left + below + above - 4 * here
        design[7, n], design[8, n] = (right - left) / 2, (below - above) / 2
    return design


@jit
def _solve(design, level, step):
    """One linear ``step`` (2,), with Tukey's weights; its standard error, infinite where the fit is bad."""
    count = len(level)
    weight, normal = np.ones(count), np.empty((_VALUES, _VALUES))
    right, values, residual, sizes = np.empty(_VALUES), np.zeros(_VALUES), np.empty(count), np.empty(count)
    for _ in range(_WEIGHINGS):
        _sums(design, weight, level, normal, right)
        if not _cholesky(normal):
            return np.inf
        for k in range(_VALUES):  # one by one: compiling `values[:] = right` takes four seconds
            values[k] = right[k]
        _substitute(normal, values)
        _residuals(design, values, level, residual)
        for n in range(count):
            sizes[n] = abs(residual[n])
        spread = max(OF_SIZE * _middle(sizes), 1e-9)
        bound = _TUKEY * max(spread, _EDGE_ERROR * abs(values[0]))
        for n in range(count):
            inside = max(1.0 - (residual[n] / bound) ** 2, 0.0)
            weight[n] = inside * inside
    gain, scatter, total, inliers = values[0], 0.0, 0.0, 0
    for n in range(count):
        scatter += weight[n] * residual[n] ** 2
        total += weight[n]
        inliers += weight[n] > 0.1
    scatter = math.sqrt(scatter / max(total - _VALUES, 1.0))
    if not (gain > 0 and inliers / count >= _FEWEST_INLIERS and scatter <= _WORST_FIT * gain):
        return np.inf
    step[0], step[1] = -values[7] / gain, -values[8] / gain
    total = 0.0
    for k in (7, 8):
        for i in range(_VALUES):
            right[i] = 0.0
        right[k] = 1.0
        _substitute(normal, right)
        total += right[k]
    return _CORRELATED * scatter * math.sqrt(total / 2) / gain


@in_lanes
def _sums(design, weight, level, normal, right):
    """Normal matrix (9, 9), its lower half, and right-hand side (9,)."""
    count = len(level)
    row = np.empty(count)
    for i in range(_VALUES):
        one = design[i]
        for n in range(count):
            row[n] = weight[n] * one[n]
        total = 0.0
        for n in range(count):
            total += row[n] * level[n]
        right[i] = total
        for j in range(i + 1):
            total, other = 0.0, design[j]
            for n in range(count):
                total += row[n] * other[n]
            normal[i, j] = total
        normal[i, i] += 1e-9


@in_lanes
def _residuals(design, values, level, residual):
    for n in range(len(level)):
        residual[n] = level[n]
    for i in range(_VALUES):
        value, row = values[i], design[i]
        for n in range(len(level)):
            residual[n] -= value * row[n]


@borrowing
def _middle(values):
    """The median of values (n,), n at least 1, which are put in another order: Hoare's selection. Compiling numpy's
    takes two seconds."""
    first, last, k = 0, len(values) - 1, len(values) // 2
    while first < last:
        pivot, i, j = values[(first + last) // 2], first, last
        while i <= j:
            while values[i] < pivot:
                i += 1
            while pivot < values[j]:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i += 1
                j -= 1
        if k <= j:
            last = j
        elif k >= i:
            first = i
        else:
            break
    if len(values) % 2:
        return values[k]
    below = values[0]
    for n in range(1, k):
        below = max(below, values[n])
    return 0.5 * (below + values[k])


@borrowing
def _cholesky(matrix):
    """The lower factor in place of a symmetric matrix's lower half; False if it is not positive."""
    for i in range(len(matrix)):
        for j in range(i + 1):
            rest = matrix[i, j]
            for k in range(j):
                rest -= matrix[i, k] * matrix[j, k]
            if i > j:
                matrix[i, j] = rest / matrix[j, j]
            elif rest > 0.0:
                matrix[i, i] = math.sqrt(rest)
            else:
                return False
    return True


@borrowing
def _substitute(lower, vector):
    """Solves ``lower lower' x = vector`` in place."""
    size = len(vector)
    for i in range(size):
        for k in range(i):
            vector[i] -= lower[i, k] * vector[k]
        vector[i] /= lower[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            vector[i] -= lower[k, i] * vector[k]
        vector[i] /= lower[i, i]
