"""Linear radiance, its variance and its validity.

Radiance is in fractions of the sensor's full scale per second at ISO 100 and f/1 wherever exposure time, ISO
and f-number are known; a quantity no photo of the set gives counts as 1 in all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SEEN = 5.0  # standard deviations above black at which a pixel holds light
LEAST_SHARE = 0.01  # of a region's pixels that must be usable


@dataclass(frozen=True, slots=True)
class RadianceImage:
    """Linear radiance of one view, or of a region of it."""

    value: np.ndarray  # (h, w, c) float32
    variance: np.ndarray  # (h, w, c) float32, of photon, read and quantisation noise
    valid: np.ndarray  # (h, w) bool: no channel saturated, at or below black beyond noise, hot or non-finite
    saturated: np.ndarray  # (h, w) bool: some channel at or above the white level in every exposure
    origin: tuple[int, int] = (0, 0)  # x, y in the photo of the first pixel
    ghost: np.ndarray | None = None  # (h, w) bool: the exposures of a bracket disagree; not valid


def exposure_fault(image: RadianceImage, region: np.ndarray | None = None) -> str | None:
    """Why a photo's exposure makes a region (mask, or slices; all of it if None) useless; None if it does
    not.
    """
    part = np.s_[:, :] if region is None else region
    saturated, value, variance = image.saturated[part], image.value[part], image.variance[part]
    if saturated.size == 0:
        return None
    if 1.0 - saturated.mean() < LEAST_SHARE:
        return "every pixel of the sample is saturated"
    if (value > SEEN * np.sqrt(variance)).any(axis=-1).mean() < LEAST_SHARE:
        return "every pixel of the sample is black"
    return None
