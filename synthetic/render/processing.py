"""What a telephone does between its sensor and its file, besides the tone curve."""

from __future__ import annotations

import cv2
import numpy as np

from photogonio.synthetic.scene.phone import Denoise, LocalTone, Sharpen

LEAST = 1e-3  # light below which the surroundings are no darker


def local_gain(tone: LocalTone, signal: np.ndarray) -> np.ndarray:
    """Gain (h, w) of each pixel of linear ``signal`` (h, w, c) by the brightness round about it."""
    height, width = signal.shape[:2]
    reach = tone.reach * float(np.hypot(height, width))
    around = cv2.GaussianBlur(np.clip(signal, 0.0, 1.0).mean(axis=-1), (0, 0), reach)
    around = np.maximum(around, LEAST)
    return (around / np.median(around)) ** -tone.strength


def finished(code: np.ndarray, denoise: Denoise | None, sharpen: Sharpen | None) -> np.ndarray:
    """Codes (h, w, c), full scale 1, without noise and sharper; still from 0 to 1."""
    shape = code.shape
    if denoise is not None:
        plain = np.ascontiguousarray(code, np.float32)
        diameter = 2 * int(np.ceil(2.0 * denoise.radius)) + 1
        code = cv2.bilateralFilter(plain, diameter, denoise.code, denoise.radius).reshape(shape).astype(float)
    if sharpen is not None:
        blurred = cv2.GaussianBlur(code, (0, 0), sharpen.radius, borderType=cv2.BORDER_REFLECT_101)
        code = code + sharpen.amount * (code - blurred.reshape(shape))
    return np.clip(code, 0.0, 1.0)
