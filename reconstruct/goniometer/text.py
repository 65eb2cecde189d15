"""Columns of a text table: whatever separates them, decimal points or commas, remarks, units, and cells without a
number."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import chain, islice
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.goniometer.astm import encoding_of, table_lines

REMARKS = ("#", "%", "!", "//", ";")
SEPARATORS = (";", "\t", ",", "|", None, ":")  # None: blanks
NOTHING = {
    *(
        "",
        "-",
        "--",
        "---",
        "?",
        "*",
        ".",
        "na",
        "n/a",
        "n.a.",
        "#n/a",
        "<na>",
        "null",
        "nil",
        "none",
        "missing",
    ),
    *("#num!", "#div/0!", "#value!", "#ref!", "invalid"),
}
NO_NUMBER = ("1.#", "-1.#", "+1.#")  # begins what C's older libraries print for it
LOOK = 50  # lines by which separators and decimal marks are told
_CHUNK = 1 << 16  # rows that are turned into numbers at a time
_LEAST_COLUMNS = 3


@dataclass(slots=True)
class Column:
    """One column while it is read: numbers, and where a cell is none, which text it is."""

    parts: list[np.ndarray] = field(default_factory=list)
    codes: list[np.ndarray] = field(default_factory=list)  # 0 a number, -1 nothing, k + 1 the k-th text
    texts: dict[str, int] = field(default_factory=dict)

    def add(self, cells: tuple[str, ...]) -> None:
        """Further cells."""
        try:
            numbers, codes = np.fromiter(map(float, cells), float, len(cells)), np.zeros(len(cells), np.int32)
        except ValueError:
            told = [self._cell(cell) for cell in cells]
            numbers = np.array([number for number, _ in told])
            codes = np.array([code for _, code in told], np.int32)
        self.parts.append(numbers)
        self.codes.append(codes)

    def add_numbers(self, numbers: np.ndarray) -> None:
        """Further cells, all of them numbers."""
        self.parts.append(numbers.copy())
        self.codes.append(np.zeros(len(numbers), np.int32))

    def _cell(self, cell: str) -> tuple[float, int]:
        try:
            return float(cell.rstrip("\N{DEGREE SIGN} ") or cell), 0
        except ValueError:
            cell = cell.strip()
        if cell.lower() in NOTHING or cell.startswith(NO_NUMBER):
            return np.nan, -1
        return np.nan, self.texts.setdefault(cell, len(self.texts)) + 1


@dataclass(frozen=True, slots=True)
class TextTable:
    """A header and columns; n rows."""

    path: Path
    header: tuple[str, ...]
    numbers: tuple[np.ndarray, ...]  # (n,) each; NaN where the cell is no number
    codes: tuple[
        np.ndarray | None, ...
    ]  # (n,) each: 0 a number, -1 nothing, k + 1 texts[k]; None: all numbers
    texts: tuple[tuple[str, ...], ...]
    line: np.ndarray  # (n,) line of the file
    units: tuple[str, ...] = ()  # a line of units below the header
    passed: tuple[int, ...] = ()  # lines behind the rows that are none

    def __len__(self) -> int:
        return len(self.line)

    def take(self, keep: np.ndarray) -> TextTable:
        """The rows of a mask (n,)."""
        codes = tuple(None if code is None else code[keep] for code in self.codes)
        return TextTable(
            self.path,
            self.header,
            tuple(column[keep] for column in self.numbers),
            codes,
            self.texts,
            self.line[keep],
            self.units,
            self.passed,
        )

    def is_text(self, name: str) -> bool:
        """Whether cells of the column are words."""
        return bool(self.texts[self.header.index(name)])

    def number(self, name: str) -> np.ndarray:
        """The column (n,), NaN where a cell says nothing. Raises InputError for a cell that is another text."""
        place = self.header.index(name)
        codes = self.codes[place]
        if self.texts[place] and codes is not None:
            wrong = np.flatnonzero(codes > 0)
            if len(wrong):
                row = wrong[0]
                text = self.texts[place][codes[row] - 1]
                raise InputError(
                    f"{self.path}: line {self.line[row]}", f"{name} is {text!r}; expected a number"
                )
        return self.numbers[place]

    def labels(self, name: str) -> tuple[list[str], np.ndarray]:
        """The different values of a column, in ascending order, as text, and the place of each row's (n,); -1 where
        the cell says nothing."""
        place = self.header.index(name)
        numbers, codes = self.numbers[place], self.codes[place]
        found = np.unique(numbers[~np.isnan(numbers)])
        rows = np.full(len(self), -1)
        good = ~np.isnan(numbers)
        rows[good] = np.searchsorted(found, numbers[good])
        words = [f"{value:.10g}" for value in found]
        if codes is not None:
            rows[codes > 0] = codes[codes > 0] - 1 + len(words)
            words += self.texts[place]
        return words, rows


def read_text(path: Path) -> TextTable:
    """Read a table: a header, then rows of as many cells; blank lines and remarks are passed over.

    Commas, semicolons, tabs, bars, colons or blanks separate; where no comma does, commas may be decimal marks. A
    header may stand in a remark, or after ASTM E1392's ``VARS``, and a line of units below it. A header that comes
    again between rows, and lines of words behind them, are passed over.

    Raises:
        InputError: the file cannot be read, has no header, or a row has another number of cells.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        raise InputError(path, "is no file")  # a device need not end, and a pipe would be waited for
    try:
        with path.open(encoding=encoding_of(path)) as file:
            return _read(path, table_lines(file))
    except FileNotFoundError:
        raise InputError(path, "no such file") from None
    except OSError as error:
        raise InputError(
            path, f"cannot be read ({error.strerror}); expected a table of measurements"
        ) from None
    except UnicodeDecodeError:
        raise InputError(path, "is not text; expected a table of measurements (CSV)") from None


