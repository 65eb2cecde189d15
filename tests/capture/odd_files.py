"""Files that are valid and unusual, written byte by byte after their specifications."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

D50 = (0.9642, 1.0, 0.8249)
ADOBE_COLORANTS = ((0.60974, 0.31111, 0.01947), (0.20528, 0.62567, 0.06087), (0.14919, 0.06322, 0.74457))
BYTES = {1: 1, 2: 1, 3: 2, 4: 4, 5: 8, 7: 1, 10: 8}  # of TIFF's types


def icc_profile(*curves: bytes, name: str = "a profile", space: bytes = b"RGB ") -> bytes:
    """A version 2 profile of three curve tags or of one for all, or of one for gray."""
    names = (b"kTRC",) if space == b"GRAY" else (b"rTRC", b"gTRC", b"bTRC")
    curves = curves * len(names) if len(curves) == 1 else curves
    text = b"desc" + bytes(4) + struct.pack(">I", len(name) + 1) + name.encode() + bytes(79)
    colorants = () if space == b"GRAY" else zip((b"rXYZ", b"gXYZ", b"bXYZ"), ADOBE_COLORANTS, strict=True)
    places = [(tag, xyz(*place)) for tag, place in ((b"wtpt", D50), *colorants)]
    tags = [(b"desc", text), (b"cprt", b"text" + bytes(8)), *places, *zip(names, curves, strict=True)]
    place = 128 + 4 + 12 * len(tags)
    table, body = struct.pack(">I", len(tags)), b""
    for tag, content in tags:
        table += struct.pack(">4sII", tag, place + len(body), len(content))
        body += content + bytes(-len(content) % 4)
    head = struct.pack(">I4sI4s4s4s", place + len(body), bytes(4), 0x02400000, b"mntr", space, b"XYZ ")
    head += struct.pack(">6H", 2026, 1, 1, 0, 0, 0)
    return head.ljust(36, b"\0") + b"acsp".ljust(32, b"\0") + xyz(*D50)[8:].ljust(60, b"\0") + table + body


def xyz(*place: float) -> bytes:
    return b"XYZ " + bytes(4) + struct.pack(">3i", *(round(x * 65536) for x in place))


def gamma_tag(gamma: float) -> bytes:
    return b"curv" + bytes(4) + struct.pack(">IH", 1, round(gamma * 256)) + bytes(2)


def table_tag(values: np.ndarray) -> bytes:
    codes = np.round(np.asarray(values) * 65535).astype(">u2")
    return b"curv" + bytes(4) + struct.pack(">I", len(codes)) + codes.tobytes()


def parametric_tag(kind: int, *numbers: float) -> bytes:
    return (
        b"para" + bytes(4) + struct.pack(f">HH{len(numbers)}i", kind, 0, *(round(x * 65536) for x in numbers))
    )


SRGB_TAG = parametric_tag(3, 2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045)


def png(path: Path, codes: np.ndarray, *chunks: tuple[bytes, bytes]) -> Path:
    """A PNG of codes (h, w, 3) in the order R, G, B, with chunks behind its header."""
    path.parent.mkdir(parents=True, exist_ok=True)
    _, data = cv2.imencode(".png", np.ascontiguousarray(codes[..., ::-1]))
    whole = data.tobytes()
    more = b"".join(
        struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        for kind, content in chunks
    )
    path.write_bytes(whole[:33] + more + whole[33:])
    return path


def iccp(profile: bytes) -> tuple[bytes, bytes]:
    return b"iCCP", b"x\0\0" + zlib.compress(profile)


def gama(gamma: float) -> tuple[bytes, bytes]:
    return b"gAMA", struct.pack(">I", round(1e5 / gamma))


SRGB_CHRM = (b"cHRM", struct.pack(">8I", 31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000))


def jpeg(path: Path, codes: np.ndarray, *segments: tuple[int, bytes]) -> Path:
    """A JPEG of codes (h, w, 3) in the order R, G, B, with marker segments behind its start."""
    path.parent.mkdir(parents=True, exist_ok=True)
    quality = [
        cv2.IMWRITE_JPEG_QUALITY,
        100,
        cv2.IMWRITE_JPEG_SAMPLING_FACTOR,
        cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444,
    ]
    whole = cv2.imencode(".jpg", np.ascontiguousarray(codes[..., ::-1]), quality)[1].tobytes()
    more = b"".join(
        b"\xff" + bytes([marker]) + struct.pack(">H", len(content) + 2) + content
        for marker, content in segments
    )
    path.write_bytes(whole[:2] + more + whole[2:])
    return path


def app2(profile: bytes) -> tuple[int, bytes]:
    return 0xE2, b"ICC_PROFILE\0\x01\x01" + profile


Entry = tuple[int, int, Sequence[int]]  # tag, type, numbers (rationals flat)


def tiff_directory(entries: Sequence[Entry], place: int) -> bytes:
    """A little-endian directory that stands at ``place``, without the place of the next, its values behind it."""
    size = 2 + 12 * len(entries) + 4
    table, values = struct.pack("<H", len(entries)), b""
    for tag, kind, numbers in sorted(entries):
        form = {1: "B", 2: "B", 3: "H", 4: "I", 5: "I", 7: "B", 10: "i"}[kind]
        content = struct.pack(f"<{len(numbers)}{form}", *numbers)
        count = len(content) // BYTES[kind]
        if len(content) > 4:
            table += struct.pack("<HHII", tag, kind, count, place + size + len(values))
            values += content + bytes(len(content) % 2)
        else:
            table += struct.pack("<HHI", tag, kind, count) + content.ljust(4, b"\0")
    return table + bytes(4) + values


def tiff(
    path: Path,
    pixels: np.ndarray,
    *,
    photometric: int = 2,
    planar: bool = False,
    entries: Sequence[Entry] = (),
    after: Sequence[np.ndarray] = (),
    subfiles: Sequence[int] = (),
) -> Path:
    """A little-endian TIFF of pixels (h, w, c); pages of other ``after`` pictures follow.

    ``subfiles`` is the kind of each page: 1 a thumbnail, 4 a mask.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    data, links = b"II*\0" + bytes(4), [4]
    for k, page in enumerate((pixels, *after)):
        place = len(data) + len(data) % 2
        data = data.ljust(place, b"\0")
        directory = tiff_page(
            page,
            place,
            photometric=photometric,
            planar=planar,
            entries=entries,
            subfile=(*subfiles, 0, 0, 0)[k],
        )
        data = data[: links[-1]] + struct.pack("<I", place) + data[links[-1] + 4 :] + directory
        (count,) = struct.unpack_from("<H", data, place)
        links.append(place + 2 + 12 * count)
    path.write_bytes(data)
    return path


