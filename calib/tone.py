"""Pictures fit for detection: from linear, often dark, radiance to an even 8-bit gray."""

from __future__ import annotations

import math

import numpy as np

from capture import pointwise
from capture.radiance import RadianceImage

_BRIGHT = 98.0  # percentile taken as white: highlights and a white patch should not darken the board
_JUDGED = 250_000  # pixels, about, that tell a large picture's percentiles


def gray(image: RadianceImage) -> np.ndarray:
    """Mean of the channels, (h, w) float32, non-finite pixels as 0."""
    level = np.empty(image.value.shape[:2], np.float32)
    pointwise.mean_level(np.ascontiguousarray(image.value, np.float32), level)
    return level


def finite(image: RadianceImage) -> np.ndarray:
    """Pixels (h, w) bool all of whose channels are finite."""
    total = np.empty(image.value.shape[:2], np.float32)
    pointwise.totals(np.ascontiguousarray(image.value, np.float32), total)
    return np.isfinite(total)


def without_fireflies(level: np.ndarray) -> np.ndarray:
    """Single bright pixels replaced by the median around them, (h, w) float32."""
    level = np.ascontiguousarray(level, np.float32)
    calm = np.empty_like(level)
    pointwise.calmed(level, np.float32(1e-3 * _percentile(level, 99.0)), calm)
    return calm


def detection_image(level: np.ndarray) -> np.ndarray:
    """8-bit picture for the marker search of linear gray (h, w): white at the bright percentile, square-root tone."""
    tone = np.empty(level.shape, np.uint8)
    white = _percentile(level, _BRIGHT) or 1.0
    pointwise.toned(np.ascontiguousarray(level, np.float32), np.float32(white), tone)
    return tone


def fine_image(level: np.ndarray) -> np.ndarray:
    """Linear gray scaled to [0, 1] for sub-pixel work, (h, w) float32."""
    fine = np.empty(level.shape, np.float32)
    white = np.float32(_percentile(level, 99.5) or 1.0)
    pointwise.bounded(np.ascontiguousarray(level, np.float32), white, fine)
    return fine


def halved(level: np.ndarray) -> np.ndarray:
    """Means of two by two pixels, (h // 2, w // 2) float32; an odd row or column at the end is left out."""
    height, width = level.shape
    small = np.empty((height // 2, width // 2), np.float32)
    pointwise.halved(np.ascontiguousarray(level, np.float32), small)
    return small


def fine_about(level: np.ndarray, places: np.ndarray, reach: int) -> np.ndarray:
    """:func:`fine_image` of a picture without fireflies, within ``reach`` pixels of ``places`` (n, 2) alone; 0
    elsewhere."""
    level = np.ascontiguousarray(level, np.float32)
    fine, (height, width) = np.zeros_like(level), level.shape
    floor, white = 1e-3 * _percentile(level, 99.0), np.float32(_percentile(level, 99.5) or 1.0)
    for x, y in np.round(places).astype(int):
        part = np.s_[
            max(y - reach, 0) : min(y + reach + 1, height), max(x - reach, 0) : min(x + reach + 1, width)
        ]
        about = np.ascontiguousarray(level[part])
        if about.size:
            calm, here = np.empty((2, *about.shape), np.float32)
            pointwise.calmed(about, np.float32(floor), calm)
            pointwise.bounded(calm, white, here)
            fine[part] = here
    return fine


def _percentile(level: np.ndarray, share: float) -> float:
    step = max(1, math.isqrt(level.size // _JUDGED))
    return float(np.percentile(level[::step, ::step], share))
