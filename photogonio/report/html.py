"""The report: one self-contained HTML page, the same bytes for the same content."""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import resources

import numpy as np
from jinja2 import Environment, StrictUndefined
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.image import imsave

_DPI = 150


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
class Report:
    """All that the page shows, as text."""

    title: str
    lead: str
    sphere: str  # base64 PNG, or empty
    cards: Sequence[Card]
    choices: Table  # what, value, reason
    pictures: Sequence[Picture]
    coefficients_text: str
    leading_modes: Table
    all_modes: Table
    budget: Sequence[Section]  # of uncertainty; empty where no errors are known
    calibration: Sequence[Section]  # empty for tabulated measurements
    warnings: Sequence[tuple[str, str]]  # code, as in docs/diagnoses.md, and words
    left_out: Sequence[tuple[str, str]]  # photo, reason
    provenance: Table

    @property
    def left_out_table(self) -> Table:
        return Table(("left out", "reason"), self.left_out)


def render_report(report: Report) -> str:
    """The page as HTML text."""
    text = resources.files("photogonio.report").joinpath("templates/report.html").read_text(encoding="utf-8")
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    return environment.from_string(text).render(r=report)


def picture_bytes(figure: Figure, *, kind: str = "png", source: str = "") -> bytes:
    """A figure as PNG or SVG without a date, so that the same figure gives the same bytes.

    ``source`` says where it came from; the file keeps it among its metadata.
    """
    stream = io.BytesIO()
    metadata: dict[str, str | None]
    if kind == "svg":
        metadata = {"Date": None, "Description": source}
    else:
        metadata = {"Software": None, "Comment": source}
    with rc_context({"svg.hashsalt": "photogonio"}):
        figure.savefig(stream, format=kind, dpi=_DPI, metadata=metadata)
    return stream.getvalue()


def image_bytes(image: np.ndarray) -> bytes:
    """An sRGB image (h, w, 3), 0 to 1, as PNG."""
    stream = io.BytesIO()
    # None leaves the key out, which the stub of imsave does not know, unlike that of savefig
    imsave(stream, np.clip(image, 0.0, 1.0), format="png", metadata={"Software": None})  # type: ignore[dict-item]
    return stream.getvalue()


def embed(png: bytes) -> str:
    """PNG bytes as base64 text, for the page."""
    return base64.b64encode(png).decode("ascii")
