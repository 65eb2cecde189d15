"""The report: one self-contained HTML page, the same bytes for the same content."""

from __future__ import annotations

import base64
import io
import json
from collections.abc import Mapping
from importlib import resources
from typing import Any

import numpy as np
from jinja2 import Environment, StrictUndefined
from matplotlib.figure import Figure
from matplotlib.image import imsave

from photogonio.report.sections import Report
from photogonio.system.drawing import own_style

_DPI = 150
# of zlib: most of what 6 gains, in half of its time
_COMPRESSION = {"compress_level": 3}


def render_report(report: Report) -> str:
    """The page as HTML text."""
    folder = resources.files("photogonio.report").joinpath("templates")
    text, script = (
        folder.joinpath(name).read_text(encoding="utf-8") for name in ("report.html", "interactive.js")
    )
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    return environment.from_string(text).render(r=report, script=script if report.told else "")


def interactive_text(told: Mapping[str, object]) -> str:
    """JSON that may stand in a page."""
    return json.dumps(told, separators=(",", ":")).replace("<", "\\u003c")


def picture_bytes(figure: Figure, *, kind: str = "png", source: str = "") -> bytes:
    """A figure as PNG or SVG without a date, so that the same figure gives the same bytes.

    ``source`` says where it came from; the file keeps it among its metadata.
    """
    stream = io.BytesIO()
    told: dict[str, Any]
    if kind == "svg":
        told = {"metadata": {"Date": None, "Description": source}}
    else:
        told = {"metadata": {"Software": None, "Comment": source}, "pil_kwargs": _COMPRESSION}
    with own_style():
        figure.savefig(stream, format=kind, dpi=_DPI, **told)
    return stream.getvalue()


def image_bytes(image: np.ndarray) -> bytes:
    """An sRGB image (h, w, 3), 0 to 1, as PNG."""
    stream = io.BytesIO()
    # None leaves the key out, which the stub of imsave does not know, unlike that of savefig
    metadata: dict[str, str] = {"Software": None}  # type: ignore[dict-item]
    with own_style():  # which says where rows begin, too
        imsave(
            stream, np.clip(image, 0.0, 1.0), format="png", metadata=metadata, pil_kwargs=dict(_COMPRESSION)
        )
    return stream.getvalue()


def embed(png: bytes) -> str:
    """PNG bytes as base64 text, for the page."""
    return base64.b64encode(png).decode("ascii")
