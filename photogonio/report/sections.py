"""What a report holds, as words and tables; no library that draws is needed for them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from photogonio.report.viewer.mode_map import ModeMap


@dataclass(frozen=True)
class Table:
    head: Sequence[str]
    rows: Sequence[Sequence[str]]

    def numeric(self, column: int) -> bool:
        """Whether a column holds numbers only, and is aligned to the right."""
        return column in self._numeric

    @cached_property
    def _numeric(self) -> frozenset[int]:
        cells = zip(*self.rows, strict=True)
        return frozenset(k for k, column in enumerate(cells) if all(_is_number(cell) for cell in column))


def _is_number(cell: str) -> bool:
    return re.fullmatch(r"[-−+]?[\d.]+(e[-+]?\d+)?( ?[%°]| px)?|–|", str(cell)) is not None


@dataclass(frozen=True, slots=True)
class Card:
    """One figure of the summary."""

    label: str
    value: str
    note: str = ""
    alarm: bool = False


@dataclass(frozen=True, slots=True)
class Picture:
    title: str
    caption: str
    png: str  # base64


@dataclass(frozen=True, slots=True)
class Section:
    title: str
    table: Table
    text: str = ""
    folded: bool = False


@dataclass(frozen=True, slots=True)
class ContactPrint:
    """One photo on the contact sheet."""

    name: str
    jpeg: str  # base64; empty where it is not at hand
    state: str  # "used" | "board" | "left out"
    said: str


@dataclass(frozen=True, slots=True)
class Report:
    """All that a page shows, as text; what it has not is left out."""

    title: str
    lead: str
    provenance: Table
    verdict: Sequence[tuple[str, str]] = ()  # question, answer
    told: str = ""  # JSON for templates/interactive.js; see html.interactive_text
    parts: Sequence[str] = ()  # of "ball" and "set-up", what the JSON has
    turning: bool = False
    sphere: str = ""  # base64 PNG, or empty
    cards: Sequence[Card] = ()
    choices: Table = Table((), ())  # what, value, reason
    prints: Sequence[ContactPrint] = ()
    coverage: Sequence[str] = ()  # sentences
    pictures: Sequence[Picture] = ()
    coefficients_text: str = ""
    modes: ModeMap | None = None
    leading_modes: Table = Table((), ())
    all_modes: Table = Table((), ())
    budget: Sequence[Section] = ()  # of uncertainty; empty where no errors are known
    calibration: Sequence[Section] = ()  # empty for tabulated measurements
    warnings: Sequence[tuple[str, str]] = ()  # code, as in docs/diagnoses.md, and words
    left_out: Sequence[tuple[str, str]] = ()  # photo, reason
    tables: Sequence[Section] = ()  # further ones
    kind: str = "measured BRDF"

    @property
    def left_out_table(self) -> Table:
        return Table(("left out", "reason"), self.left_out)
