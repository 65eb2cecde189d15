"""What a DNG file says that LibRaw does not act upon: opcodes, the white level of floats, some black levels
(DNG 1.7.1).

Gain maps and radial vignetting are lens shading: their gain is taken as the camera means it. What a warp would do is
found by calibration. Opcodes that bend the scale of light are told.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from photogonio.capture.containers import float_tiles, tiff
from photogonio.capture.containers.dng_black import Black, black_fault, black_of

MOSAIC, LINEAR = 32803, 34892  # of a directory's colours
FLOATS = 3  # a sample's format
PLAIN_COLOURS = (0, 1, 2)  # of a mosaic, in the order of its planes: red, green, blue
WARPS = {1: "WarpRectilinear", 2: "WarpFisheye", 14: "WarpRectilinear2"}
PLAIN = {4: "FixBadPixelsConstant", 5: "FixBadPixelsList", 6: "TrimBounds"}
RADIAL, GAIN_MAP = 3, 9
BENDING = {
    7: "MapTable",
    8: "MapPolynomial",
    10: "DeltaPerRow",
    11: "DeltaPerColumn",
    12: "ScalePerRow",
    13: "ScalePerColumn",
}


class Gain(Protocol):
    """What light is multiplied by."""

    @property
    def most(self) -> float:
        """A bound of it, 1 or more."""
        ...

    def at(
        self, rows: np.ndarray, columns: np.ndarray, size: tuple[int, int], plane: int
    ) -> np.ndarray | float:
        """(rows, columns), at pixels of a picture of ``size`` (height, width)."""
        ...


@dataclass(frozen=True, slots=True)
class GainMap:
    area: tuple[int, int, int, int]  # rows and columns [top, bottom) x [left, right)
    pitch: tuple[int, int]  # rows, columns
    planes: tuple[int, int]  # first, count
    spacing: tuple[float, float]  # of the points, in parts of the picture's height and width
    origin: tuple[float, float]
    points: np.ndarray  # (v, h, planes)

    @property
    def most(self) -> float:
        return max(1.0, float(self.points.max()))

    def at(
        self, rows: np.ndarray, columns: np.ndarray, size: tuple[int, int], plane: int
    ) -> np.ndarray | float:
        """Section 7.3, GainMap: between the points bilinear, beyond them as at the last."""
        top, left, bottom, right = self.area
        if not self.planes[0] <= plane < sum(self.planes):
            return 1.0
        layer = self.points[..., min(plane - self.planes[0], self.points.shape[2] - 1)]
        down = weights(rows, size[0], self.origin[0], self.spacing[0], layer.shape[0])
        across = weights(columns, size[1], self.origin[1], self.spacing[1], layer.shape[1])
        inside = [
            (at >= low) & (at < high) & ((at - low) % pitch == 0)
            for at, low, high, pitch in (
                (rows, top, bottom, self.pitch[0]),
                (columns, left, right, self.pitch[1]),
            )
        ]
        return np.where(inside[0][:, None] & inside[1], down @ layer @ across.T, 1.0)


@dataclass(frozen=True, slots=True)
class Radial:
    terms: tuple[float, ...]  # of r^2, r^4, ...
    centre: tuple[float, float]  # x, y in parts of the picture

    @property
    def most(self) -> float:
        return 1.0 + sum(max(term, 0.0) for term in self.terms)

    def at(
        self, rows: np.ndarray, columns: np.ndarray, size: tuple[int, int], plane: int
    ) -> np.ndarray | float:
        """Section 7.3, FixVignetteRadial: r is 1 at the corner farthest from the centre."""
        height, width = size
        x, y = self.centre[0] * width, self.centre[1] * height
        farthest = max(x, width - x) ** 2 + max(y, height - y) ** 2
        square = ((rows[:, None] + 0.5 - y) ** 2 + (columns[None] + 0.5 - x) ** 2) / farthest
        return 1.0 + sum(term * square ** (k + 1) for k, term in enumerate(self.terms))


@dataclass(frozen=True, slots=True)
class Dng:
    gains: tuple[Gain, ...] = ()
    notes: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    white: float | None = None  # of floats
    picture: tuple[Path, tiff.Tags] | None = None  # the file, and the directory that has the picture
    black: Black | None = None  # where LibRaw does not tell it whole
    cells: tuple[int, ...] | None = None  # rows and columns in which the mosaic's colours repeat
    unread: str = ""  # what it has that LibRaw reads as something else, in words

    def floats(self) -> np.ndarray | None:
        """The picture (h, w, samples) of a file of floats, as stored. Raises ValueError, saying why, if it cannot be
        had."""
        if self.white is None or self.picture is None:
            return None
        found = float_tiles.picture(*self.picture)
        if found is None:
            raise ValueError(
                "is a DNG of floats that are stored in a way that is not read; write it as OpenEXR"
            )
        if not np.isfinite(found).all():
            y, x, _ = np.argwhere(~np.isfinite(found))[0]
            raise ValueError(f"a pixel is not finite, first at x {x}, y {y}")
        return found

    @property
    def most(self) -> float:
        """A bound of the gain."""
        found = 1.0
        for gain in self.gains:
            found *= gain.most
        return found

    def gain(
        self, rows: np.ndarray, columns: np.ndarray, size: tuple[int, int], plane: int = 0
    ) -> np.ndarray | float:
        """Of all of them, (rows, columns); 1 without any."""
        found: np.ndarray | float = 1.0
        for gain in self.gains:
            found = found * gain.at(rows, columns, size, plane)
        return found


def about(path: Path) -> Dng:
    """Of a RAW file of any make; empty where it is no DNG."""
    with path.open("rb") as file:
        if file.read(4) not in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+") or not tiff.is_dng(file):
            return Dng()
        every = list(tiff.with_children(file))
    pictures = [tags for tags in every if tags.get(tiff.PHOTOMETRIC) in ((MOSAIC,), (LINEAR,))]
    full = [tags for tags in pictures if not tags.get(tiff.SUBFILE, (0,))[0] & tiff.REDUCED] or pictures
    if not full:
        return Dng()
    tags = max(full, key=lambda one: one.get(tiff.WIDTH, (0,))[0])
    found = [one for tag in tiff.OPCODES for one in opcodes(bytes(tags.get(tag, ())))]
    gains = [gain for code, content in found if (gain := gain_of(code, content)) is not None]
    white = float(tags.get(tiff.WHITE, (1,))[0]) if FLOATS in tags.get(tiff.FORMAT, ()) else None
    black = black_of(tags, always=white is not None)  # LibRaw has none of floats
    cells = tags.get(tiff.CELLS) if tags.get(tiff.PHOTOMETRIC) == (MOSAIC,) else None
    notes, doubts = told([code for code, _ in found], gains)
    return Dng(tuple(gains), notes, doubts, white, (path, tags), black, cells, unread(tags))


def unread(tags: tiff.Tags) -> str:
    """What of a picture LibRaw takes for something else, in words; empty where it takes all as it is meant."""
    floats = FLOATS in tags.get(tiff.FORMAT, ())
    samples = tags.get(tiff.SAMPLES, (1,))[0]
    if tags.get(tiff.PLANAR, (1,))[0] != 1 and samples > 1 and not floats:
        return "keeps its colours in planes of their own, where they are not read; expected pixel by pixel"
    if tags.get(tiff.PHOTOMETRIC) == (MOSAIC,):
        colours, layout = tags.get(tiff.CELL_COLOURS, PLAIN_COLOURS), tags.get(tiff.LAYOUT, (1,))
        if colours != PLAIN_COLOURS:
            return f"has a mosaic of the colours {' '.join(map(str, colours))}; expected red, green and blue (0 1 2)"
        if layout != (1,):
            return f"has a mosaic whose rows are set off (CFALayout {layout[0]}); expected a rectangular one"
    return f"states {fault}" if (fault := black_fault(tags)) else ""


def told(codes: Iterable[int], gains: list[Gain]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What was done and left, in words, and what is to be doubted."""
    codes = list(codes)
    notes: tuple[str, ...] = (
        ("has its lens shading taken out by its own gains (DNG opcodes)",) if gains else ()
    )
    warps = [WARPS[code] for code in codes if code in WARPS]
    if warps:
        notes += (f"asks for {', '.join(dict.fromkeys(warps))}, which is left to calibration",)
    known = {RADIAL, GAIN_MAP, *WARPS, *PLAIN}
    lost = [BENDING.get(code, f"opcode {code}") for code in codes if code not in known]
    if sum(code in (RADIAL, GAIN_MAP) for code in codes) > len(gains):
        lost.append("a damaged gain map")
    doubts = (f"asks for {', '.join(dict.fromkeys(lost))} (DNG opcodes), which is not done",) if lost else ()
    return notes, doubts


