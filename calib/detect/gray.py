"""Pictures fit for detection: from linear, often dark, radiance to an even 8-bit gray."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from photogonio.capture.linear import kernel as pointwise
from photogonio.capture.radiance import RadianceImage

_BRIGHT = 98.0  # percentile taken as white: highlights and a white patch should not darken the board
_JUDGED = 250_000  # pixels, about, that tell a large picture's percentiles


@dataclass(frozen=True, slots=True)
class GrayPart:
    """A part of a photo in gray."""

    level: np.ndarray  # (h, w) float32, linear radiance
    usable: np.ndarray  # (h, w) bool
    origin: tuple[int, int] = (0, 0)  # the photo's pixel that its first is


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


def fine_about(level: np.ndarray, places: np.ndarray, reach: int) -> tuple[np.ndarray, np.ndarray]:
    """:func:`fine_image` of a picture without fireflies, within ``reach`` pixels of each of ``places`` (n, 2): pieces
    under one another, (n s, s), and by how much what they show lies in the picture from there, (n, 2) pixels."""
    first, side = np.round(places).astype(int) - reach, 2 * reach + 1
    y = np.clip(first[:, 1, None] + np.arange(side), 0, level.shape[0] - 1)
    x = np.clip(first[:, 0, None] + np.arange(side), 0, level.shape[1] - 1)
    pieces = np.ascontiguousarray(level[y[:, :, None], x[:, None]].reshape(-1, side), np.float32)
    calm, fine = np.empty((2, *pieces.shape), np.float32)
    low, white = _percentile(level, np.array([99.0, 99.5]))
    pointwise.calmed(pieces, np.float32(1e-3 * low), calm)
    pointwise.bounded(calm, np.float32(white or 1.0), fine)
    return fine, first - side * np.column_stack([np.zeros(len(first), int), np.arange(len(first))])


def compiled_before() -> bool:
    """Whether what these pictures are made with is on disk, compiled; the first use takes some seconds if not."""
    return any(Path(str(pointwise.calmed.stats.cache_path)).glob("kernel.calmed-*.nbi"))


def _percentile(level: np.ndarray, share: float | np.ndarray) -> np.ndarray:
    step = max(1, math.isqrt(level.size // _JUDGED))
    return np.percentile(level[::step, ::step], share)
