"""What OpenImageIO leaves out of a JPEG XL file: EXIF, and how the decoder has turned the picture.

ISO/IEC 18181-1 (codestream: size and metadata headers), 18181-2 (container).
"""

from __future__ import annotations

from pathlib import Path

from photogonio.capture.containers import exif
from photogonio.capture.containers.boxes import boxes

CONTAINER = b"\0\0\0\x0cJXL \r\n\x87\n"
SIZE_BITS = (9, 13, 18, 30)


def about(path: Path) -> tuple[dict[str, object], int]:
    """EXIF's attributes, and the orientation (EXIF's numbers, 1: as stored) that the decoder brings about."""
    data = path.read_bytes()
    attributes: dict[str, object] = {}
    if not data.startswith(CONTAINER):
        return attributes, orientation(data)
    stream = b""
    for kind, start, end in boxes(data):
        if kind == b"Exif":
            attributes = exif.attributes(exif_of(data[start:end]))
        elif kind == b"jxlc":
            stream = data[start:end]
        elif kind == b"jxlp":  # in parts, each behind its number
            stream += data[start + 4 : end]
    return attributes, orientation(stream)


def exif_of(content: bytes) -> bytes:
    """Behind four bytes that say where the TIFF header is, which some writers forget."""
    if content[:4] in (b"II*\0", b"MM\0*"):
        return content
    return content[4 + int.from_bytes(content[:4], "big") :]


def orientation(stream: bytes) -> int:
    bits = int.from_bytes(stream[2:34], "little")  # behind the signature

    def take(count: int) -> int:
        nonlocal bits
        value, bits = bits & ((1 << count) - 1), bits >> count
        return value

    def side(*, small: int) -> None:
        take(5) if small else take(SIZE_BITS[take(2)])

    small = take(1)
    side(small=small)
    if take(3) == 0:  # the ratio of the sides is none of the usual ones
        side(small=small)
    if take(1) or not take(1):  # everything is as usual, or there are no extra fields
        return 1
    return take(3) + 1
