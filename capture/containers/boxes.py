"""The boxes of ISO base media files (ISO/IEC 14496-12), as far as HEIC, AVIF and JPEG XL need them."""

from __future__ import annotations

import struct
from collections.abc import Iterator

Turn = tuple[str, int]  # "irot" and quarter turns anticlockwise, or "imir" and its axis


def boxes(data: bytes, start: int = 0, end: int | None = None) -> Iterator[tuple[bytes, int, int]]:
    """Each box's type, and where its content begins and ends."""
    end = len(data) if end is None else end
    while start + 8 <= end:
        size, kind = struct.unpack_from(">I4s", data, start)
        head = 8
        if size == 1 and start + 16 <= end:
            (size,) = struct.unpack_from(">Q", data, start + 8)
            head = 16
        size = end - start if size == 0 else size
        if size < head or start + size > end:
            return
        yield kind, start + head, start + size
        start += size


def child(data: bytes, kind: bytes, span: tuple[int, int]) -> tuple[int, int] | None:
    """Where the content of the first box of a kind is; None if there is none."""
    return next(((a, b) for name, a, b in boxes(data, *span) if name == kind), None)


def turns(data: bytes) -> list[Turn]:
    """How a viewer turns and mirrors the main picture of a HEIF or AVIF file, in this order (ISO/IEC 23008-12)."""
    try:
        return _turns(data)
    except (struct.error, IndexError):
        return []


def _turns(data: bytes) -> list[Turn]:
    meta = child(data, b"meta", (0, len(data)))
    inside = meta and (meta[0] + 4, meta[1])  # behind version and flags
    main = inside and child(data, b"pitm", inside)
    properties = inside and child(data, b"iprp", inside)
    kept = properties and child(data, b"ipco", properties)
    if not main or not properties or not kept:
        return []
    wide = data[main[0]] > 0  # version
    (item,) = struct.unpack_from(">I" if wide else ">H", data, main[0] + 4)
    listed = list(boxes(data, *kept))
    found: list[Turn] = []
    for kind, start, _ in boxes(data, *properties):
        if kind == b"ipma":
            for k in properties_of(data, start, item):
                name, place, _ = listed[k - 1] if 0 < k <= len(listed) else (b"", 0, 0)
                if name in (b"irot", b"imir"):
                    found.append((name.decode(), data[place] & (3 if name == b"irot" else 1)))
    return found


def properties_of(data: bytes, place: int, wanted: int) -> list[int]:
    """The numbers, from 1, of an item's properties, by the association box whose content begins at ``place``."""
    version, wide = data[place], data[place + 3] & 1
    (count,) = struct.unpack_from(">I", data, place + 4)
    place += 8
    for _ in range(count):
        (item,) = struct.unpack_from(">I" if version else ">H", data, place)
        place += 4 if version else 2
        number, place = data[place], place + 1
        size = 2 if wide else 1
        codes = [
            int.from_bytes(data[place + k * size : place + (k + 1) * size], "big") for k in range(number)
        ]
        place += number * size
        if item == wanted:
            return [code & (0x7FFF if wide else 0x7F) for code in codes]
    return []
