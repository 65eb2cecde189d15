"""An evaluation as a page: what was compared with known truth, and how far off it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from photogonio.report.html import render_report
from photogonio.report.page import provenance_table
from photogonio.report.sections import Picture, Report, Section, Table
from photogonio.system.outputs import plain
from photogonio.system.provenance import Provenance


def evaluation_html(
    scores: Mapping[str, Sequence[Mapping[str, object]]], source: Provenance, *, tradeoff: str = ""
) -> str:
    """The page of scores, which are rows of values by a title each; ``tradeoff``: a picture, base64 of PNG."""
    counts = [f"{len(rows)} {name}" for name, rows in scores.items() if rows]
    pictures = (
        [Picture("Speed against error", "Each dot is a setting of the fit.", tradeoff)] if tradeoff else []
    )
    lead = "Results against what is known by other means: " + (", ".join(counts) or "nothing") + "."
    return render_report(
        Report(
            title="Evaluation",
            kind="evaluation",
            lead=lead,
            tables=[Section(name.capitalize(), _table(rows)) for name, rows in scores.items() if rows],
            pictures=pictures,
            provenance=provenance_table(source),
        )
    )


def _table(rows: Sequence[Mapping[str, object]]) -> Table:
    """Columns in the order in which rows first have them, turned round where there are few rows and many columns."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    cells = [[_text(row.get(name)) for name in names] for row in rows]
    if len(names) <= 2 * len(rows):
        return Table(names, cells)
    heads, columns = [row[0] for row in cells], zip(*(row[1:] for row in cells), strict=True)
    rows_of = [(name, *column) for name, column in zip(names[1:], columns, strict=True)]
    return Table((names[0], *heads), rows_of)


def _text(value: object) -> str:
    value = plain(value)
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return " · ".join(map(_text, value))
    if isinstance(value, dict):
        return ", ".join(f"{name} {_text(one)}" for name, one in value.items())
    return "–" if value is None else str(value)
