"""Whether the codes of a JPEG's scan come out even: as many blocks as its picture has, and nothing left over.

libjpeg tells of a scan that ends early. One that is damaged and ends late it reads to the last block, and says nothing
of what is left. Of files of one scan (ITU T.81, sequential, Huffman), as cameras write them, the codes are counted
here, without their pixels; of others nothing is said.
"""

from __future__ import annotations

import io
import struct
from dataclasses import dataclass, field

import numpy as np

from photogonio.capture.containers.jpeg import SCAN, segments
from photogonio.capture.jit import jit

SEQUENTIAL = {0xC0, 0xC1}  # frames: baseline and extended, of Huffman codes
FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}
TABLES, RESTARTS, LENGTH = 0xC4, 0xDD, 16
WORDS = (
    "",
    "a code that no table has",
    "the codes end early",
    "codes are left over",
    "a restart marker is missing",
)
EVEN, NO_CODE, EARLY, LEFT, NO_RESTART = range(5)


@dataclass(slots=True)
class Scan:
    """What the segments before the codes say."""

    start: int = 0
    size: tuple[int, int] = (0, 0)  # width, height
    parts: dict[int, tuple[int, int]] = field(
        default_factory=dict
    )  # of each component: blocks across and down
    tables: dict[int, np.ndarray] = field(default_factory=dict)  # (65536,) by class and number
    chosen: list[tuple[int, int, int]] = field(default_factory=list)  # component, its DC and AC table
    restarts: int = 0  # units between markers; 0: none


def scan_fault(data: bytes) -> str:
    """What is wrong with the codes of a JPEG file, in words; empty where nothing is, and where it is of another kind
    than is counted."""
    try:
        scan = scan_of(data)
    except (struct.error, IndexError, ValueError):
        return ""  # for libjpeg to say
    if scan is None:
        return ""
    across, down = np.array(list(scan.parts.values())).max(0)
    if len(scan.chosen) == 1:  # a component alone goes block by block
        across = down = 1
        scan.parts = {scan.chosen[0][0]: (1, 1)}
    width, height = scan.size
    units = -(-width // (8 * int(across))) * -(-height // (8 * int(down)))
    blocks = [
        (0x00 | dc, 0x10 | ac) for part, dc, ac in scan.chosen for _ in range(np.prod(scan.parts[part]))
    ]
    if not units or not all(table in scan.tables for pair in blocks for table in pair):
        return ""
    numbers = {table: k for k, table in enumerate(scan.tables)}
    which = np.array([[numbers[table] for table in pair] for pair in blocks])
    codes = np.frombuffer(data, np.uint8)
    found = _walk(codes, scan.start, np.stack(list(scan.tables.values())), which, units, scan.restarts)
    return f"damaged JPEG: {WORDS[found]}" if found else ""


def scan_of(data: bytes) -> Scan | None:
    """None of files whose picture is not all in one scan of Huffman codes."""
    scan, file = Scan(), io.BytesIO(data)
    for marker, content in segments(file):
        if marker in FRAMES:
            if marker not in SEQUENTIAL or scan.parts:
                return None
            _, height, width, count = struct.unpack_from(">BHHB", content)
            scan.size = width, height
            for k in range(count):
                name, blocks = content[6 + 3 * k], content[7 + 3 * k]
                scan.parts[name] = blocks >> 4, blocks & 15
        elif marker == TABLES:
            scan.tables |= tables_of(content)
        elif marker == RESTARTS:
            (scan.restarts,) = struct.unpack_from(">H", content)
    place = file.tell()  # behind the marker of the scan
    if data[place - 2 : place] != bytes((0xFF, SCAN)):
        return None
    (length,) = struct.unpack_from(">H", data, place)
    count = data[place + 2]
    for k in range(count):
        name, tables = data[place + 3 + 2 * k], data[place + 4 + 2 * k]
        scan.chosen.append((name, tables >> 4, tables & 15))
    scan.start = place + length
    whole = scan.parts and {name for name, _, _ in scan.chosen} == set(scan.parts)
    return scan if whole and all(min(part) > 0 for part in scan.parts.values()) else None


def tables_of(content: bytes) -> dict[int, np.ndarray]:
    """Of each table (65536,) uint16: for each 16 bits the length of the code that they begin with, times 256, and its
    symbol; 0 where they begin with none (annex C)."""
    found, place = {}, 0
    while place + 17 <= len(content):
        name, counts = content[place], content[place + 1 : place + 17]
        place += 17
        table, code = np.zeros(1 << LENGTH, np.uint16), 0
        for length, count in enumerate(counts, 1):
            for _ in range(count):
                low, step = code << (LENGTH - length), 1 << (LENGTH - length)
                table[low : low + step] = length << 8 | content[place]
                code, place = code + 1, place + 1
            code <<= 1
        found[name] = table
    return found


@jit
def _walk(data, start, tables, which, units, restarts):
    """Goes through the codes of ``units`` groups of blocks, whose tables are ``which`` (blocks, 2)."""
    place, end = start, len(data)
    held, bits, padded, turn = np.uint64(0), 0, 0, 0
    for unit in range(units):
        if restarts and unit and unit % restarts == 0:
            if padded > bits:
                return EARLY
            if bits - padded >= 8:
                return LEFT
            while place + 1 < end and data[place] == 255 and data[place + 1] == 255:
                place += 1
            if place + 1 >= end or data[place] != 255:
                return LEFT
            if data[place + 1] != 0xD0 + turn % 8:
                return NO_RESTART
            place += 2
            turn += 1
            held, bits, padded = np.uint64(0), 0, 0
        for block in range(len(which)):
            k = 0
            while k < 64:
                while bits <= 48:
                    byte = np.uint64(0)
                    if place < end and data[place] != 255:
                        byte = np.uint64(data[place])
                        place += 1
                    elif place + 1 < end and data[place + 1] == 0:
                        byte = np.uint64(255)
                        place += 2
                    else:  # a marker, or the end
                        padded += 8
                    held = (held << np.uint64(8)) | byte
                    bits += 8
                found = tables[
                    which[block, 1 if k else 0], (held >> np.uint64(bits - 16)) & np.uint64(0xFFFF)
                ]
                if found == 0:
                    return EARLY if padded > bits - 16 else NO_CODE
                symbol = found & 255
                more = symbol & 15
                bits -= (found >> 8) + more
                if padded > bits:
                    return EARLY
                if k == 0:
                    bits -= symbol - more  # of a difference, all of the symbol is a length
                    k = 1
                elif more:
                    k += (symbol >> 4) + 1
                elif symbol == 0xF0:
                    k += 16
                else:
                    break
            if k > 64:
                return NO_CODE
    return LEFT if _is_left(data, place, bits - padded, held, padded) else EVEN


@jit
def _is_left(data, place, bits, held, padded):
    """Whether codes are left: more than a byte's end, and more than bytes that only fill."""
    if bits < 8:
        return False
    held = held >> np.uint64(padded)
    for k in range(bits // 8):
        byte = (held >> np.uint64(8 * k)) & np.uint64(255)
        if byte != 0 and byte != 255:
            return True
    while place + 1 < len(data) and (data[place] != 255 or data[place + 1] == 0):
        if data[place] != 0 and data[place] != 255:
            return True
        place += 1
    return False
