"""EXIF as it stands in HEIC, AVIF and JPEG XL files, under the names that OpenImageIO gives to that of others."""

from __future__ import annotations

import math
import struct
import warnings
from collections.abc import Callable
from pathlib import Path

from PIL import Image

UNREADABLE = (
    SyntaxError,
    ValueError,
    KeyError,
    TypeError,
    IndexError,
    struct.error,
    OSError,
    ZeroDivisionError,
)
START = b"Exif\0\0"
CAMERA = {0x010F: "Make", 0x0110: "Model"}
EXIF_DIRECTORY, INTEROPERABILITY = 0x8769, 0xA005
NAMES = {
    0x829A: "ExposureTime",
    0x829D: "FNumber",
    0x8827: "Exif:PhotographicSensitivity",
    0x8830: "Exif:SensitivityType",
    0x8831: "Exif:StandardOutputSensitivity",
    0x8832: "Exif:RecommendedExposureIndex",
    0x8833: "Exif:ISOSpeed",
    0x9201: "Exif:ShutterSpeedValue",
    0x9202: "Exif:ApertureValue",
    0x9209: "Exif:Flash",
    0xA001: "Exif:ColorSpace",
    0x920A: "Exif:FocalLength",
    0xA404: "Exif:DigitalZoomRatio",
    0xA431: "Exif:BodySerialNumber",
    0xA434: "Exif:LensModel",
}


def attributes(data: bytes) -> dict[str, object]:
    """Exposure, camera, orientation and colour space of a block of EXIF data; what cannot be read is absent."""
    found = Image.Exif()
    return _attributes(found, lambda: found.load(data.removeprefix(START)))


def of_file(path: Path) -> dict[str, object]:
    """Likewise of a file that is laid out as a TIFF, such as most camera RAW; nothing of others."""
    with path.open("rb") as file:
        if file.read(4) not in (b"II*\0", b"MM\0*"):
            return {}
        file.seek(0)
        found = Image.Exif()
        return _attributes(found, lambda: found.load_from_fp(file))


def _attributes(found: Image.Exif, load: Callable[[], None]) -> dict[str, object]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            load()
            inner, index = found.get_ifd(EXIF_DIRECTORY), found.get_ifd(INTEROPERABILITY)
    except UNREADABLE:
        return {}
    values = {name: plain(inner[tag]) for tag, name in NAMES.items() if tag in inner}
    values |= {name: plain(found[tag]) for tag, name in CAMERA.items() if tag in found}
    if 274 in found:
        values["Orientation"] = plain(found[274])
    if 1 in index:
        values["Exif:InteroperabilityIndex"] = str(index[1])
    return values


def plain(value: object) -> object:
    """A rational as a float."""
    if isinstance(value, (int, str, bytes, tuple)):
        return value
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, ZeroDivisionError):
        return math.nan
