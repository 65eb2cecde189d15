"""Pixels by OpenCV and OpenImageIO, exactly as a file stores them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio

from photogonio.capture.errors import InputError

INTEGERS = {"uint8": np.uint8, "uint16": np.uint16}
FLOATS = {"half", "float", "double"}
UNCHANGED = cv2.IMREAD_UNCHANGED
AS_RGB = cv2.IMREAD_COLOR_RGB | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION
BAND = 16  # rows at a time
UNREADABLE = "not a readable image"


@contextmanager
def open_oiio(path: Path, part: int = 0) -> Iterator[oiio.ImageInput]:
    """The file as OpenImageIO opens it, at one of its parts; InputError if it cannot."""
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)  # else colour is multiplied by alpha
    file = oiio.ImageInput.open(str(path), config)
    if file is None:
        raise InputError(path, f"{UNREADABLE}: {one_line(oiio.geterror())}")
    try:
        if part and not file.seek_subimage(part, 0):
            raise InputError(path, f"{UNREADABLE}: {one_line(file.geterror())}")
        yield file
    finally:
        file.close()


def attributes_of(spec: oiio.ImageSpec) -> dict[str, object]:
    """What a file says of itself; words that are no text are left out."""
    found: dict[str, object] = {}
    for k in range(len(spec.extra_attribs)):
        try:
            attribute = spec.extra_attribs[k]
            found[attribute.name] = attribute.value
        except UnicodeDecodeError:
            continue
    return found


def decode_opencv(data: bytes, channels: int) -> np.ndarray | None:
    """A file of one or three integer channels, in the order R, G, B; None if OpenCV cannot read it."""
    level = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), AS_RGB if channels == 3 else UNCHANGED)
    except cv2.error:
        return None
    finally:
        cv2.utils.logging.setLogLevel(level)
    return pixels[..., None] if pixels is not None and pixels.ndim == 2 else pixels


def load_opencv(path: Path) -> np.ndarray | None:
    """A TIFF file of one or three integer channels, in the order R, G, B; None if OpenCV cannot read it."""
    level = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        pixels = cv2.imread(str(path), UNCHANGED)
    except cv2.error:
        return None
    finally:
        cv2.utils.logging.setLogLevel(level)
    if pixels is None:
        return None
    if pixels.ndim == 2:
        return pixels[..., None]
    if pixels.shape[2] == 3:  # AS_RGB leaves TIFF of 16 bits unfilled (OpenCV 5.0.0)
        for band in np.array_split(pixels, max(1, len(pixels) // BAND)):  # no second picture in memory
            band[:] = cv2.cvtColor(band, cv2.COLOR_BGR2RGB)
    return pixels


def decode_oiio(path: Path, file: oiio.ImageInput, part: int = 0, kept: tuple[int, ...] = ()) -> np.ndarray:
    """Pixels (h, w, c) of an opened file's part, of the channels ``kept`` or of all."""
    spec = file.spec()
    kept = kept or tuple(range(spec.nchannels))
    first, end = min(kept), max(kept) + 1
    formats = spec.channelformats or (spec.format,) * spec.nchannels
    kinds = {str(formats[k]) for k in kept}
    for kind in sorted(kinds):
        if kind not in INTEGERS and kind not in FLOATS:
            raise InputError(path, f"pixels of type {kind}; expected 8 or 16 bit integers, or floats")
    kind = kinds.pop() if len(kinds) == 1 else "float"
    pixels = file.read_image(part, 0, first, end, kind if kind in INTEGERS or kind == "half" else "float")
    # libjpeg fills what is missing or no code with what came before, gives pixels all the same, and only says so
    if pixels is None or file.has_error:
        raise InputError(path, f"truncated or damaged: {said(file)}")
    return (
        pixels[..., [k - first for k in kept]]
        if len(kept) < end - first or kept != tuple(sorted(kept))
        else pixels
    )


def said(file: oiio.ImageInput) -> str:
    """What an opened file says of what went wrong, on one line; it may quote bytes of its own that are no text."""
    try:
        return one_line(file.geterror())
    except UnicodeDecodeError:
        return "its words of it are no text"


def one_line(message: str) -> str:
    return " ".join(message.split()) or "unknown format"
