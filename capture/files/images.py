"""Decodes photos, and reads their headers. Pixels stay as the file has them; nothing is turned upright.

PNG is read here; its rarer kinds, TIFF of 16 bits and AVIF go through OpenCV, which is faster; HEIC through libheif;
RAW through LibRaw; everything else through OpenImageIO. JPEG too: it decodes to the same pixels in the same time, and
tells what libjpeg says of damaged scans, which OpenCV keeps to itself.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rawpy

from photogonio.capture.containers import dng
from photogonio.capture.containers.integrity import fault
from photogonio.capture.containers.tone import LINEAR, Tone
from photogonio.capture.errors import InputError
from photogonio.capture.files import decode, heif, png_pixels, raw
from photogonio.capture.files.about import About, about
from photogonio.capture.files.exposure import Exposure, camera_name, flash_fired, from_attributes, optics
from photogonio.capture.files.formats import HEAD, format_of

EXPONENT = np.uint16(0x7C00)  # of a half float, all ones where it is not finite
WHOLE = {"png", "jpeg", "webp", "bmp"}  # formats whose files are looked over before they are decoded
RAW_TONE = Tone((LINEAR,), "camera RAW")


@dataclass(frozen=True, slots=True)
class Header:
    """What a file says of itself before its pixels are decoded."""

    size: tuple[int, int]  # width, height of the decoded image
    channels: tuple[str, ...]
    exposure: Exposure
    tone: Tone = RAW_TONE  # how its codes stand for light
    notes: tuple[str, ...] = ()  # how it is read, where that is not plain
    doubts: tuple[str, ...] = ()  # what a person should look at
    flash: bool | None = None  # whether one fired; None: not told
    camera: str = ""  # maker and model


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
    lossy: bool = False  # JPEG and its kin: values near the clipping level ring
    tone: Tone = RAW_TONE  # how its codes stand for light, as the file says


def read_header(path: Path, *, demosaic: str = "superpixel") -> Header:
    """Size, channels, exposure and tone curve of a photo, without its pixels. Raises InputError if it is no image."""
    kind = format_of(path)
    if kind == "raw":
        with open_raw(path) as file:
            channels = tuple(dict.fromkeys(file.color_desc.decode()))
            attributes, told = raw.attributes(file, path), dng.about(path)
            return Header(
                raw.size(file, demosaic),
                channels,
                from_attributes(attributes),
                notes=told.notes,
                doubts=told.doubts,
                flash=flash_fired(attributes),
                camera=camera_name(attributes),
            )
    found = about(path, kind)
    said = found.attributes
    return Header(
        found.size,
        found.channels,
        from_attributes(said),
        found.tone,
        found.notes,
        found.doubts,
        flash_fired(said),
        camera_name(said),
    )


def read_optics(path: Path) -> dict[str, str]:
    """What a photo's EXIF says of camera and lens. Raises InputError if it is no image."""
    kind = format_of(path)
    if kind != "raw":
        return optics(about(path, kind).attributes)
    with open_raw(path) as file:
        return optics(raw.attributes(file, path))


def read_image(path: Path, *, demosaic: str = "superpixel") -> Image:
    """The pixels of a photo.

    Raises InputError naming the file if it cannot be read, is cut short, or holds a pixel that is not finite.
    """
    kind = format_of(path)
    if kind == "raw":
        return read_raw(path, demosaic)
    data = read_bytes(path) if kind in WHOLE else None
    wrong = None if data is None else fault(data)
    if wrong:
        raise InputError(path, wrong)
    found = about(path, kind, data)
    packed = None if data is None or kind != "png" else png_pixels.packed(data)
    if packed is not None:
        data = None  # of a large photo, to hold the pixels and what they are made of is enough
    pixels = decoded(path, found, packed or data)
    width, height = found.size
    if pixels.shape != (height, width, len(found.channels)):
        raise InputError(path, f"decodes to {pixels.shape}, not to the size in its header")
    check_finite(path, pixels)
    full_scale = float((1 << found.bits) - 1) if pixels.dtype.kind == "u" else 1.0
    return Image(pixels, full_scale, found.channels, lossy=found.lossy, tone=found.tone)


def decoded(path: Path, found: About, held: png_pixels.Packed | bytes | None) -> np.ndarray:
    """Pixels (h, w, c) by the reader that fits what the file says of itself; ``held`` is what of it was read."""
    pixels = None
    if isinstance(held, png_pixels.Packed):
        pixels = held.pixels()
        if pixels is not None and len(found.kept) < pixels.shape[2]:
            pixels = pixels[..., list(found.kept)]
    elif found.reader == "opencv":
        channels = len(found.channels)
        pixels = decode.load_opencv(path) if held is None else decode.decode_opencv(held, channels)
    elif found.reader in ("heic", "avif"):
        try:
            return heif.decoded(path, found.reader, len(found.channels))
        except ValueError as error:
            raise InputError(path, str(error)) from error
    if pixels is None:
        with decode.open_oiio(path, found.part) as file:  # which says why OpenCV could not
            pixels = decode.decode_oiio(path, file, found.part, found.kept)
    return found.as_stored(pixels)


def read_raw(path: Path, demosaic: str) -> Image:
    with open_raw(path) as file:
        try:
            found = raw.pixels_of(file, demosaic, dng.about(path))
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
        with rawpy.imread(str(path)) as file:
            yield file
    except rawpy.LibRawError as error:
        reason = error.args[0].decode() if error.args and isinstance(error.args[0], bytes) else str(error)
        raise InputError(path, f"{decode.UNREADABLE}: {reason}") from error


def check_finite(path: Path, pixels: np.ndarray) -> None:
    if pixels.dtype.kind == "f" and not all_finite(pixels):
        y, x, _ = np.argwhere(~np.isfinite(pixels))[0]
        raise InputError(path, f"a pixel is not finite, first at x {x}, y {y}")


def all_finite(pixels: np.ndarray) -> bool:
    if pixels.dtype != np.float16:
        return bool(np.isfinite(pixels).all())
    bits = pixels.view(np.uint16) & EXPONENT  # numpy takes half floats one by one
    return bool(bits.max(initial=0) < EXPONENT)


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
    if not path.is_file():  # a pipe would be waited for
        return None
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
