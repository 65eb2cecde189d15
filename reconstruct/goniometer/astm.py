"""Lines of a table's file, whatever program wrote it: in which encoding, and where its header stands.

Scatter files in the manner of ASTM E1392 and E2387 have keywords, then a line ``VARS`` with the names of columns.

The scattered direction is (theta_s, phi_s). The incident azimuth is that of the direction the light comes from, so
that azimuths are as ours. The standard has degrees; files with radians are asked about as any table is.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterable, Iterator
from itertools import chain, islice
from pathlib import Path

import numpy as np

LOOK = 2000  # lines within which the columns are named
MARKS = {codecs.BOM_UTF32_LE: "utf-32", codecs.BOM_UTF32_BE: "utf-32", codecs.BOM_UTF16_LE: "utf-16",
         codecs.BOM_UTF16_BE: "utf-16"}  # fmt: skip
PLAIN = "cp1252"  # of tables that are no UTF-8: Western letters, a degree sign
NULLS, MOSTLY = (
    4096,
    0.9,
)  # bytes at a file's beginning, and the share of zeros that makes a place in a letter zero
WIDE = {(False, True, True, True): "utf-32-le", (True, True, True, False): "utf-32-be",
        (False, True, False, True): "utf-16-le", (True, False, True, False): "utf-16-be"}  # fmt: skip
_CONTROL = re.compile(rb"[\x00-\x08\x0e-\x19\x1c-\x1f]")  # in no text
_SEPARATOR = re.compile(r"sep=.\s*", re.IGNORECASE)
_VARS = re.compile(r"\s*VARS[\s:=]+(?=\S)", re.IGNORECASE)


def _wide(start: bytes) -> str | None:
    """The encoding of a text without a mark that ``start`` s a file and has two or four bytes a letter; None of others.
    Numbers and Latin letters leave all but one of them zero."""
    zero = np.frombuffer(start[: len(start) // 4 * 4], np.uint8).reshape(-1, 4) == 0
    if len(zero) < 4:
        return None
    share = zero.mean(axis=0)
    high = tuple((share > MOSTLY).tolist())
    if share.max() < MOSTLY or share.min() > 1 - MOSTLY:
        return None
    name = WIDE.get(high)
    text = "" if name is None else start.decode(name, "ignore")
    return name if all(letter.isprintable() or letter.isspace() for letter in text) else None


def table_lines(lines: Iterable[str]) -> Iterator[str]:
    """The lines of a table, one for one: where a line names the columns, those before it are left blank."""
    rest = iter(lines)
    first = list(islice(rest, LOOK))
    if first and _SEPARATOR.fullmatch(first[0]):  # a spreadsheet's own line
        first[0] = "\n"
    place = next((k for k, line in enumerate(first) if _VARS.match(line)), None)
    if place is None:
        return chain(first, rest)
    header = re.sub(r"\b(theta|phi)_s\b", r"\1_r", _VARS.sub("", first[place], count=1))
    return chain(["\n"] * place, [header], first[place + 1 :], rest)


def encoding_of(path: Path) -> str:
    """The encoding of a text file, told by its first bytes, else by whether all of it is UTF-8.

    Raises:
        OSError: it cannot be read.
        UnicodeDecodeError: it is no text.
    """
    with path.open("rb") as file:
        start = file.read(NULLS)
        marked = next((name for mark, name in MARKS.items() if start.startswith(mark)), None) or _wide(start)
        if marked is not None:
            return marked
        file.seek(0)
        known = codecs.getincrementaldecoder("utf-8")()
        try:
            while part := file.read(1 << 20):
                known.decode(part)
            known.decode(b"", final=True)
        except UnicodeDecodeError as error:
            file.seek(0)
            if any(_CONTROL.search(part) for part in iter(lambda: file.read(1 << 20), b"")):
                raise error from None
            return PLAIN
    return "utf-8-sig"
