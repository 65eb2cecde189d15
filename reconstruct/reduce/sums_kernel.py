"""The last compiled stage of :mod:`reconstruct.reduce.fused`: the pixels of a row summed by facet pair."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from photogonio.capture.jit import jit

SCATTER = 0x2545F4914F6CDD1D  # odd, of well mixed bits: Vigna's


class SumTable(NamedTuple):
    """A table that grows: an open hash of indices in ``keys``, and the sums of each."""

    slots: np.ndarray  # (4 n,) int32, -1: free
    keys: np.ndarray  # (n,) int64
    sums: np.ndarray  # (n, 11 + 3 c)


@jit
def gather(rig, value, variance, shift, row, start, stop, cells, used):
    """Adds the pixels of a row to the cells of their facet pairs. Returns the cells and how many are in use."""
    c = len(rig.per_strength)
    keys, end, one = row.key, start, np.uint64(1)
    while end < stop:
        first, key = end, keys[end]
        while end < stop and keys[end] == key:
            end += one
        if key < 0:
            continue
        if used == len(cells.keys):
            cells = _grown(cells)
        at = _slot(cells.slots, cells.keys, key)
        if cells.slots[at] < 0:
            cells.slots[at], cells.keys[used] = used, key
            used += 1
        cell = cells.sums[cells.slots[at]]
        _add_light(cell, rig.per_strength, rig.weight, value, variance, shift, row.inverse, first, end)
        cell[0] += np.float64(end - first)
        _add_place(cell, 1, 2 + 3 * c, rig.weight, row, first, end)
    return cells, used


@jit
def _add_light(cell, per_strength, weight, value, variance, shift, inverse, first, last):
    """Sums of omega f, omega f^2 and omega^2 var(f) of a run of pixels.

    With omega = weight g, f = s L and s = per_strength / g these are sums of L, L^2 / g and var(L), but for factors.
    """
    c = len(per_strength)
    for k in range(c):
        total, square, noise = 0.0, 0.0, 0.0
        for x in range(first, last):
            radiance = np.float64(value[x + shift, k])
            total += radiance
            square += radiance * radiance * inverse[x]
            noise += variance[x + shift, k]
        scale = weight * per_strength[k]
        cell[2 + k] += scale * total
        cell[2 + c + k] += scale * per_strength[k] * square
        cell[2 + 2 * c + k] += scale * scale * noise


@jit
def _add_place(cell, weights, base, weight, row, first, last):
    """Sum of omega, and sums of omega times directions and place, of a run of pixels."""
    geometry, incident, exit_, point = row.geometry, row.incident, row.exit, row.point
    total, a, b, c, d, e, f, g, h, i = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for x in range(first, last):
        w = geometry[x]
        total += w
        a, b, c = a + w * incident[0, x], b + w * incident[1, x], c + w * incident[2, x]
        d, e, f = d + w * exit_[0, x], e + w * exit_[1, x], f + w * exit_[2, x]
        g, h, i = g + w * point[0, x], h + w * point[1, x], i + w * point[2, x]
    cell[weights] += weight * total
    for k, part in enumerate((a, b, c, d, e, f, g, h, i)):
        cell[base + k] += weight * part


@jit
def _slot(slots, keys, key):
    """Where ``key`` stands, or would, in the open hash."""
    mask = len(slots) - 1
    at = (key * SCATTER >> 20) & mask
    while slots[at] >= 0 and keys[slots[at]] != key:
        at = (at + 1) & mask
    return at


@jit
def _grown(cells):
    """Room for twice as many cells."""
    n, columns = cells.sums.shape
    slots, keys, sums = np.empty(8 * n, np.int32), np.empty(2 * n, np.int64), np.zeros((2 * n, columns))
    slots[:] = -1
    for k in range(n):
        keys[k] = cells.keys[k]
        for m in range(columns):
            sums[k, m] = cells.sums[k, m]
        slots[_slot(slots, keys, keys[k])] = k
    return SumTable(slots, keys, sums)