def opcodes(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Numbers and parameters of an opcode list."""
    if len(data) < 4:
        return
    (count,) = struct.unpack_from(">I", data)
    place = 4
    for _ in range(count):
        if place + 16 > len(data):
            return
        code, _, _, size = struct.unpack_from(">4I", data, place)
        yield code, data[place + 16 : place + 16 + size]
        place += 16 + size


def gain_of(code: int, content: bytes) -> Gain | None:
    """The gain that an opcode asks for; None if it asks for none, or is damaged."""
    try:
        if code == RADIAL:
            *terms, x, y = struct.unpack_from(">7d", content)
            return Radial(tuple(terms), (x, y)) if np.isfinite([*terms, x, y]).all() else None
        return gain_map(content) if code == GAIN_MAP else None
    except (struct.error, ValueError):
        return None


def gain_map(content: bytes) -> GainMap:
    *numbers, v, h = struct.unpack_from(">10I", content)
    spacing_v, spacing_h, origin_v, origin_h = struct.unpack_from(">4d", content, 40)
    (planes,) = struct.unpack_from(">I", content, 72)
    points = np.frombuffer(content, ">f4", v * h * planes, 76).astype(float).reshape(v, h, planes)
    if not (points.size and np.isfinite(points).all() and (points > 0).all() and min(numbers[6:8]) > 0):
        raise ValueError("damaged")
    return GainMap(
        tuple(numbers[:4]),
        (numbers[6], numbers[7]),
        (numbers[4], numbers[5]),
        (spacing_v, spacing_h),
        (origin_v, origin_h),
        points,
    )


def weights(at: np.ndarray, length: int, origin: float, spacing: float, count: int) -> np.ndarray:
    """(n, count): how much each point counts at each pixel."""
    place = ((at + 0.5) / length - origin) / spacing if count > 1 and spacing > 0 else np.zeros(len(at))
    place = np.clip(place, 0, count - 1)
    low = np.minimum(place.astype(int), max(count - 2, 0))
    found = np.zeros((len(at), count))
    found[np.arange(len(at)), low] = 1 - (place - low)
    if count > 1:
        found[np.arange(len(at)), low + 1] = place - low
    return found
