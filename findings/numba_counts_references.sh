#!/usr/bin/env bash
# numba 0.68.1: a small function that looks things up in several arrays and has more than one way out costs ten times what its
# arithmetic does. At each call arrays are counted up and down by atomic operations, though nothing is kept: numba takes such
# pairs out only where it sees that both stand on all ways through. Ray tracers and lookups in geometry, whose scene is a
# tuple of arrays, spend nine tenths of their time so. Neither inline="always" helps nor giving the arrays one by one.
#
# The remedy in the last line is the option _nrt=False, which numba does not document: right for functions that make no array
# and give none back.
#
# Output seen (nanoseconds a call, on one machine; only the ratios are checked):
#   tuple of six arrays     : 95
#   the same, inline=always : 83
#   arrays one by one       : 95
#   tuple, nothing counted  : 9
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numba==0.68.1 numpy==2.4.6
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import time
from typing import NamedTuple

import numpy as np
from numba import njit


class Scene(NamedTuple):
    extent: np.ndarray
    origin: np.ndarray
    right: np.ndarray
    down: np.ndarray
    bits: np.ndarray
    bins: np.ndarray


def body(extent, origin, right, down, bits, bins, x, y):
    if x < extent[0] or y < extent[1] or x > extent[2] or y > extent[3]:
        return -1
    for n in range(bins.shape[2]):
        k = bins[int(y), int(x), n]
        if k < 0:
            break
        u = (x - origin[k, 0]) * right[k, 0] + (y - origin[k, 1]) * right[k, 1]
        v = (x - origin[k, 0]) * down[k, 0] + (y - origin[k, 1]) * down[k, 1]
        if 0.0 <= u < 1.0 and 0.0 <= v < 1.0:
            return bits[k, int(v * 7), int(u * 7)]
    return 1


def of_tuple(s, x, y):
    if x < s.extent[0] or y < s.extent[1] or x > s.extent[2] or y > s.extent[3]:
        return -1
    for n in range(s.bins.shape[2]):
        k = s.bins[int(y), int(x), n]
        if k < 0:
            break
        u = (x - s.origin[k, 0]) * s.right[k, 0] + (y - s.origin[k, 1]) * s.right[k, 1]
        v = (x - s.origin[k, 0]) * s.down[k, 0] + (y - s.origin[k, 1]) * s.down[k, 1]
        if 0.0 <= u < 1.0 and 0.0 <= v < 1.0:
            return s.bits[k, int(v * 7), int(u * 7)]
    return 1


SIDE = 12
rng = np.random.default_rng(0)
corners = np.argwhere(np.ones((SIDE, SIDE)))[:, ::-1].astype(float)
bins = np.full((SIDE + 1, SIDE + 1, 4), -1)
bins[:SIDE, :SIDE, 0] = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
scene = Scene(
    np.array([0.0, 0.0, SIDE, SIDE]),
    corners,
    np.tile([1.0, 0.0], (len(corners), 1)),
    np.tile([0.0, 1.0], (len(corners), 1)),
    rng.integers(0, 2, (len(corners), 7, 7)),
    bins,
)
places = rng.uniform(0.0, SIDE, (400_000, 2))


def timed(name, function, apart=False):
    if apart:
        @njit
        def loop(s, places):
            extent, origin, right, down, bits, bins = s
            total = 0
            for n in range(len(places)):
                total += function(extent, origin, right, down, bits, bins, places[n, 0], places[n, 1])
            return total
    else:
        @njit
        def loop(s, places):
            total = 0
            for n in range(len(places)):
                total += function(s, places[n, 0], places[n, 1])
            return total

    found, best = loop(scene, places), np.inf
    for _ in range(9):
        start = time.process_time()
        loop(scene, places)
        best = min(best, time.process_time() - start)
    print(f"{name:24}: {best / len(places) * 1e9:.0f}")
    return found, best


whole = timed("tuple of six arrays", njit(of_tuple))
inline = timed("the same, inline=always", njit(inline="always")(of_tuple))
parts = timed("arrays one by one", njit(body), apart=True)
uncounted = timed("tuple, nothing counted", njit(_nrt=False)(of_tuple))
assert whole[0] == inline[0] == parts[0] == uncounted[0]
assert min(whole[1], inline[1], parts[1]) > 3.0 * uncounted[1]
PY
