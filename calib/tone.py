"""Pictures fit for detection: from linear, often dark, radiance to an even 8-bit gray."""

from __future__ import annotations

import cv2
import numpy as np

from capture.radiance import RadianceImage

_BRIGHT = 98.0  # percentile taken as white: highlights and a white patch should not darken the board


def gray(image: RadianceImage) -> np.ndarray:
    """Mean of the channels, (h, w) float32, non-finite pixels as 0."""
    value = image.value.mean(axis=2, dtype=np.float32)
    return np.nan_to_num(value, nan=0.0, posinf=0.0, neginf=0.0)


def without_fireflies(level: np.ndarray) -> np.ndarray:
    """Single bright pixels replaced by the median around them, (h, w) float32."""
    middle = cv2.medianBlur(level.astype(np.float32), 3)
    return np.where(level > 4 * middle + 1e-3 * float(np.percentile(level, 99)), middle, level)


def detection_image(level: np.ndarray) -> np.ndarray:
    """8-bit picture for the marker search of linear gray (h, w): white at the bright percentile, square-root tone."""
    white = float(np.percentile(level, _BRIGHT)) or 1.0
    return (np.sqrt(np.clip(level / white, 0.0, 1.0)) * 255).astype(np.uint8)


def fine_image(level: np.ndarray) -> np.ndarray:
    """Linear gray scaled to [0, 1] for sub-pixel work, (h, w) float32."""
    white = float(np.percentile(level, 99.5)) or 1.0
    return np.clip(level / white, 0.0, 1.0).astype(np.float32)
