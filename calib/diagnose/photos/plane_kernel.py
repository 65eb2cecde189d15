"""Planes through values at places, compiled: a small system for each of some thousand points."""

from __future__ import annotations

import numpy as np

from photogonio.capture.jit import jit


@jit
def planes_at(places, known, values, near, ridge, level, noise, scatter):
    """What planes through ``values`` (m, c) at the ``known`` places (m, 2) that are ``near`` (n, k) say at ``places``
    (n, 2): their ``level`` and the variance of that, ``noise``, (n, c) each; and how far they miss, as a share of the
    mean value, ``scatter`` (n,), by the mean of the channels.

    ``ridge`` is what the normal equations' diagonal has more, a neighbour: places in a row tell no plane.
    """
    count, channels = near.shape[1], values.shape[1]
    x, y, mean_off = np.empty(count), np.empty(count), np.empty(count)
    for n in range(len(places)):
        total = 0.0
        for k in range(count):
            x[k] = places[n, 0] - known[near[n, k], 0]
            y[k] = places[n, 1] - known[near[n, k], 1]
            total += x[k] * x[k] + y[k] * y[k]
        reach = np.sqrt(total / count)
        sx, sy, xx, xy, yy = 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(count):
            x[k] /= reach
            y[k] /= reach
            mean_off[k] = 0.0
            sx += x[k]
            sy += y[k]
            xx += x[k] * x[k]
            xy += x[k] * y[k]
            yy += y[k] * y[k]
        ones, xx, yy = count * (1.0 + ridge), xx + ridge * count, yy + ridge * count
        # the inverse's rows, times the determinant
        a, b, c = xx * yy - xy * xy, xy * sy - sx * yy, sx * xy - xx * sy
        d, e, f = ones * yy - sy * sy, sx * sy - ones * xy, ones * xx - sx * sx
        det = ones * a + sx * b + sy * c
        size = 0.0
        for channel in range(channels):
            s, tx, ty = 0.0, 0.0, 0.0
            for k in range(count):
                value = values[near[n, k], channel]
                s += value
                tx += x[k] * value
                ty += y[k] * value
            first, second = (a * s + b * tx + c * ty) / det, (b * s + d * tx + e * ty) / det
            third, squares = (c * s + e * tx + f * ty) / det, 0.0
            for k in range(count):
                off = values[near[n, k], channel] - first - second * x[k] - third * y[k]
                squares += off * off
                mean_off[k] += off / channels
            level[n, channel] = first
            noise[n, channel] = a / det * squares / (count - 3)
            size += s / (count * channels)
        missed = 0.0
        for k in range(count):
            missed += mean_off[k] * mean_off[k]
        scatter[n] = np.sqrt(missed / count) / max(size, 1e-300)
