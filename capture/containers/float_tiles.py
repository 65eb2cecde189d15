"""The floats of a DNG's picture, which converters compress in ways that only RAW readers know (DNG 1.7.1, chapter 3).

Only their greatest is asked for: LibRaw reads the picture, but scales it by that.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from photogonio.capture.containers import tiff

PLAIN, DEFLATE = {1}, {8, 32946}
STRIDE = {3: 1, 34894: 2, 34895: 4}  # of the floating point predictors, in samples
TYPES = {16: "f2", 32: "f4"}


def brightest(path: Path, tags: tiff.Tags) -> float | None:
    """The greatest float of a directory's picture; None if it is stored in a way that is not known here.

    Whatever pads the last tiles is taken with it: writers fill them with the picture's own edge, or with 0.
    """
    bits = tags.get(tiff.BITS, (0,))[0]
    if bits not in TYPES or tags.get(tiff.COMPRESSION, (1,))[0] not in PLAIN | DEFLATE:
        return None
    greatest = -np.inf
    try:
        for floats in pieces(path, tags, TYPES[bits]):
            greatest = max(greatest, float(np.nanmax(floats, initial=-np.inf)))
    except (zlib.error, ValueError, OSError):
        return None
    return greatest if np.isfinite(greatest) else None


def misread(tags: tiff.Tags) -> bool:
    """Whether LibRaw undoes a predictor that is not there: floats, deflated, as they are."""
    floats, deflated = 3 in tags.get(tiff.FORMAT, ()), tags.get(tiff.COMPRESSION, (1,))[0] in DEFLATE
    return floats and deflated and tags.get(tiff.PREDICTOR, (1,))[0] not in STRIDE


def pieces(path: Path, tags: tiff.Tags, kind: str) -> Iterator[np.ndarray]:
    """The floats of each strip or tile."""
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
                yield np.frombuffer(data, order + kind)
            else:
                raise ValueError(f"predictor {predictor}")


def unpredicted(data: bytes, width: int, stride: int, kind: str) -> np.ndarray:
    """Rows of ``width`` floats whose bytes stand the highest first, each place for itself, as differences of bytes
    ``stride`` apart (Adobe Photoshop TIFF technical note 3)."""
    size = np.dtype(kind).itemsize
    rows = np.frombuffer(data, np.uint8).reshape(-1, width * size).copy()
    for first in range(stride):
        rows[:, first::stride] = np.cumsum(rows[:, first::stride], axis=1, dtype=np.uint8)
    apart = rows.reshape(-1, size, width).transpose(0, 2, 1)
    return np.ascontiguousarray(apart).view(">" + kind)[..., 0]
