"""Decodes photos, and reads their headers. Pixels stay as the file has them; nothing is turned upright.

PNG, TIFF and JPEG of one or three integer channels go through OpenCV, which is faster; everything else, and
all headers, through OpenImageIO; RAW through LibRaw.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio
import rawpy
from photogonio.capture.errors import InputError
from photogonio.capture.files import raw as raws
from photogonio.capture.files.exposure import Exposure, from_attributes
from photogonio.capture.files.integrity import fault

STANDARD = {".png", ".tif", ".tiff", ".jpg", ".jpeg", ".exr"}
JPEG = {".jpg", ".jpeg"}
INTEGERS = {"uint8": np.uint8, "uint16": np.uint16}
FLOATS = {"half", "float", "double"}
UNCHANGED = cv2.IMREAD_UNCHANGED
AS_RGB = cv2.IMREAD_COLOR_RGB | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION
HEAD = 4096  # bytes at a file's start that tell most files apart
FULL_SCALE = {
    np.dtype(np.uint8): 255.0,
    np.dtype(np.uint16): 65535.0,
    np.dtype(np.float16): 1.0,
    np.dtype(np.float32): 1.0,
}
EXPONENT = np.uint16(0x7C00)  # of a half float, all ones where it is not finite


@dataclass(frozen=True, slots=True)
class Header:
    """What a file says of itself before its pixels are decoded."""

    size: tuple[int, int]  # width, height of the decoded image
    channels: tuple[str, ...]
    exposure: Exposure


@dataclass(frozen=True, slots=True)
class Image:
    """Decoded pixels in the order R, G, B; integers and half floats are kept, other numbers become float32."""

    pixels: np.ndarray  # (h, w, c) uint8, uint16, float16 or float32
    full_scale: float  # the pixel value that counts as 1
    channels: tuple[str, ...]
    raw: bool = False  # pixels are above the file's black level, full_scale is its white level above that
    black: float = 0.0  # that black level, in units of the pixels
    saturated: np.ndarray | None = None  # (h, w) bool, where the decoder knows (RAW)
    sites: tuple[int, ...] = ()  # RAW superpixels: sensor sites averaged in each channel
    lossy: bool = False  # JPEG: values near the clipping level ring


def read_header(path: Path, *, demosaic: str = "superpixel") -> Header:
    """Size, channels and exposure of a photo, without its pixels. Raises InputError if it is no image."""
    if path.suffix.lower() not in STANDARD:
        with open_raw(path) as raw:
            channels = tuple(dict.fromkeys(raw.color_desc.decode()))
            return Header(raws.size(raw, demosaic), channels, from_attributes(raws.exif(raw)))
    with open_oiio(path) as file:
        spec = file.spec()
        attributes = {attribute.name: attribute.value for attribute in spec.extra_attribs}
        names = [spec.channelnames[k] for k in colour_channels(spec)]
        return Header((spec.width, spec.height), tuple(names), from_attributes(attributes))


def read_image(path: Path, *, demosaic: str = "superpixel") -> Image:
    """The pixels of a photo.

    Raises InputError naming the file if it cannot be read, is cut short, or holds a pixel that is not finite.
    """
    suffix = path.suffix.lower()
    if suffix not in STANDARD:
        return read_raw(path, demosaic)
    data = read_bytes(path) if suffix == ".png" or suffix in JPEG else None
    wrong = None if data is None else fault(data)
    if wrong:
        raise InputError(path, wrong)
    with open_oiio(path) as file:
        spec = file.spec()
        kept = colour_channels(spec)
        if str(spec.format) in INTEGERS and spec.nchannels in (1, 3) and suffix != ".exr":
            pixels = decode_opencv(path, data, spec.nchannels)
        else:
            pixels = decode_oiio(path, file)[..., kept]
    if pixels.shape != (spec.height, spec.width, len(kept)):
        raise InputError(path, f"decodes to {pixels.shape}, not to the size in its header")
    check_finite(path, pixels)
    channels = tuple(spec.channelnames[k] for k in kept)
    return Image(pixels, FULL_SCALE[pixels.dtype], channels, lossy=suffix in JPEG)


def read_raw(path: Path, demosaic: str) -> Image:
    with open_raw(path) as raw:
        try:
            found = raws.superpixels(raw) if demosaic == "superpixel" else raws.demosaiced(raw, demosaic)
        except ValueError as error:
            raise InputError(path, str(error)) from error
        return Image(
            found.pixels,
            found.white,
            found.channels,
            raw=True,
            black=found.black,
            saturated=found.saturated,
            sites=found.sites,
        )


@contextmanager
def open_raw(path: Path) -> Iterator[rawpy.RawPy]:
    """The file as LibRaw opens it; whatever LibRaw cannot do with it is an InputError."""
    try:
        with rawpy.imread(str(path)) as raw:
            yield raw
    except rawpy.LibRawError as error:
        reason = error.args[0].decode() if error.args and isinstance(error.args[0], bytes) else str(error)
        raise InputError(path, f"not a readable image: {reason}") from error


@contextmanager
def open_oiio(path: Path) -> Iterator[oiio.ImageInput]:
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)  # else colour is multiplied by alpha
    file = oiio.ImageInput.open(str(path), config)
    if file is None:
        raise InputError(path, f"not a readable image: {one_line(oiio.geterror())}")
    try:
        yield file
    finally:
        file.close()


def colour_channels(spec: oiio.ImageSpec) -> list[int]:
    """Every channel but alpha and depth."""
    return [k for k in range(spec.nchannels) if k not in (spec.alpha_channel, spec.z_channel)]


def decode_opencv(path: Path, data: bytes | None, channels: int) -> np.ndarray:
    """A file of one or three channels, or its ``data``: PNG and JPEG, which OpenCV can give in the order R, G, B."""
    level = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        if data is None:
            pixels = cv2.imread(str(path), UNCHANGED)
        else:
            pixels = cv2.imdecode(np.frombuffer(data, np.uint8), AS_RGB if channels == 3 else UNCHANGED)
    finally:
        cv2.utils.logging.setLogLevel(level)
    if pixels is None:
        with open_oiio(path) as file:  # which says why
            return decode_oiio(path, file)
    if pixels.ndim == 2:
        return pixels[..., None]
    swap = data is None and pixels.shape[2] == 3
    return cv2.cvtColor(pixels, cv2.COLOR_BGR2RGB) if swap else pixels


def decode_oiio(path: Path, file: oiio.ImageInput) -> np.ndarray:
    kind = str(file.spec().format)
    if kind not in INTEGERS and kind not in FLOATS:
        raise InputError(path, f"pixels of type {kind}; expected 8 or 16 bit integers, or floats")
    pixels = file.read_image(kind if kind in INTEGERS or kind == "half" else "float")
    if pixels is None:
        raise InputError(path, f"truncated or damaged: {one_line(file.geterror())}")
    return pixels


def check_finite(path: Path, pixels: np.ndarray) -> None:
    if pixels.dtype.kind == "f" and not all_finite(pixels):
        y, x, _ = np.argwhere(~np.isfinite(pixels))[0]
        raise InputError(path, f"a pixel is not finite, first at x {x}, y {y}")


def all_finite(pixels: np.ndarray) -> bool:
    if pixels.dtype != np.float16:
        return bool(np.isfinite(pixels).all())
    bits = pixels.view(np.uint16) & EXPONENT  # numpy takes half floats one by one
    return int(bits.max(initial=0)) < EXPONENT


def copies(folder: Path, names: Sequence[str]) -> dict[str, str]:
    """Files of the same bytes as an earlier one, and that one; files that cannot be read are nobody's copies."""
    starts = {name: start for name in names if (start := _start(folder / name)) is not None}
    often = Counter(starts.values())
    first: dict[bytes, str] = {}
    found = {}
    for name, start in starts.items():
        if often[start] > 1:  # only then is the whole file worth reading
            with (folder / name).open("rb") as file:
                digest = hashlib.file_digest(file, "sha256").digest()
            if first.setdefault(digest, name) != name:
                found[name] = first[digest]
    return found


def _start(path: Path) -> tuple[int, bytes] | None:
    """A file's size and first bytes; None if it cannot be read."""
    try:
        with path.open("rb") as file:
            return path.stat().st_size, file.read(HEAD)
    except OSError:
        return None


def read_bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}") from error


def one_line(message: str) -> str:
    return " ".join(message.split()) or "unknown format"
