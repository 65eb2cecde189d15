"""Small pictures in the formats of phones and browsers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pillow_heif

from photogonio.capture.files.images import read_header, read_image

ADOBE = 563 / 256
HEIGHT, WIDTH = 48, 64


def smooth(kind: type = np.uint8) -> np.ndarray:
    """No side of it like another, no two channels alike, and nothing in it that compression minds."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] / WIDTH
    light = np.stack([0.2 + 0.6 * x, 0.2 + 0.6 * y, 0.7 - 0.3 * x - 0.2 * y], axis=-1)
    return np.round(light * np.iinfo(kind).max).astype(kind)


def heic(path: Path, pixels: np.ndarray, bits: int = 8, **more: object) -> Path:
    mode = "L" if pixels.shape[2] == 1 else "RGB"
    data = pixels if bits == 8 else pixels << (16 - bits)
    file = pillow_heif.from_bytes(mode + (";16" if bits > 8 else ""), pixels.shape[1::-1], data.tobytes())
    file.save(path, quality=100, chroma=444, **more)
    return path


def near(path: Path, written: np.ndarray, codes: float) -> bool:
    image, header = read_image(path), read_header(path)
    assert header.size == image.pixels.shape[1::-1] == written.shape[1::-1] and header.tone == image.tone
    assert image.channels == header.channels and image.pixels.dtype == written.dtype
    return bool(np.abs(image.pixels.astype(int) - written).max() <= codes)
