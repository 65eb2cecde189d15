"""What a JPEG file's marker segments say (ITU T.81, annex B)."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}
APP1, APP2, SCAN, END = 0xE1, 0xE2, 0xDA, 0xD9
EXIF = b"Exif\0\0"
BARE = {0x01, *range(0xD0, 0xD9)}  # markers without a length
GAIN_MAP = (b"http://ns.adobe.com/hdr-gain-map/", b"urn:iso:std:iso:ts:21496")  # Ultra HDR, ISO 21496-1


@dataclass(frozen=True, slots=True)
class JpegHeader:
    size: tuple[int, int]  # width, height
    components: int
    gain_map: bool
    exif: bytes


def about(path: Path) -> JpegHeader:
    """Raises ValueError, saying why, if the file has no frame or one of colours that are not read."""
    frame, gain_map, exif = None, False, b""
    with path.open("rb") as file:
        for marker, content in segments(file):
            if marker in FRAMES and frame is None and len(content) >= 6:
                frame = struct.unpack_from(">BHHB", content)
            elif marker in (APP1, APP2):
                exif = exif or (content if content.startswith(EXIF) else b"")
                gain_map = gain_map or any(name in content for name in GAIN_MAP)
    if frame is None:
        raise ValueError("truncated JPEG: it has no frame")
    bits, height, width, components = frame
    if bits != 8:
        raise ValueError(f"is a JPEG of {bits} bits; expected 8")
    if components not in (1, 3):
        colours = "CMYK" if components == 4 else f"{components} components"
        raise ValueError(f"holds {colours}; expected gray or RGB")
    return JpegHeader((width, height), components, gain_map, exif)


def segments(file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Markers and their contents up to the first scan."""
    file.seek(2)
    while len(head := file.read(2)) == 2 and head[0] == 0xFF:
        marker = head[1]
        if marker == 0xFF:  # padding
            file.seek(-1, 1)
        elif marker in (SCAN, END):
            return
        elif marker not in BARE:
            size = int.from_bytes(file.read(2), "big")
            yield marker, file.read(max(size - 2, 0))
