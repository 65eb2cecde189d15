"""The printable board as a PDF page at true scale."""

from __future__ import annotations

import io

from reportlab.lib.units import mm
from reportlab.pdfgen.canvas import Canvas

from photogonio.capture.photoset import CharucoBoard
from photogonio.capture.target.layout import Target, black_rectangles

RULER = 100  # mm
CARD = 85.6  # mm, the long side of a bank card: ISO/IEC 7810, ID-1
THIN = 0.2  # mm, of lines that corner detection does not see


def pdf_page(target: Target) -> bytes:
    """One page, the same bytes for the same target; to be printed at 100 %, without fitting to the page."""
    buffer = io.BytesIO()
    width, height = target.page
    canvas = Canvas(buffer, pagesize=(width * mm, height * mm), invariant=1, pageCompression=1)
    canvas.setTitle(f"photogonio target, {target.paper}")
    canvas.scale(mm, mm)
    canvas.saveState()
    canvas.translate(*target.corner)
    draw_pattern(canvas, target)
    draw_greys(canvas, target)
    draw_places(canvas, target)
    canvas.restoreState()
    draw_foot(canvas, target)
    canvas.showPage()
    canvas.save()
    return buffer.getvalue()


def draw_pattern(canvas: Canvas, target: Target) -> None:
    """All ink in one path, so that no hairline shows where rectangles touch."""
    path = canvas.beginPath()
    for x, y, width, height in black_rectangles(target).tolist():
        path.rect(x, y, width, height)
    canvas.setFillGray(0.0)
    canvas.drawPath(path, stroke=0, fill=1)


def draw_greys(canvas: Canvas, target: Target) -> None:
    """The strip that tells the tone curve of photos that name none."""
    for grey, corners in target.greys:
        (left, low), (right, high) = corners[0], corners[2]
        canvas.setFillGray(grey)
        canvas.rect(left, low, right - left, high - low, stroke=0, fill=1)


def draw_places(canvas: Canvas, target: Target) -> None:
    """Rings for the balls, the patch's outline, a cross for the sample; thin gray lines, seen on black and
    white.
    """
    canvas.setLineWidth(THIN)
    canvas.setStrokeGray(0.5)
    for x, y in target.balls:
        canvas.circle(x, y, 3.0)
        cross(canvas, x, y, 1.5)
    x, y = target.sample
    cross(canvas, x, y, 6.0)
    canvas.circle(x, y, 4.0)
    (left, low), (right, high) = target.patch[0], target.patch[2]
    inset = 1.0
    canvas.rect(left + inset, low + inset, right - left - 2 * inset, high - low - 2 * inset)


def cross(canvas: Canvas, x: float, y: float, arm: float) -> None:
    canvas.line(x - arm, y, x + arm, y)
    canvas.line(x, y - arm, x, y + arm)


def draw_foot(canvas: Canvas, target: Target) -> None:
    """A ruler of 100 mm and what the board is."""
    left, base = target.corner[0], 6.0
    canvas.setLineWidth(THIN)
    canvas.setStrokeGray(0.0)
    canvas.line(left, base, left + RULER, base)
    for k in range(RULER + 1):
        canvas.line(left + k, base, left + k, base + (4.0 if k % 10 == 0 else 3.0 if k % 5 == 0 else 2.0))
    canvas.line(left + CARD, base - 3.0, left + CARD, base + 5.5)
    board = target.board
    if isinstance(board, CharucoBoard):
        what = f"{board.squares[0]} x {board.squares[1]} squares of {board.square_length:g} mm"
    else:
        what = f"{board.markers[0]} x {board.markers[1]} markers, {board.marker_separation:g} mm apart"
    canvas.setFillGray(0.0)
    canvas.setFont("Helvetica", 2.8)
    lines = (
        f"{board.kind}, {board.dictionary}, {what}, markers {board.marker_length:g} mm",
        "Print at 100 %. This ruler is 100 mm, and a bank card as long as to the tall mark (85.6 mm);",
        "if not, scale the lengths in photoset.toml by what it measures.",
    )
    for k, line in enumerate(lines):
        canvas.drawString(left + RULER + 4.0, base + 4.0 - 3.2 * k, line)
