"""The code at which a sensor's pixels are full, which is often below the file's full scale."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

JPEG_RINGING = 3  # codes of 8 bits by which a clipped area wavers after compression
LEAST_FULL = 0.5  # of full scale: no sensor is read out lower
LEAST_PIXELS = 8  # at the top code of a photo, to count as a pile
PILE = 20.0  # times as many pixels in the top code as in the codes just below it
NEAR = 0.97  # of the top code: what "just below" means


def padded_top(pixels: np.ndarray, full_scale: float) -> float:
    """The highest code that padded integers can take: 65532 for 14 bits shifted up to 16."""
    if pixels.dtype.kind != "u":
        return np.inf
    used = int(np.bitwise_or.reduce(pixels, axis=None))
    step = used & -used if used else 1
    return float(int(full_scale) // step * step)


def pile(pixels: np.ndarray) -> tuple[float, bool]:
    """The highest code of a photo, and whether clipping has piled pixels up in it."""
    top = float(pixels.max())
    count = int((pixels == top).sum())
    below = pixels[(pixels >= NEAR * top) & (pixels < top)]
    density = below.size / len(np.unique(below)) if below.size else 0.0
    return top, count >= LEAST_PIXELS and count > PILE * density


def clip_code(photos: Sequence[np.ndarray], full_scale: float, *, lossy: bool = False) -> float:
    """The code (..., in file units) at and above which a pixel is full, from several photos of one camera.

    The padding of the integers says where full scale really is; a pile of pixels in one and the same top
    code of two photos or more says that the sensor is full there. Infinite for floats that show no such
    pile.
    """
    tops = [padded_top(pixels, full_scale) for pixels in photos]
    # a dark photo can miss low bits by chance, never set them
    ceiling = max(tops)
    found = [pile(pixels) for pixels in photos]
    top = max(code for code, _ in found)
    piled = sum(1 for code, clipped in found if clipped and code == top)
    if piled >= 2 and top >= LEAST_FULL * full_scale:
        ceiling = min(ceiling, top)
    return ceiling - (JPEG_RINGING * full_scale / 255 if lossy else 0)
