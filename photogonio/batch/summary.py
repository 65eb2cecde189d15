"""All results of a batch in one table and on one page."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from urllib.parse import quote

import numpy as np
from jinja2 import Environment, StrictUndefined

from photogonio.batch.ledger import SetEntry
from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import load_brdf
from photogonio.report.ball import BALL_LIGHTS, shaded_sphere, to_display
from photogonio.report.html import embed, image_bytes

COLUMNS = (
    "set",
    "status",
    "model",
    "albedo",
    "error",
    "roughness",
    "misfit",
    "photos",
    "left_out",
    "warnings",
    "said",
    "scale",
)
_BALL = 96  # pixels


def row_of(entry: SetEntry) -> dict[str, object]:
    """One line of the table; empty where there is no result."""
    n = entry.numbers
    return {
        "set": entry.set,
        "status": entry.status,
        "model": n.get("model", ""),
        "albedo": _mean(n.get("albedo")),
        "error": _mean(n.get("error")),
        "roughness": _number(n.get("roughness")),
        "misfit": _mean(n.get("relative_median")),
        "photos": n.get("photos_used", ""),
        "left_out": n.get("left_out", ""),
        "warnings": " ".join(map(str, _listed(n.get("warnings")))),
        "said": entry.said,
        "scale": n.get("scale", ""),
    }


def table_text(entries: Sequence[SetEntry]) -> str:
    """summary.csv."""
    stream = io.StringIO()
    writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(row_of(entry) for entry in entries)
    return stream.getvalue()


def page_text(entries: Sequence[SetEntry], out: Path, learned: Sequence[str] = ()) -> str:
    """summary.html: a ball of each material, to be sorted; and what was ``learned`` of their rigs, in words."""
    text = resources.files("photogonio.report").joinpath("templates/summary.html").read_text(encoding="utf-8")
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    cards = [
        {
            **row_of(entry),
            "ball": ball_of(out / entry.set) if entry.finished else "",
            "report": quote(os.fsencode(f"{entry.set}/report.html")) if entry.finished else "",
            "count": len(_listed(entry.numbers.get("warnings"))),
        }
        for entry in entries
    ]
    return environment.from_string(text).render(cards=cards, learned=learned)


def ball_of(folder: Path) -> str:
    """A ball lit over the shoulder as base64 PNG; empty where the coefficients cannot be read."""
    try:
        brdf = load_brdf(folder / "coefficients.json")
    except InputError:
        return ""
    radiance = shaded_sphere(brdf, BALL_LIGHTS["over the shoulder"], size=_BALL)
    return embed(image_bytes(to_display(radiance, white=1.0)))


def _listed(value: object) -> list[object]:
    return list(value) if isinstance(value, (list, tuple)) else []


def _mean(value: object) -> str:
    try:
        numbers = np.array([] if value is None else value, float).ravel()
    except (TypeError, ValueError):  # a ledger may say anything
        return ""
    return f"{numbers.mean():.4g}" if numbers.size and np.isfinite(numbers).all() else ""


def _number(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, (int, float)) and np.isfinite(value) else ""