def _read(path: Path, file: Iterable[str]) -> TextTable:
    lines = enumerate(file, 1)
    remarks: list[tuple[int, str]] = []
    first = list(islice(_told(lines, remarks), LOOK))
    if "\0" in "".join(text for _, text in first):
        raise InputError(path, "is not text; expected a table of measurements (CSV)")
    first = first[_preamble([text for _, text in first]) :]
    mark = _separator([text for _, text in first])
    header, units, ahead = _header(path, first, [text for _, text in remarks], mark)
    if ahead and mark == ";":
        ahead = sorted(
            [*ahead, *(row for row in remarks if row > ahead[0] and _empty_first(row[1], len(header)))]
        )
    comma = mark != "," and _decimal_comma([text for _, text in ahead])
    columns = [Column() for _ in header]
    numbered: list[np.ndarray] = []
    rows = chain(ahead, _told(lines, [], mark, len(header)))
    passed: list[tuple[int, str]] = []
    while chunk := passed + list(islice(rows, _CHUNK)):
        if len(chunk) == len(passed):
            break
        plain = _plain([text for _, text in chunk], mark, comma)
        if plain is None:
            chunk, passed = _rows_of(
                chunk, header, mark, bool(ahead) and _is_number(_words(ahead[0][1], mark)[0])
            )
            if not chunk:
                continue
            plain = _plain([text for _, text in chunk], mark, comma)
        else:
            passed = []
        if plain is not None and plain.shape[1] == len(header):
            for column, numbers in zip(columns, plain.T, strict=True):
                column.add_numbers(numbers)
        else:
            cells = [_cells(path, number, text, mark, len(header), comma) for number, text in chunk]
            for column, part in zip(columns, zip(*cells, strict=True), strict=True):
                column.add(part)
        numbered.append(np.array([number for number, _ in chunk]))
    if not numbered:
        raise InputError(path, "is empty; expected a header line and rows of measurements")
    codes = [np.concatenate(column.codes) for column in columns]
    return TextTable(
        path,
        header,
        tuple(np.concatenate(column.parts) for column in columns),
        tuple(code if code.any() else None for code in codes),
        tuple(tuple(column.texts) for column in columns),
        np.concatenate(numbered),
        units,
        tuple(number for number, _ in passed),
    )


