"""The printed page: the layout at true scale."""

from __future__ import annotations

import re
import zlib

import numpy as np
import pytest

from photogonio.capture.target.layout import KINDS, PAPERS, black_rectangles, make_target
from photogonio.capture.target.pdf import RULER, pdf_page

TARGETS = [(paper, kind) for paper in PAPERS for kind in KINDS]


@pytest.mark.parametrize(("paper", "kind"), TARGETS)
def test_the_page_is_the_layout_at_true_scale(paper, kind):
    """The PDF's own numbers: a page of the paper's size, and each rectangle of ink once, in millimetres."""
    target = make_target(paper=paper, kind=kind)
    data = pdf_page(target)
    assert data == pdf_page(target)
    box = [float(v) for v in re.search(rb"/MediaBox \[ ([\d. ]+)\]", data).group(1).split()]
    assert box == pytest.approx([0, 0, *(v / 25.4 * 72 for v in PAPERS[paper])], abs=1e-3)
    content = unpacked(data)
    scales = [
        tuple(map(float, m)) for m in re.findall(r"([\d.]+) 0 0 ([\d.]+) ([\d.]+) ([\d.]+) cm", content)
    ]
    assert any(s[0] == pytest.approx(72 / 25.4, abs=1e-5) and s[1] == s[0] for s in scales)
    rectangles = np.array(re.findall(r"([-\d.]+) ([-\d.]+) ([-\d.]+) ([-\d.]+) re(?! S)", content), float)
    ink = black_rectangles(target)
    assert len(rectangles) >= len(ink)
    assert np.abs(rectangles[: len(ink)] - ink).max() < 1e-4  # reportlab rounds to 6 decimals or fewer


def unpacked(data: bytes) -> str:
    """The page's drawing commands: ASCII-85 and zlib, as reportlab writes them."""
    import base64

    stream = re.search(rb"stream\s(.*?)~>endstream", data, re.S).group(1)
    return zlib.decompress(base64.a85decode(stream)).decode("latin-1")


@pytest.mark.parametrize(("paper", "kind"), TARGETS)
def test_the_ruler_is_a_hundred_millimetres_from_the_patterns_edge(paper, kind):
    """A base line, and a mark each millimetre that stands on it; what is measured on it scales all lengths."""
    target = make_target(paper=paper, kind=kind)
    content = unpacked(pdf_page(target))
    number = r"([-\d.]+)"
    lines = np.array(re.findall(rf"{number} {number} m {number} {number} l", content), float)
    left = target.corner[0]
    level = lines[(lines[:, 1] == lines[:, 3]) & (np.abs(lines[:, 0] - left) < 1e-3)]
    (base,) = level[np.abs(level[:, 2] - left - RULER) < 1e-3]
    upright = (lines[:, 0] == lines[:, 2]) & (lines[:, 0] > left - 0.5)  # others are crosses of the pattern
    marks = lines[upright & (np.abs(lines[:, 1] - base[1]) < 1e-6)]
    np.testing.assert_allclose(np.sort(marks[:, 0]) - left, np.arange(RULER + 1), atol=1e-3)
    tens = marks[np.round(marks[:, 0] - left) % 10 == 0]
    assert (
        np.ptp(tens[:, 3]) < 1e-6 and tens[0, 3] > marks[np.round(marks[:, 0] - left) % 10 != 0][:, 3].max()
    )
    assert base[1] < target.corner[1]  # below the pattern


def test_other_targets_are_other_pages():
    pages = {pdf_page(make_target(paper=paper, kind=kind)) for paper, kind in TARGETS}
    assert len(pages) == len(TARGETS)
