"""Hot pixels, dead pixels and a renderer's fireflies: spots of at most 3 x 3 pixels on a calm ground."""

from __future__ import annotations

import cv2
import numpy as np

from photogonio.capture.linear import kernel as pointwise

REACH = 8.0  # standard deviations, of noise or of the ring's own scatter
CONTRAST = 0.1  # of the ground's level: a fainter spot does no harm
CALM = 0.1  # of the spot's height: more unrest in the ring, and the spot is part of something larger
CALM_NOISE = 3.5  # standard deviations that the highest of a calm ring's 16 pixels may show
WINDOW = 33  # pixels
MOST = 0.05  # share of a window: with more, the surface itself sparkles there, and nothing is rejected


def isolated_spots(value: np.ndarray, variance: np.ndarray, *, crowded: bool = True) -> np.ndarray:
    """Pixels (h, w) bool of spots, from radiance and variance (h, w, c).

    A spot's peak is the extreme of its 3 x 3 pixels and stands off the median of the 16 pixels of the ring
    around them by REACH standard deviations, of noise or of the ring; and the ring is calm. A highlight that
    spreads over more than 3 x 3 pixels lifts its ring and stays; and where spots are many, they are the
    surface's own and stay, if the ``crowded`` are looked for. A lamp's image in a small mirror ball can be a spot.
    """
    level, noise = np.empty(value.shape[:2], np.float32), np.empty(value.shape[:2], np.float32)
    pointwise.gray(np.ascontiguousarray(value), np.ascontiguousarray(variance), level, noise)
    result, candidates = np.zeros((2, *level.shape), bool)
    if min(level.shape) < 5:
        return result
    # a first, quick test: the ring of a real spot is calm, so that its mean is near its median
    pointwise.extremes(level, noise, np.float32(0.5 * REACH), np.float32(0.5 * CONTRAST), candidates)
    pointwise.calm_spots(level, noise, candidates, REACH, CONTRAST, CALM, CALM_NOISE, result)
    if crowded and result.any():
        share = cv2.boxFilter(result.astype(np.float32), -1, (WINDOW, WINDOW))
        result &= share <= MOST
    return result
