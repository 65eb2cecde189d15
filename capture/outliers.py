"""Hot pixels, dead pixels and a renderer's fireflies: spots of at most 3 x 3 pixels on a calm ground."""

from __future__ import annotations

import cv2
import numpy as np

REACH = 8.0  # standard deviations of noise or of the ring's own scatter
CALM = 0.1  # of the spot's height: more unrest in the ring, and the spot is part of something larger
MOST = 0.005  # share of all pixels: with more, it is the surface that sparkles, and nothing is rejected
RING = np.array([(y, x) for y in range(-2, 3) for x in range(-2, 3) if max(abs(y), abs(x)) == 2])
INNER = np.array([(y, x) for y in range(-1, 2) for x in range(-1, 2)])


def isolated_spots(value: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Pixels (h, w) bool of spots, from radiance and variance (h, w, c).

    A spot's peak is the extreme of its 3 x 3 pixels and stands off the median of the 16 pixels of the ring
    around them by REACH standard deviations, of noise or of the ring; and the ring is flat to a tenth of
    that. A glint that spreads over more than 3 x 3 pixels lifts its ring and stays; and where spots are
    many, they are the surface's own and all stay.
    """
    level = np.ascontiguousarray(value.mean(axis=2, dtype=np.float32))
    noise = np.sqrt(variance.sum(axis=2, dtype=np.float32)) / np.float32(value.shape[2])
    result = np.zeros(level.shape, bool)
    if min(level.shape) < 5:
        return result
    for sign in (1.0, -1.0):
        peaks = spot_peaks(level * np.float32(sign), noise)
        ys, xs = np.clip(peaks[:, None] + INNER, 0, np.array(level.shape) - 1).transpose(2, 0, 1)
        result[ys, xs] = True
    return result if result.mean() <= MOST else np.zeros(level.shape, bool)


def spot_peaks(level: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Rows and columns (n, 2) of bright spots' peaks, at least two pixels from the border."""
    highest = cv2.dilate(level, np.ones((3, 3), np.uint8))
    inner = cv2.boxFilter(level, -1, (3, 3), normalize=False)
    ring = (cv2.boxFilter(level, -1, (5, 5), normalize=False) - inner) / np.float32(len(RING))
    # a first, quick test by the ring's mean; the ring of a real spot is calm, so the mean is near its median
    candidates = (level >= highest) & (level - ring > 0.5 * REACH * noise)
    candidates[:2], candidates[-2:], candidates[:, :2], candidates[:, -2:] = False, False, False, False
    places = np.argwhere(candidates)
    if not len(places):
        return places
    around = level[tuple((places[:, None] + RING).transpose(2, 0, 1))]
    middle = np.median(around, axis=1)
    scatter = 1.4826 * np.median(np.abs(around - middle[:, None]), axis=1)
    at = tuple(places.T)
    height = level[at] - middle
    unrest = around.max(axis=1) - middle
    limit = REACH * np.maximum(noise[at], scatter)
    calm = unrest <= np.maximum(CALM * height, 3.5 * np.maximum(noise[at], scatter))
    return places[(height > limit) & calm]
