"""What a PNG file says of its tone curve (PNG specification, third edition, section 11.3.2)."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from photogonio.capture.containers import icc
from photogonio.capture.containers.integrity import PNG_SIGNATURE
from photogonio.capture.containers.tone import SRGB, Curve, Tone, named, of_cicp

WANTED = {b"cICP", b"iCCP", b"sRGB", b"gAMA", b"cHRM"}
MOST_BYTES = 1 << 24  # of a chunk or a profile
SCREEN_GAMMA = 45455  # 1 / 2.2: with sRGB's primaries it stands for sRGB
SRGB_CHROMATICITIES = (31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000)
CLOSE = 1000  # in a chromaticity: 0.01


def tone_of(path: Path) -> Tone | None:
    """By cICP, iCCP, sRGB or gAMA, in this order; None if the file says nothing.

    Raises ValueError for a profile that cannot be used.
    """
    with path.open("rb") as file:
        found = dict(chunks(file))
    if len(found.get(b"cICP", b"")) >= 2:
        told = of_cicp(found[b"cICP"][1], "cICP chunk")
        if told is not None:
            return told
    if b"iCCP" in found:
        return icc.tone_of(profile(found[b"iCCP"]))
    if b"sRGB" in found:
        return Tone((SRGB,), "sRGB chunk")
    if len(found.get(b"gAMA", b"")) != 4:
        return None
    (gamma,) = struct.unpack(">I", found[b"gAMA"])
    if gamma == 0:
        return None
    if abs(gamma - SCREEN_GAMMA) <= 1 and near_srgb(found.get(b"cHRM", b"")):
        return Tone((SRGB,), "gAMA and cHRM chunks")
    return Tone((named(Curve("gamma", (1e5 / gamma,))),), "gAMA chunk")


def chunks(file: BinaryIO) -> Iterator[tuple[bytes, bytes]]:
    """The chunks that tell of colour, which stand before the pixels."""
    if file.read(len(PNG_SIGNATURE)) != PNG_SIGNATURE:
        return
    while len(head := file.read(8)) == 8:
        length, kind = struct.unpack(">I4s", head)
        if kind in (b"IDAT", b"IEND"):
            return
        if kind in WANTED and length <= MOST_BYTES:
            yield kind, file.read(length)
            file.seek(4, 1)
        else:
            file.seek(length + 4, 1)


def profile(chunk: bytes) -> bytes:
    """The ICC profile, behind its name and the compression's number."""
    _, _, packed = chunk.partition(b"\0")
    try:
        return zlib.decompressobj().decompress(packed[1:], MOST_BYTES)
    except zlib.error as error:
        raise ValueError("is damaged") from error


def near_srgb(chromaticities: bytes) -> bool:
    if len(chromaticities) != 32:
        return False
    values = struct.unpack(">8I", chromaticities)
    return all(abs(value - known) <= CLOSE for value, known in zip(values, SRGB_CHROMATICITIES, strict=True))
