"""Hot pixels, dead pixels and a renderer's fireflies: spots of at most 3 x 3 pixels on a calm ground."""

from __future__ import annotations

import cv2
import numpy as np

from capture import pointwise

REACH = 8.0  # standard deviations, of noise or of the ring's own scatter
CONTRAST = 0.1  # of the ground's level: a fainter spot does no harm
CALM = 0.1  # of the spot's height: more unrest in the ring, and the spot is part of something larger
CALM_NOISE = 3.5  # standard deviations that the highest of a calm ring's 16 pixels may show
WINDOW = 33  # pixels
MOST = 0.05  # share of a window: with more, the surface itself sparkles there, and nothing is rejected
RING = np.array([(y, x) for y in range(-2, 3) for x in range(-2, 3) if max(abs(y), abs(x)) == 2])
INNER = np.array([(y, x) for y in range(-1, 2) for x in range(-1, 2)])


def isolated_spots(value: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Pixels (h, w) bool of spots, from radiance and variance (h, w, c).

    A spot's peak is the extreme of its 3 x 3 pixels and stands off the median of the 16 pixels of the ring
    around them by REACH standard deviations, of noise or of the ring; and the ring is calm. A highlight that
    spreads over more than 3 x 3 pixels lifts its ring and stays; and where spots are many, they are the
    surface's own and stay. A lamp's image in a small mirror ball can be a spot.
    """
    level, noise = np.empty(value.shape[:2], np.float32), np.empty(value.shape[:2], np.float32)
    pointwise.gray(np.ascontiguousarray(value), np.ascontiguousarray(variance), level, noise)
    result, candidates = np.zeros((2, *level.shape), bool)
    if min(level.shape) < 5:
        return result
    # a first, quick test: the ring of a real spot is calm, so that its mean is near its median
    pointwise.extremes(level, noise, np.float32(0.5 * REACH), candidates)
    places = np.argwhere(candidates)
    for sign in (1, -1):
        ys, xs = (spot_peaks(level, noise, places, sign)[:, None] + INNER).transpose(2, 0, 1)
        result[ys, xs] = True
    if result.any():
        share = cv2.boxFilter(result.astype(np.float32), -1, (WINDOW, WINDOW))
        result &= share <= MOST
    return result


def spot_peaks(level: np.ndarray, noise: np.ndarray, places: np.ndarray, sign: int) -> np.ndarray:
    """Those of ``places`` (n, 2), rows and columns at least two pixels from the border, that are bright
    spots, or dark ones with ``sign`` -1.
    """
    at = tuple(places.T)
    inner = sign * level[tuple((places[:, None] + INNER).transpose(2, 0, 1))]
    places = places[sign * level[at] >= inner.max(axis=1)] if len(places) else places
    if not len(places):
        return places
    at = tuple(places.T)
    around = sign * level[tuple((places[:, None] + RING).transpose(2, 0, 1))]
    middle = np.median(around, axis=1)
    scatter = np.maximum(noise[at], 1.4826 * np.median(np.abs(around - middle[:, None]), axis=1))
    height, unrest = sign * level[at] - middle, around.max(axis=1) - middle
    calm = unrest <= np.maximum(CALM * height, CALM_NOISE * scatter)
    return places[(height > np.maximum(REACH * scatter, CONTRAST * np.abs(middle))) & calm]