def _rows_of(
    lines: list[tuple[int, str]], header: tuple[str, ...], mark: str | None, numbered: bool
) -> tuple[list[tuple[int, str]], list[tuple[int, str]]]:
    """Lines without those that say the header again, and those at the end that are no rows: of words, where rows are
    ``numbered``, that is begin with a number."""
    same = [cell.lower() for cell in header]
    kept = [row for row in lines if row[1][:1].isdigit() or [c.lower() for c in _words(row[1], mark)] != same]
    end = len(kept)
    while numbered and end and _is_footer(_words(kept[end - 1][1], mark), len(header)):
        end -= 1
    return kept[:end], kept[end:]


def _is_footer(cells: list[str], count: int) -> bool:
    """Whether a line behind a table's rows is none: a row that is cut short still begins with a number."""
    first = cells[0].lower()
    if (first in NOTHING and len(cells) > 1) or first.startswith(NO_NUMBER) or _is_number(first):
        return False
    return len(cells) != count or not any(_is_number(cell) for cell in cells)


def _words(text: str, mark: str | None) -> list[str]:
    """Cells without blanks around; of a line whose quotes are not closed, all of it."""
    try:
        cells = [cell.strip() for cell in _split(text, mark)]
    except csv.Error:
        return [text]
    return cells[:-1] if len(cells) > 1 and not cells[-1] else cells


def passed_over(lines: tuple[int, ...]) -> str | None:
    """What is said of lines behind the rows; None where there are none."""
    if not lines:
        return None
    where = f"line {lines[0]}" if len(lines) == 1 else f"lines {lines[0]} to {lines[-1]}"
    return f"{where} behind the rows: no measurements, passed over"


def _plain(texts: list[str], mark: str | None, comma: bool) -> np.ndarray | None:
    """Rows that are nothing but numbers (n, k), some ten times as fast; None where they are not."""
    if comma:
        texts = [text.replace(",", ".") for text in texts]
    try:
        return np.loadtxt(texts, delimiter=mark, comments=None, ndmin=2)
    except ValueError:
        return None


def _told(
    lines: Iterator[tuple[int, str]], remarks: list[tuple[int, str]], mark: str | None = None, count: int = 0
) -> Iterator[tuple[int, str]]:
    """Lines that say something, with their numbers; remarks are put aside. Where semicolons separate, one that begins
    a line of as many cells as the header is no remark."""
    for number, line in lines:
        text = line.strip()
        if not text:
            continue
        if (
            text[0] in "#%!/;"
            and text.startswith(REMARKS)
            and not (mark == ";" and _empty_first(text, count))
        ):
            remarks.append((number, text))
            continue
        yield number, line.strip("\r\n") if mark == "\t" else text


def _empty_first(text: str, count: int) -> bool:
    """Whether a line that begins with a semicolon is a row of ``count`` cells."""
    return text[0] == ";" and text.count(";") == count - 1


def _split(text: str, mark: str | None) -> list[str]:
    if mark == "|" and text.startswith("|") and text.endswith("|"):
        text = text[1:-1]
    if '"' in text:
        cells = next(csv.reader([text], delimiter=mark or " ", skipinitialspace=True, strict=True))
        return [cell for cell in cells if cell] if mark is None else cells
    return text.split(mark)


def _count(text: str, mark: str | None) -> int:
    try:
        return len(_split(text, mark))
    except csv.Error:
        return 0


def _separator(texts: list[str]) -> str | None:
    """What cuts header and rows into as many cells, the most; blanks where nothing does."""
    for mark in SEPARATORS:
        counts = [_count(text, mark) for text in texts[:2]]
        if counts and min(counts) >= _LEAST_COLUMNS and len(set(counts)) == 1:
            return mark
    return next((mark for mark in (",", ";", "\t") if texts and mark in texts[0]), None)


