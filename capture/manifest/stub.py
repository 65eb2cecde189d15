"""The text of a photoset.toml to begin with: of a printed target, and of the photos in a folder."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from photogonio.capture.photoset import CharucoBoard, Photo, PrintedBoard
from photogonio.capture.target.layout import Target

BALL_RADIUS = 8.0  # mm
SAMPLE_RADIUS = 25.0
PLANE_HALF = (35.0, 28.0)  # of the example of a flat sample
FIELDS = ("light", "exposure_time", "f_number", "iso", "bracket")

HEAD = """\
# A photo set: see docs/photoset.md. Lengths in mm, x right along the print, y up the page, z out of the paper;
# the origin is the lower-left corner of the printed pattern.
# Photos of the bare board go into calibration/, of the sample under the lamp into sample/ (others: probe/, dark/,
# flat/, ambient/, chart/); then `photogonio init FOLDER` adds them here.
format = 1
name = {name}
length_unit = "mm"

[board]                          # measure the printed ruler: if it is not 100 mm, scale all lengths by what it is
{board}

[sample]                         # a ball resting on the cross in the middle
shape = "sphere"
center = [{x:.2f}, {y:.2f}, {radius}]
radius = {radius}
# shape = "plane"                # or a flat sample, with its corners and its surface's height above the paper
# outline = [{plane}]
# height = 0.5

# Polished balls resting on the two rings: their true radius, once as the centre's height.
{balls}

# A white reference on the marked square; without one delete this, and the result is relative.
[[white_patch]]
outline = [{patch}]
height = 0.0                     # its thickness
reflectance = 0.9                # as measured

# The printed strip of greys, from which encoding = "unknown" learns a phone's tone curve; how dark they are need not
# be known.
{greys}

[radiometry]
encoding = "{encoding}"                # "auto": as each file says, else 8 bits are "srgb" and all others "linear"
"""


def stub_manifest(target: Target, *, name: str = "my-set", encoding: str = "auto") -> str:
    """A manifest without photos, for the sample, the balls and the patch in the target's places."""
    x, y = target.sample
    dx, dy = PLANE_HALF
    corners = [(x - dx, y - dy), (x + dx, y - dy), (x + dx, y + dy), (x - dx, y + dy)]
    balls = "\n".join(
        f"[[mirror_ball]]\ncenter = [{x:.2f}, {y:.2f}, {BALL_RADIUS}]\nradius = {BALL_RADIUS}"
        for x, y in target.balls
    )
    return HEAD.format(
        name=quoted(name),
        board=board_lines(target.board),
        x=x,
        y=y,
        radius=SAMPLE_RADIUS,
        plane=points(corners),
        balls=balls,
        patch=points(target.patch),
        greys="\n".join(f"[[grey_patch]]\noutline = [{points(corners)}]" for _, corners in target.greys),
        encoding=encoding,
    )


def board_lines(board: PrintedBoard) -> str:
    lines = [f'kind = "{board.kind}"', f'dictionary = "{board.dictionary}"']
    if isinstance(board, CharucoBoard):
        lines += [
            f"squares = [{board.squares[0]}, {board.squares[1]}]",
            f"square_length = {board.square_length:g}",
        ]
    else:
        lines += [
            f"markers = [{board.markers[0]}, {board.markers[1]}]",
            f"marker_separation = {board.marker_separation:g}",
        ]
    return "\n".join([*lines, f"marker_length = {board.marker_length:g}"])


def points(corners: Iterable[tuple[float, float]]) -> str:
    return ", ".join(f"[{x:.2f}, {y:.2f}]" for x, y in corners)


def photo_tables(photos: Iterable[Photo]) -> str:
    """``[[photo]]`` tables, each key on its line."""
    blocks = []
    for photo in photos:
        lines = ["[[photo]]", f"file = {quoted(photo.file)}", f'role = "{photo.role}"']
        for name in FIELDS:
            value = getattr(photo, name)
            if value is not None:
                lines.append(f"{name} = {quoted(value) if isinstance(value, str) else f'{value:.9g}'}")
        blocks.append("\n".join(lines))
    return "\n\n".join(blocks) + "\n"


def remark(text: str) -> str:
    """Text that may stand in a remark: without what would end its line, or TOML forbids there."""
    return "".join(letter if letter.isprintable() else " " for letter in text)


def quoted(text: str) -> str:
    """A TOML basic string."""
    escapes: Mapping[str, str] = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\t": "\\t", "\r": "\\r"}
    known = (escapes.get(letter, letter) for letter in text)
    return '"' + "".join(f"\\u{ord(one):04x}" if one < " " or one == "\x7f" else one for one in known) + '"'
