"""Linear DNG (Adobe's specification 1.4) as telephones and converters write it: nothing is left to demosaic."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np

Entry = tuple[int, int, Sequence[int]]  # tag, type, values; a rational is two of them

_BYTE, _ASCII, _SHORT, _LONG, _RATIONAL, _SIGNED_RATIONAL = 1, 2, 3, 4, 5, 10
_FORM = {
    _BYTE: ("B", 1),
    _ASCII: ("B", 1),
    _SHORT: ("H", 2),
    _LONG: ("I", 4),
    _RATIONAL: ("I", 8),
    _SIGNED_RATIONAL: ("i", 8),
}
_LINEAR_RAW = 34892
_EXIF = 0x8769
# XYZ to the camera's channels, which are linear sRGB's
_FROM_XYZ = (
    3.2404542,
    -1.5371385,
    -0.4985314,
    -0.969266,
    1.8760108,
    0.041556,
    0.0556434,
    -0.2040259,
    1.0572252,
)


def write_dng(path: Path, photo: np.ndarray, black: int, exif: Sequence[Entry]) -> None:
    """Writes ``photo`` (h, w, 3), uint16, whose code ``black`` is no light and 65535 full scale, with the entries
    ``exif`` of its EXIF directory. Raises OSError."""
    height, width, channels = photo.shape
    pixels = np.ascontiguousarray(photo, "<u2").tobytes()

    def picture(start: int, inner: int) -> list[Entry]:
        return [
            (254, _LONG, [0]), (256, _LONG, [width]), (257, _LONG, [height]), (258, _SHORT, [16] * channels),
            (259, _SHORT, [1]), (262, _SHORT, [_LINEAR_RAW]), (271, _ASCII, list(b"photogonio\0")),
            (272, _ASCII, list(b"synthetic phone\0")), (273, _LONG, [start]), (274, _SHORT, [1]),
            (277, _SHORT, [channels]), (278, _LONG, [height]), (279, _LONG, [len(pixels)]), (284, _SHORT, [1]),
            (_EXIF, _LONG, [inner]), (50706, _BYTE, [1, 4, 0, 0]), (50708, _ASCII, list(b"synthetic phone\0")),
            (50714, _LONG, [black] * channels), (50717, _LONG, [65535] * channels),
            (50721, _SIGNED_RATIONAL, _parts(_FROM_XYZ)), (50728, _RATIONAL, _parts((1.0, 1.0, 1.0))),
            (50778, _SHORT, [21]),
        ]  # fmt: skip

    inner = 8 + len(_directory(picture(0, 0), 8))
    start = inner + len(_directory(exif, inner))
    head = struct.pack("<2sHI", b"II", 42, 8) + _directory(picture(start, inner), 8) + _directory(exif, inner)
    path.write_bytes(head + pixels)


def rational(tag: int, value: float) -> Entry:
    """An entry of one number, 0 or more."""
    nearest = Fraction(value).limit_denominator(1_000_000)
    return tag, _RATIONAL, [nearest.numerator, nearest.denominator]


def short(tag: int, value: int) -> Entry:
    """An entry of one whole number below 65536."""
    return tag, _SHORT, [value]


def _parts(values: Sequence[float]) -> list[int]:
    return [part for value in values for part in (round(value * 1e6), 1_000_000)]


def _directory(entries: Sequence[Entry], place: int) -> bytes:
    """A directory that stands at ``place``, with no other after it and its longer values behind it."""
    size = 2 + 12 * len(entries) + 4
    table, values = struct.pack("<H", len(entries)), b""
    for tag, kind, numbers in sorted(entries):
        form, length = _FORM[kind]
        content = struct.pack(f"<{len(numbers)}{form}", *numbers)
        table += struct.pack("<HHI", tag, kind, len(content) // length)
        if len(content) > 4:
            table += struct.pack("<I", place + size + len(values))
            values += content + bytes(len(content) % 2)
        else:
            table += content.ljust(4, b"\0")
    return table + bytes(4) + values
