"""EXIF as it stands in HEIC, AVIF and JPEG XL files, under the names that OpenImageIO gives to that of others."""

from __future__ import annotations

import math
import struct
import warnings

from PIL import Image

START = b"Exif\0\0"
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
    0xA001: "Exif:ColorSpace",
}


def attributes(data: bytes) -> dict[str, object]:
    """Exposure, orientation and colour space of a block of EXIF data; what cannot be read is absent."""
    found = Image.Exif()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found.load(data.removeprefix(START))
            inner, index = found.get_ifd(EXIF_DIRECTORY), found.get_ifd(INTEROPERABILITY)
    except (
        SyntaxError,
        ValueError,
        KeyError,
        TypeError,
        IndexError,
        struct.error,
        OSError,
        ZeroDivisionError,
    ):
        return {}
    values = {name: plain(inner[tag]) for tag, name in NAMES.items() if tag in inner}
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
