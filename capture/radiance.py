"""Linear radiance, its variance and its validity, from decoded photos.

Radiance is in fractions of the sensor's full scale per second at ISO 100 and f/1 wherever exposure time, ISO
and f-number are known; a quantity no photo of the set gives counts as 1 in all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class RadianceImage:
    """Linear radiance of one view."""

    value: np.ndarray  # (h, w, c) float32
    variance: np.ndarray  # (h, w, c) float32, of photon, read and quantisation noise
    valid: np.ndarray  # (h, w) bool: no channel saturated, at or below black beyond noise, hot or non-finite
    saturated: np.ndarray  # (h, w) bool: some channel at or above the white level in every exposure
