"""The directories of a TIFF file, as far as they tell which picture to take and how (TIFF 6.0; BigTIFF)."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import BinaryIO

from photogonio.capture.containers.tone import Curve, Tone, named, rises

(
    SUBFILE, WIDTH, HEIGHT, BITS, COMPRESSION, PHOTOMETRIC, STRIP_PLACES, ORIENTATION, SAMPLES, STRIP_SIZES, PLANAR,
    TRANSFER, PREDICTOR, TILE_WIDTH, TILE_PLACES, TILE_SIZES, CHILDREN, EXTRA, FORMAT, DNG, BLACK_REPEAT, BLACK,
    BLACK_ACROSS, BLACK_DOWN, WHITE, ACTIVE, CELLS, CELL_COLOURS, LAYOUT,
) = (
    254, 256, 257, 258, 259, 262, 273, 274, 277, 279, 284, 301, 317, 322, 324, 325, 330, 338, 339, 50706, 50713,
    50714, 50715, 50716, 50717, 50829, 33421, 50710, 50711,
)  # fmt: skip
OPCODES = (51008, 51009, 51022)
RATIOS = {
    BLACK,
    BLACK_ACROSS,
    BLACK_DOWN,
}  # numerators and denominators in turn, whatever they are written as
LONG = {*OPCODES, *RATIOS, TRANSFER, STRIP_PLACES, STRIP_SIZES, TILE_PLACES, TILE_SIZES}
WANTED = {
    SUBFILE, WIDTH, HEIGHT, BITS, COMPRESSION, PHOTOMETRIC, ORIENTATION, SAMPLES, PLANAR, PREDICTOR, TILE_WIDTH,
    CHILDREN, EXTRA, FORMAT, DNG, BLACK_REPEAT, WHITE, ACTIVE, CELLS,
    CELL_COLOURS, LAYOUT, *LONG,
}  # fmt: skip
NUMBERS = {1: "B", 3: "H", 4: "I", 7: "B", 13: "I", 16: "Q", 18: "Q"}
PAIRS = {5: "I", 10: "i"}  # rationals
MOST_PAGES, MOST_ENTRIES, MOST_VALUES, MOST_BYTES = 100, 4096, 64, 1 << 24
MIN_IS_WHITE, RGB, PALETTE, YCBCR = 0, 2, 3, 6
PLAIN = {1: 1, 2: 3}  # samples of gray and of RGB without more
READ = {0: "min-is-white gray", 1: "gray", 2: "RGB", 3: "a palette", 6: "YCbCr"}
REFUSED = {
    4: "a mask", 5: "CMYK", 8: "CIE Lab", 9: "ICC Lab", 10: "ITU Lab", 32803: "a mosaic", 32844: "LogL",
    32845: "LogLuv", 34892: "linear raw",
}  # fmt: skip
REDUCED, MASK = 1, 4  # bits of SUBFILE
MULTIPLIED = 1  # EXTRA: alpha by which colours are multiplied
PACKED_ROWS = 1  # COMPRESSION: none

Tags = Mapping[int, tuple[int, ...]]


@dataclass(frozen=True, slots=True)
class Page:
    """One picture of a file."""

    index: int
    subfile: int
    width: int
    height: int
    bits: int
    samples: int
    photometric: int
    orientation: int
    planar: bool
    extra: tuple[int, ...]  # of samples beyond the colours: 0 unspecified, 1 and 2 alpha
    transfer: tuple[int, ...]  # light of each code, of 65535; of one channel or of three in turn
    held: int  # bytes in its strips, where they are not compressed and it says so


def picture_of(path: Path) -> Page:
    """The page that is the photo: the largest that is no thumbnail and no mask.

    Raises ValueError, saying why, if there is none, several, or one of colours that are not read.
    """
    with path.open("rb") as file:
        chain = list(directories(file))
        below = [page_of(-1, tags) for tags in with_children(file) if tags not in chain]
    pages = [page_of(k, tags) for k, tags in enumerate(chain)]
    full = [page for page in pages if not page.subfile & (REDUCED | MASK)] or pages[:1]
    if not full:
        raise ValueError("truncated or damaged: it holds no directory")
    most = max(page.width * page.height for page in full)
    largest = [page for page in full if page.width * page.height == most]
    if any(page.width * page.height > most for page in below):
        raise ValueError(
            "holds its picture below a smaller one (a SubIFD), where it is not read; expected it alone"
        )
    if len(largest) > 1:
        raise ValueError(f"holds {len(largest)} pictures of one size; expected one")
    page = largest[0]
    if page.photometric not in READ:
        name = REFUSED.get(page.photometric, f"colours of the unknown kind {page.photometric}")
        raise ValueError(f"holds {name}; expected gray, RGB or more channels of light")
    rows = page.height * (page.samples if page.planar else 1)
    needed = rows * ((page.width * page.bits * (1 if page.planar else page.samples) + 7) // 8)
    if 0 < page.held < needed and page.photometric != YCBCR:  # whose chroma has fewer pixels
        raise ValueError(f"truncated or damaged: its strips hold {page.held} bytes of {needed}")
    return page


def page_of(index: int, tags: Tags) -> Page:
    def first(tag: int, default: int) -> int:
        return tags.get(tag, (default,))[0]

    sizes = tags.get(STRIP_SIZES, ())
    return Page(
        index=index,
        subfile=first(SUBFILE, 0),
        width=first(WIDTH, 0),
        height=first(HEIGHT, 0),
        bits=first(BITS, 1),
        samples=first(SAMPLES, 1),
        photometric=first(PHOTOMETRIC, 1),
        orientation=first(ORIENTATION, 1),
        planar=first(PLANAR, 1) == 2,
        extra=tags.get(EXTRA, ()),
        transfer=tags.get(TRANSFER, ()),
        held=0 if first(COMPRESSION, 1) != PACKED_ROWS or 0 in sizes else sum(sizes),
    )


def tone_of(page: Page) -> Tone | None:
    """By TransferFunction (TIFF 6.0, section 20); None if the file has none.

    Raises ValueError for one that cannot be used.
    """
    codes, numbers = 1 << min(page.bits, 16), page.transfer
    if not numbers:
        return None
    if page.photometric not in PLAIN or page.bits > 16 or len(numbers) not in (codes, 3 * codes):
        raise ValueError(f"TransferFunction of {len(numbers)} numbers is none of its codes")
    tables = [numbers[k : k + codes] for k in range(0, len(numbers), codes)]
    curves = [Curve("table", tuple(value / 65535 for value in table)) for table in tables]
    if not all(rises(one) for one in curves):
        raise ValueError("TransferFunction does not rise")
    curves = [named(one) for one in curves]
    return Tone(tuple(curves[:1] if len(set(curves)) == 1 else curves), "TransferFunction")


def is_dng(file: BinaryIO) -> bool:
    """Whether a TIFF file's first directory has a DNG's version."""
    return any(DNG in tags for tags in islice(directories(file), 1))


def with_children(file: BinaryIO) -> Iterator[Tags]:
    """Each directory of the chain and those that it points to, as DNG has its raw picture."""
    for tags in directories(file):
        yield tags
        for place in tags.get(CHILDREN, ()):
            yield from islice(directories(file, place), 1)


def directories(file: BinaryIO, place: int | None = None) -> Iterator[Tags]:
    """The wanted tags of each directory along the chain, or of that which stands at ``place`` and what follows it; a
    damaged one ends it."""
    file.seek(0)
    head = file.read(16)
    order = "<" if head[:2] == b"II" else ">"
    big = head[2:4] in (b"+\0", b"\0+")
    try:
        if place is None:
            (place,) = struct.unpack_from(order + ("Q" if big else "I"), head, 8 if big else 4)
        seen: set[int] = set()
        while place and place not in seen and len(seen) < MOST_PAGES:
            seen.add(place)
            tags, place = directory(file, place, order, big=big)
            yield tags
    except (struct.error, OSError, OverflowError):
        return


def directory(file: BinaryIO, place: int, order: str, *, big: bool) -> tuple[Tags, int]:
    """One directory's wanted tags, and where the next is (0: nowhere)."""
    file.seek(place)
    (count,) = struct.unpack(order + ("Q" if big else "H"), file.read(8 if big else 2))
    count = min(count, MOST_ENTRIES)
    form, inline = (order + "HHQ", 8) if big else (order + "HHI", 4)
    size = struct.calcsize(form) + inline
    table = file.read(count * size)
    (following,) = struct.unpack(order + ("Q" if big else "I"), file.read(inline))
    tags = {}
    for k in range(count):
        tag, kind, number = struct.unpack_from(form, table, k * size)
        letter = NUMBERS.get(kind) or (PAIRS.get(kind) if tag in RATIOS else None)
        if tag in WANTED and letter and number:
            value = table[(k + 1) * size - inline : (k + 1) * size]
            number *= 2 if kind in PAIRS else 1
            most = MOST_BYTES // struct.calcsize(letter) if tag in LONG else MOST_VALUES
            found = values(file, value, f"{order}{min(number, most)}{letter}")
            tags[tag] = over_one(found) if tag in RATIOS and kind in NUMBERS else found
    return tags, following


def over_one(whole: tuple[int, ...]) -> tuple[int, ...]:
    """Whole numbers as numerators and denominators in turn."""
    return tuple(part for number in whole for part in (number, 1))


def values(file: BinaryIO, inline: bytes, form: str) -> tuple[int, ...]:
    """The numbers of an entry: in it if they fit, else where it points."""
    size = struct.calcsize(form)
    if size > len(inline):
        file.seek(int.from_bytes(inline, "little" if form[0] == "<" else "big"))
        return struct.unpack(form, file.read(size))
    return struct.unpack_from(form, inline)