def _preamble(texts: list[str]) -> int:
    """How many lines come before the header that are words of another kind, whatever they begin with: a table begins
    with a line of names above one of as many numbers. 0 where the first line is as good a header as any."""
    begun = [
        _count(texts[0], mark) == _count(texts[1], mark) >= _LEAST_COLUMNS for mark in SEPARATORS if texts[1:]
    ]
    if any(begun):
        return 0
    for k in range(1, len(texts) - 1):
        for mark in SEPARATORS:
            names = _words(texts[k], mark)
            if len(names) < _LEAST_COLUMNS or not all(name and not _is_number(name) for name in names):
                continue
            below = [_words(text, mark) for text in texts[k + 1 : k + 3]]
            if len(below) > 1 and not any(map(_is_number, below[0])):  # units
                below = below[1:]
            if len(below[0]) == len(names) and _is_number(below[0][0]):
                return k
    return 0


def _header(
    path: Path, first: list[tuple[int, str]], remarks: list[str], mark: str | None
) -> tuple[tuple[str, ...], tuple[str, ...], list[tuple[int, str]]]:
    """Names, units, and the rows that were looked at."""
    if not first:
        raise InputError(path, "is empty; expected a header line and rows of measurements")
    number, text = first[0]
    names, rows = _names(path, number, text, mark), first[1:]
    if all(_is_number(name) for name in names):
        names, rows = _from_remark(path, number, remarks, mark, len(names)), first
    if not rows:
        raise InputError(path, "is empty; expected a header line and rows of measurements")
    below = _names(path, *rows[0], mark)
    wide = re.split(r"\s{2,}", text)  # names of several words
    if mark is None and len(names) != len(below) == len(wide):
        names = tuple(wide)
    if (
        len(rows) > 1
        and len(below) == len(names)
        and {"theta_i", "theta_r"} <= {one.lower() for one in below}
    ):
        return _header(path, rows, remarks, mark)  # a line of groups above the names
    if len(rows) > 1 and len(below) == len(names) and all(cell and not _is_number(cell) for cell in below):
        if not {cell.lower() for cell in below} & NOTHING:
            return names, below, rows[1:]
    return names, (), rows


def _names(path: Path, number: int, text: str, mark: str | None) -> tuple[str, ...]:
    try:
        cells = _split(text, mark)
    except csv.Error:
        raise InputError(f"{path}: line {number}", "a quote is not closed") from None
    names = tuple(cell.strip() for cell in cells)
    return names[:-1] if len(names) > 1 and not names[-1] else names


def _from_remark(
    path: Path, number: int, remarks: list[str], mark: str | None, count: int
) -> tuple[str, ...]:
    """The header, of a file whose first line of data is numbers: the last remark of as many cells."""
    for remark in reversed(remarks):
        names = _names(path, number, remark.lstrip("#%!;/ \t"), mark)
        if len(names) == count and not any(_is_number(name) for name in names):
            return names
    raise InputError(
        f"{path}: line {number}",
        f"expected a header line that names the {count} columns (theta_i, phi_i, theta_r, phi_r and values), "
        "found numbers",
    )


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _decimal_comma(texts: list[str]) -> bool:
    """Whether commas are decimal marks: they stand between digits, and no point does."""
    return any("," in text for text in texts) and not any("." in text for text in texts)


def _cells(path: Path, number: int, text: str, mark: str | None, count: int, comma: bool) -> list[str]:
    if comma:
        text = text.replace(",", ".")
    try:
        cells = _split(text, mark)
    except csv.Error:
        raise InputError(f"{path}: line {number}", "a quote is not closed") from None
    if len(cells) == count + 1 and not cells[-1].strip():
        return cells[:-1]
    if len(cells) != count:
        raise InputError(f"{path}: line {number}", f"expected {count} columns, found {len(cells)}")
    return cells