def tiff_page(
    pixels: np.ndarray, place: int, *, photometric: int, planar: bool, entries: Sequence[Entry], subfile: int
) -> bytes:
    height, width, channels = pixels.shape
    bits, floats = 8 * pixels.dtype.itemsize, pixels.dtype.kind == "f"
    strips = channels if planar else 1
    content = np.ascontiguousarray(np.moveaxis(pixels, 2, 0) if planar else pixels).tobytes()
    length = len(content) // strips

    def page(start: int) -> bytes:
        own: list[Entry] = [
            (254, 4, [subfile]), (256, 4, [width]), (257, 4, [height]), (258, 3, [bits] * channels), (259, 3, [1]),
            (262, 3, [photometric]), (273, 4, [start + k * length for k in range(strips)]), (277, 3, [channels]),
            (278, 4, [height]), (279, 4, [length] * strips), (284, 3, [2 if planar else 1]),
            (339, 3, [3 if floats else 1] * channels), *entries,
        ]  # fmt: skip
        return tiff_directory(own, place)

    return page(place + len(page(0))) + content


def exif_block(
    orientation: int = 1, *, time: tuple[int, int] = (1, 64), apex: tuple[int, int] | None = None
) -> bytes:
    """EXIF of a time in seconds (and as APEX), f/2.8, ISO 100."""
    inner: list[Entry] = [(0x829A, 5, time), (0x829D, 5, [28, 10]), (0x8827, 3, [100])]
    inner += [] if apex is None else [(0x9201, 10, apex)]
    first: list[Entry] = [(274, 3, [orientation]), (0x8769, 4, [0])]
    length = len(tiff_directory(first, 8))
    first[1] = (0x8769, 4, [8 + length])
    return (
        b"Exif\0\0II*\0" + struct.pack("<I", 8) + tiff_directory(first, 8) + tiff_directory(inner, 8 + length)
    )
