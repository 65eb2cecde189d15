"""What a PNG file says of its tone curve, and its EXIF (PNG specification, third edition, section 11.3.2)."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np

from photogonio.capture.containers import icc
from photogonio.capture.containers.integrity import PNG_SIGNATURE
from photogonio.capture.containers.tone import SRGB, Curve, Tone, difference, named, of_cicp, rises
from photogonio.capture.jit import borrowing

WANTED = {b"cICP", b"iCCP", b"sRGB", b"gAMA", b"cHRM"}  # before the pixels
EXIF = b"eXIf"  # there, or behind them
AROUND = 12  # bytes of a chunk beside what it holds: length, type, checksum
MOST_BYTES = 1 << 24  # of a chunk or a profile
SCREEN_GAMMA = 45455  # 1 / 2.2: with sRGB's primaries it stands for sRGB
SRGB_CHROMATICITIES = (31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000)
CLOSE = 1000  # in a chromaticity: 0.01
APART = 0.3  # relative, of two curves: gAMA of 1/2.2 beside sRGB's own lies 0.21 off in the dark, and is meant for it


def about(path: Path, data: bytes | None = None) -> dict[bytes, bytes]:
    """The chunks that tell of colour or exposure, the first of each kind. ``data`` is the whole file, where it is at
    hand. Raises ValueError for codes not read."""
    if data is not None:
        told = list(told_in(data))
    else:
        with path.open("rb") as file:
            told = list(chunks(file))
    found = dict(reversed(told))
    if len(found.get(b"cICP", b"")) >= 4 and found[b"cICP"][3] == 0:
        raise ValueError("has codes of video's narrow range by its cICP chunk; expected full range")
    return found


def tone_of(found: Mapping[bytes, bytes]) -> Tone | None:
    """By cICP, iCCP, sRGB or gAMA, in this order; None if the file says nothing.

    Raises ValueError for a profile or a curve that cannot be used.
    """
    if len(found.get(b"cICP", b"")) >= 2:
        told = of_cicp(found[b"cICP"][1], "cICP chunk")
        if told is not None:
            return told
    if b"iCCP" in found:
        return icc.tone_of(profile(found[b"iCCP"]))
    if b"sRGB" in found:
        return Tone((SRGB,), "sRGB chunk")
    return of_gamma(found)


def of_gamma(found: Mapping[bytes, bytes]) -> Tone | None:
    """By gAMA. Raises ValueError for one that no codes have."""
    if len(found.get(b"gAMA", b"")) != 4:
        return None
    (gamma,) = struct.unpack(">I", found[b"gAMA"])
    if gamma == 0:
        return None
    if abs(gamma - SCREEN_GAMMA) <= 1 and near_srgb(found.get(b"cHRM", b"")):
        return Tone((SRGB,), "gAMA and cHRM chunks")
    curve = named(Curve("gamma", (1e5 / gamma,)))
    if not rises(curve):
        raise ValueError(f"gAMA chunk says {gamma / 1e5:.6g}, which no codes have")
    return Tone((curve,), "gAMA chunk")


def contradiction(found: Mapping[bytes, bytes], taken: Tone) -> tuple[str, ...]:
    """What gAMA says against the curve that goes before it, if they lie apart by more than such chunks are rounded."""
    try:
        other = of_gamma(found)
    except ValueError:
        return ()
    if (
        other is None
        or not taken.told
        or max(difference(other.curves[0], one) for one in taken.curves) <= APART
    ):
        return ()
    return (
        f"says {taken.name} by its {taken.source} and {other.name} by its {other.source}; the first is taken",
    )


def chunks(file: BinaryIO) -> Iterator[tuple[bytes, bytes]]:
    """The chunks that tell of colour, which stand before the pixels, and EXIF's."""
    if file.read(len(PNG_SIGNATURE)) != PNG_SIGNATURE:
        return
    wanted = {*WANTED, EXIF}
    while len(head := file.read(8)) == 8:
        length, kind = struct.unpack(">I4s", head)
        if kind == b"IEND":
            return
        if kind == b"IDAT":
            wanted = {EXIF}
        if kind in wanted and length <= MOST_BYTES:
            yield kind, file.read(length)
            file.seek(4, 1)
        else:
            file.seek(length + 4, 1)


def told_in(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """The same chunks of a file that is whole and in memory."""
    wanted = {*WANTED, EXIF}
    for kind, start, end in spans(data):
        if kind == b"IEND":
            return
        if kind == b"IDAT":
            wanted = {EXIF}
        elif kind in wanted and end - start - AROUND <= MOST_BYTES:
            yield kind, data[start + 8 : end - 4]


def spans(data: bytes) -> Iterator[tuple[bytes, int, int]]:
    """Type, start and end of each chunk, to the last whole one; of pixels those of all that follow one another, for
    encoders cut them into thousands, of 8 kB."""
    place, codes = len(PNG_SIGNATURE), np.frombuffer(data, np.uint8)
    while place + AROUND <= len(data):
        length, kind = struct.unpack_from(">I4s", data, place)
        end = run_end(codes, place) if kind == b"IDAT" else place + AROUND + length
        if end > len(data):
            return
        yield kind, place, end
        place = end


def pixel_stream(data: bytes, start: int, end: int) -> np.ndarray:
    """The bytes (n,) that IDAT chunks from ``start`` to ``end`` hold, one behind the other."""
    codes, runs = np.frombuffer(data, np.uint8), []
    while start < end:
        (length,) = struct.unpack_from(">I", data, start)
        alike = chunks_alike(codes, start, end)  # most encoders fill all but the last
        chunks = codes[start : start + alike * (AROUND + length)].reshape(alike, AROUND + length)
        runs.append(chunks[:, 8 : 8 + length])
        start += chunks.size
    joined, done = np.empty(sum(run.size for run in runs), np.uint8), 0
    for run in runs:
        joined[done : done + run.size].reshape(run.shape)[:] = run
        done += run.size
    return joined


@borrowing
def run_end(codes, place):
    """Where the IDAT chunks from ``place`` on end, in ``codes`` (n,) uint8, or behind them."""
    while place + 8 <= len(codes) and _is_idat(codes, place + 4):
        place += _length(codes, place) + AROUND
    return place


@borrowing
def chunks_alike(codes, place, end):
    """How many chunks from ``place`` on are as long as the first."""
    first, count = _length(codes, place), 0
    while place < end and _length(codes, place) == first:
        place, count = place + first + AROUND, count + 1
    return count


@borrowing
def _is_idat(codes, at):
    return codes[at] == 73 and codes[at + 1] == 68 and codes[at + 2] == 65 and codes[at + 3] == 84


@borrowing
def _length(codes, at):
    """Four bytes, the highest first."""
    high = np.int64(codes[at]) << 24 | np.int64(codes[at + 1]) << 16
    return high | np.int64(codes[at + 2]) << 8 | np.int64(codes[at + 3])


def profile(chunk: bytes) -> bytes:
    """The ICC profile, behind its name and the compression's number."""
    _, _, packed = chunk.partition(b"\0")
    try:
        return zlib.decompressobj().decompress(packed[1:], MOST_BYTES)
    except zlib.error as error:
        raise ValueError("ICC profile is damaged") from error


def near_srgb(chromaticities: bytes) -> bool:
    if len(chromaticities) != 32:
        return False
    values = struct.unpack(">8I", chromaticities)
    return all(abs(value - known) <= CLOSE for value, known in zip(values, SRGB_CHROMATICITIES, strict=True))
