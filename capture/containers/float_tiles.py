"""The floats of a DNG's picture, which converters compress in ways that only RAW readers know (DNG 1.7.1, chapter 3).

LibRaw makes integers of them: it scales by the brightest, and cuts off what is below 0 and what is not finite.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from photogonio.capture.containers import tiff

PLAIN, DEFLATE = {1}, {8, 32946}
STRIDE = {3: 1, 34894: 2, 34895: 4}  # of the floating point predictors, in samples
TYPES = {16: "f2", 24: "f3", 32: "f4"}


def picture(path: Path, tags: tiff.Tags) -> np.ndarray | None:
    """The picture (h, w, samples) float32 of a directory, as the file has it; None if it is stored in a way that is not
    known here."""
    bits = set(tags.get(tiff.BITS, (0,)))
    if (
        len(bits) != 1
        or not bits <= TYPES.keys()
        or tags.get(tiff.COMPRESSION, (1,))[0] not in PLAIN | DEFLATE
    ):
        return None
    try:
        return _picture(path, tags, TYPES[bits.pop()])
    except (zlib.error, ValueError, OSError, KeyError):
        return None


def _picture(path: Path, tags: tiff.Tags, kind: str) -> np.ndarray:
    (width,), (height,) = tags[tiff.WIDTH], tags[tiff.HEIGHT]
    samples = tags.get(tiff.SAMPLES, (1,))[0]
    planes = samples if tags.get(tiff.PLANAR, (1,)) == (2,) else 1
    each = samples // planes  # samples of a pixel that stand together
    wide = tags[tiff.TILE_WIDTH][0] if tiff.TILE_PLACES in tags else width
    across = -(-width // wide)
    whole = np.full((planes, height, width, each), np.nan, np.float32)
    plane, top, left = 0, 0, 0
    for floats in pieces(path, tags, kind):
        piece = floats.reshape(-1, wide, each)[: height - top, : width - left]
        whole[plane, top : top + len(piece), left : left + piece.shape[1]] = piece
        left += wide
        if left >= across * wide:
            left, top = 0, top + len(floats) // (wide * each)
        if top >= height:
            plane, top = plane + 1, 0
    if (plane, top) != (planes, 0):
        raise ValueError("ends early")
    return np.moveaxis(whole, 0, 2).reshape(height, width, samples)


def pieces(path: Path, tags: tiff.Tags, kind: str) -> Iterator[np.ndarray]:
    """The floats of each strip or tile, (n,)."""
    tiled = tiff.TILE_PLACES in tags
    places = tags[tiff.TILE_PLACES if tiled else tiff.STRIP_PLACES]
    sizes = tags[tiff.TILE_SIZES if tiled else tiff.STRIP_SIZES]
    samples = 1 if tags.get(tiff.PLANAR, (1,)) == (2,) else tags.get(tiff.SAMPLES, (1,))[0]
    width = tags[tiff.TILE_WIDTH if tiled else tiff.WIDTH][0] * samples
    predictor = tags.get(tiff.PREDICTOR, (1,))[0]
    with path.open("rb") as file:
        order = "<" if file.read(2) == b"II" else ">"
        for place, size in zip(places, sizes, strict=True):
            file.seek(place)
            data = file.read(size)
            if tags.get(tiff.COMPRESSION, (1,))[0] in DEFLATE:
                data = zlib.decompress(data)
            if predictor in STRIDE:
                yield unpredicted(data, width, STRIDE[predictor] * samples, kind)
            elif predictor == 1:
                yield floats_of(data, kind, order)
            else:
                raise ValueError(f"predictor {predictor}")


def unpredicted(data: bytes, width: int, stride: int, kind: str) -> np.ndarray:
    """Rows of ``width`` floats whose bytes stand the highest first, each place for itself, as differences of bytes
    ``stride`` apart (Adobe Photoshop TIFF technical note 3)."""
    size = int(kind[1:])
    rows = np.frombuffer(data, np.uint8).reshape(-1, width * size).copy()
    for first in range(stride):
        rows[:, first::stride] = np.cumsum(rows[:, first::stride], axis=1, dtype=np.uint8)
    apart = rows.reshape(-1, size, width).transpose(0, 2, 1)
    return floats_of(np.ascontiguousarray(apart).tobytes(), kind, ">")


def floats_of(data: bytes, kind: str, order: str) -> np.ndarray:
    """(n,) of their bytes in this order."""
    if kind != "f3":
        return np.frombuffer(data, order + kind)
    parts = np.frombuffer(data, np.uint8).reshape(-1, 3)[:, :: 1 if order == ">" else -1].astype(np.uint32)
    code = (parts[:, 0] << 16) | (parts[:, 1] << 8) | parts[:, 2]
    # a sign, 7 bits of exponent (63 is 1), 16 of mantissa
    exponent, mantissa = ((code >> 16) & 127).astype(int), (code & 0xFFFF) / 65536
    value = np.where(exponent > 0, np.ldexp(1 + mantissa, exponent - 63), np.ldexp(mantissa, -62))
    value = np.where(exponent == 127, np.where(mantissa > 0, np.nan, np.inf), value)
    return np.where(code >> 23, -value, value).astype(np.float32)
