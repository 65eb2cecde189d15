"""The text of a photoset.toml of what photos show: board, sample, flash; doubts stand in it as remarks."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from photogonio.capture.manifest.stub import SAMPLE_RADIUS, board_lines, points, quoted, remark
from photogonio.capture.photoset import Plane, PrintedBoard, Sphere

FLASH = "flash"  # id of the light on the camera
STUB_SAMPLE = "# a ball resting on the cross in the middle"  # what the stub says of its example
STUB_BESIDE = (
    "# Polished balls resting on the two rings",
    "# A white reference on the marked square",
)  # likewise
ROUNDED = 2  # digits of a millimetre

PAGE = """\
# A photo set, as its photos show it: see docs/photoset.md. Lengths in mm, x right along the print, y up the page, z out
# of the paper; the origin is the lower-left corner of the printed pattern.
{notes}format = 1
name = {name}
length_unit = "mm"

[board]
{board}

{sample}
{beside}
[radiometry]
encoding = "{encoding}"
"""
BESIDE = """\
# Polished balls show where the lamp is, and a patch of known reflectance gives f in 1/sr. If some lie on the board,
# take out the # and write where, as measured with a ruler (docs/photoset.md). Without a patch the scale is that of the
# paper, or relative.
# [[mirror_ball]]
# center = [15.0, 15.0, 8.0]
# radius = 8.0
# [[white_patch]]
# outline = [[150, 10], [170, 10], [170, 30], [150, 30]]
# reflectance = 0.9
"""


def seen_manifest(
    *,
    name: str,
    board: PrintedBoard,
    sample: str,
    notes: Sequence[str],
    encoding: str,
    flash: bool,
    beside: Iterable[tuple[float, float]] = (),
) -> str:
    """The head of a manifest, without its photos; ``beside``: where something stands beside the sample."""
    page = PAGE.format(
        notes="".join(f"# {remark(line)}\n" for line in notes),
        name=quoted(name),
        board=full_board_lines(board),
        sample=sample,
        encoding=encoding,
        beside=beside_lines(beside),
    )
    return page + (flash_light() if flash else "")


def full_board_lines(board: PrintedBoard) -> str:
    """The board's keys, each on its line."""
    lines = board_lines(board)
    if board.first_id:
        lines += f"\nfirst_id = {board.first_id}"
    if getattr(board, "legacy_pattern", False):
        lines += "\nlegacy_pattern = true"
    return lines


def flash_light() -> str:
    """The light on the camera, whose place the photos tell."""
    return f'\n[[light]]\nid = "{FLASH}"\nattached_to = "camera"\n'


def beside_lines(places: Iterable[tuple[float, float]]) -> str:
    """Examples of polished balls and of a white patch, as remarks, with the ``places`` (x, y) at which something hides
    the print that they may be."""
    found = ", ".join(f"({x:.0f}, {y:.0f})" for x, y in places)
    check = (
        f"# CHECK: beside the sample the print is hidden, or not seen well, about at {found}.\n"
        if found
        else ""
    )
    return check + BESIDE


def sample_lines(sample: Sphere | Plane | None, doubts: Iterable[str] = ()) -> str:
    """The sample's table, with doubts as remarks; without a sample one to be filled in, in the middle of nothing."""
    remarks = "".join(f"# CHECK: {line}\n" for line in doubts)
    if isinstance(sample, Sphere):
        x, y, z = (round(float(v), ROUNDED) for v in sample.center)
        size = round(float(sample.radius), ROUNDED)
        return f'{remarks}[sample]\nshape = "sphere"\ncenter = [{x}, {y}, {z}]\nradius = {size}\n'
    if isinstance(sample, Plane):
        corners = points((float(x), float(y)) for x, y in sample.outline)
        height = round(float(sample.height), ROUNDED)
        return f'{remarks}[sample]\nshape = "plane"\noutline = [{corners}]\nheight = {height}\n'
    radius = SAMPLE_RADIUS
    return f'{remarks}[sample]\nshape = "sphere"\ncenter = [90.0, 70.0, {radius}]\nradius = {radius}\n'


def with_sample(text: str, sample: str) -> str | None:
    """A manifest's text with another sample's table in place of the example that `target` writes; None if somebody has
    changed that."""
    found = re.search(r"^\[sample\][^\n]*\n(?:(?!\[)[^\n]+\n)*", text, re.MULTILINE)
    if found is None or STUB_SAMPLE not in found[0]:
        return None
    # the example's numbers: a radius that is the stub's own, and a centre as high
    if not re.search(rf"^radius = {SAMPLE_RADIUS}$", found[0], re.MULTILINE):
        return None
    return text[: found.start()] + sample + text[found.end() :]
