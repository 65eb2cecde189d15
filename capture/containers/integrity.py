"""Is a photo's file whole? Decoders fill what is missing of a PNG or JPEG with gray and say nothing."""

from __future__ import annotations

import re
import struct

import deflate

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
JPEG_START = b"\xff\xd8"
JPEG_BARE = {0x01, *range(0xD0, 0xD9)}  # markers without a length
JPEG_SCAN, JPEG_END = 0xDA, 0xD9
AFTER_SCAN = re.compile(rb"\xff[^\x00\xd0-\xd7]", re.DOTALL)


def fault(data: bytes) -> str | None:
    """What is wrong with the structure of a PNG or JPEG file; None if nothing is, or for other formats."""
    if not data:
        return "empty file"
    if data.startswith(PNG_SIGNATURE):
        return png_fault(data)
    if data.startswith(JPEG_START):
        return jpeg_fault(data)
    return None


def png_fault(data: bytes) -> str | None:
    """Walks the chunks (length, type, data, CRC) to IEND; PNG specification, section 5."""
    place = len(PNG_SIGNATURE)
    view = memoryview(data)
    while place + 12 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, place)
        end = place + 12 + length
        if end > len(data):
            break
        (stored,) = struct.unpack_from(">I", data, end - 4)
        if deflate.crc32(view[place + 4 : end - 4]) != stored:
            return f"damaged PNG: wrong checksum of the {kind.decode('latin-1')} chunk at byte {place}"
        if kind == b"IEND":
            return None
        place = end
    return f"truncated PNG: ends at byte {len(data)} before its IEND chunk"


def jpeg_fault(data: bytes) -> str | None:
    """Walks the marker segments and scans to the end-of-image marker; ITU T.81, annex B."""
    place = len(JPEG_START)
    while place + 4 <= len(data):
        if data[place] != 0xFF:
            return f"damaged JPEG: no marker at byte {place}"
        marker = data[place + 1]
        if marker == JPEG_END:
            return None
        if marker == 0xFF:  # padding
            place += 1
        elif marker in JPEG_BARE:
            place += 2
        else:
            place += 2 + struct.unpack_from(">H", data, place + 2)[0]
        if marker == JPEG_SCAN:
            place = scan_end(data, place)
    if data[place : place + 2] == bytes((0xFF, JPEG_END)):
        return None
    return f"truncated JPEG: ends at byte {len(data)} before its end marker"


def scan_end(data: bytes, place: int) -> int:
    """The next marker after entropy-coded data, in which 0xFF is followed by 0 or a restart marker."""
    found = AFTER_SCAN.search(data, place)
    return len(data) if found is None else found.start()
