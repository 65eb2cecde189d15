"""HEIC and AVIF: HEIC's pixels by libheif (pillow-heif), AVIF's by OpenCV, since that libheif has no AV1.

libheif turns and mirrors a picture as the file asks; that is undone here, so that pixels stay as the sensor has them,
as in every other format. OpenCV leaves them as they are.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogonio.capture.containers import exif, icc
from photogonio.capture.containers.boxes import turns
from photogonio.capture.containers.tone import Tone, of_cicp
from photogonio.capture.files.decode import decode_opencv

if TYPE_CHECKING:
    import pillow_heif

UNREADABLE = (ValueError, EOFError, SyntaxError, RuntimeError, OSError, IndexError)


def size_of(path: Path, file: pillow_heif.HeifFile) -> tuple[int, int]:
    """Width and height as stored."""
    width, height = file.size
    quarters = sum(count for kind, count in turns(path.read_bytes()) if kind == "irot")
    return (height, width) if quarters % 2 else (width, height)


def channels_of(file: pillow_heif.HeifFile) -> tuple[str, ...]:
    return ("Y",) if file.mode.startswith("L") else ("R", "G", "B")


def attributes_of(file: pillow_heif.HeifFile) -> dict[str, object]:
    """EXIF's, without the orientation: a viewer goes by the file's own turns."""
    found = exif.attributes(file.info.get("exif") or b"")
    return {name: value for name, value in found.items() if name != "Orientation"}


def has_gain_map(file: pillow_heif.HeifFile) -> bool:
    return any("gainmap" in str(name).lower() for name in file.info.get("aux", {}))


def tone_of(file: pillow_heif.HeifFile) -> Tone | None:
    profile, colour = file.info.get("icc_profile"), file.info.get("nclx_profile")
    if profile:
        return icc.tone_of(profile)
    return of_cicp(int(colour["transfer_characteristics"]), "nclx colour box") if colour else None


def opened(path: Path) -> pillow_heif.HeifFile:
    import pillow_heif  # with all of Pillow's plugins: of other formats nothing needs it

    try:
        file = pillow_heif.open_heif(str(path), convert_hdr_to_8bit=False, hdr_to_16bit=False)
        if len(file) == 0:
            raise ValueError("it holds no picture")
        return file
    except UNREADABLE as error:
        raise ValueError(f"truncated or damaged: {' '.join(str(error).split())}") from error


def decoded(path: Path, reader: str, channels: int) -> np.ndarray:
    """Pixels (h, w, c) of a HEIC or AVIF file, codes of its own bit depth. Raises ValueError if it cannot be read."""
    return decode_heic(path) if reader == "heic" else decode_avif(path, channels)


def decode_heic(path: Path) -> np.ndarray:
    """Pixels (h, w, c) of a HEIC file, codes of its own bit depth. Raises ValueError if it cannot be read."""
    file = opened(path)
    try:
        pixels = np.asarray(file)
    except UNREADABLE as error:
        raise ValueError(f"truncated or damaged: {' '.join(str(error).split())}") from error
    pixels = pixels[..., None] if pixels.ndim == 2 else pixels
    pixels = pixels[..., : 1 if pixels.shape[2] < 3 else 3]  # without alpha
    for kind, amount in reversed(turns(path.read_bytes())):
        pixels = np.rot90(pixels, -amount) if kind == "irot" else np.flip(pixels, axis=amount)
    return np.ascontiguousarray(pixels)


def decode_avif(path: Path, channels: int) -> np.ndarray:
    """Likewise of an AVIF file."""
    pixels = decode_opencv(path.read_bytes(), channels)
    if pixels is None:
        raise ValueError("truncated or damaged, or this OpenCV was built without AVIF")
    return pixels
