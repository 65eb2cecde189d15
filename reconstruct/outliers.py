"""Isolated pixels unlike their neighbours: dust, hot pixels, a renderer's fireflies (blurred to some 3 x 3
pixels).

A pixel is judged against the means of opposite pixels on the square ring three pixels away, which a gradient
leaves alone and a spot of 5 x 5 pixels does not reach. It is an outlier if it sticks out of the four means
along rows, columns and diagonals by REACH standard errors of its noise, and out of the median of the ring's
twelve means by REACH times the greater of its noise and the ring's own scatter (texture, or noise greater
than said).
"""

from __future__ import annotations

import numpy as np

RING = 3  # pixels
REACH = 6.0  # standard errors
LEAST_PAIRS = 4  # of the twelve; fewer: not judged
# half of the ring, (dy, dx); the other half is opposite. The first four are the column, the row and the
# diagonals
OFFSETS = np.array(
    [(3, 0), (0, 3), (3, 3), (3, -3), (3, 1), (3, 2), (3, -1), (3, -2), (1, 3), (2, 3), (-1, 3), (-2, 3)]
)
MAD_TO_SIGMA = 1.4826


def isolated(value: np.ndarray, variance: np.ndarray, usable: np.ndarray) -> np.ndarray:
    """Outliers (h, w) bool of radiance ``value`` (h, w, c) of noise ``variance``; rings take ``usable``
    pixels only.

    The numpy form of :func:`reconstruct.kernel.stands_out`.
    """
    level = np.where(usable, value.astype(float).mean(2), np.nan)
    sigma = np.sqrt(variance.astype(float).sum(2)) / value.shape[2]
    padded = np.pad(level, RING, constant_values=np.nan)
    height, width = level.shape

    def ring_mean(dy: int, dx: int) -> np.ndarray:
        ahead = padded[RING + dy : RING + dy + height, RING + dx : RING + dx + width]
        behind = padded[RING - dy : RING - dy + height, RING - dx : RING - dx + width]
        return 0.5 * (ahead + behind)

    low, high = np.full(level.shape, np.inf), np.full(level.shape, -np.inf)
    for dy, dx in OFFSETS[:4]:
        mean = ring_mean(dy, dx)
        low, high = np.fmin(low, mean), np.fmax(high, mean)
    with np.errstate(invalid="ignore"):
        out = ((level > high + REACH * sigma) | (level < low - REACH * sigma)) & usable
    if not out.any():
        return out
    means = np.array([ring_mean(dy, dx)[out] for dy, dx in OFFSETS])
    out[out] = _sticks_out(level[out], sigma[out], means)
    return out


def _sticks_out(level: np.ndarray, sigma: np.ndarray, means: np.ndarray) -> np.ndarray:
    """The second test, of n pixels against the ring's means (12, n)."""
    judged = np.isfinite(means).sum(0) >= LEAST_PAIRS
    out = np.zeros(len(level), bool)
    if judged.any():
        means = means[:, judged]
        middle = np.nanmedian(means, axis=0)
        # a mean of two scatters by 1 / sqrt(2) of a pixel
        scatter = MAD_TO_SIGMA * np.sqrt(2.0) * np.nanmedian(np.abs(means - middle), axis=0)
        out[judged] = np.abs(level[judged] - middle) > REACH * np.maximum(sigma[judged], scatter)
    return out
