"""DNG files as phones, converters and mergers write them, byte by byte."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.capture.odd_files import Entry, tiff_directory


def rationals(values: Sequence[float]) -> list[int]:
    return [part for value in values for part in (round(value * 10000), 10000)]


def dng(
    path: Path,
    pixels: np.ndarray,
    *,
    white: int | None,
    black: int | Sequence[Entry] = 0,
    exif: Sequence[Entry] = (),
    opcodes: dict[int, bytes] | None = None,
    nested: bool = False,
    predictor: int | None = None,
) -> Path:
    """A DNG of a mosaic (h, w, 1) of red, green, green, blue, or of linear pixels (h, w, 3).

    ``black``: one level, or the entries that state it. ``nested``: below a thumbnail, as cameras and converters
    write it. ``predictor``: of floats, deflated.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    height, width, channels = pixels.shape
    content = np.ascontiguousarray(pixels).tobytes()
    if predictor is not None:
        content = zlib.compress(predicted(pixels, predictor))

    main = [(271, 2, list(b"Maker\0")), (272, 2, list(b"Model\0")), (50706, 1, [1, 4, 0, 0]),
            (50708, 2, list(b"Maker Model\0")), (50721, 10, rationals([1, 0, 0, 0, 1, 0, 0, 0, 1])),
            (50728, 5, rationals([1, 1, 1])), (50778, 3, [21])]  # fmt: skip

    def picture(start: int) -> list[Entry]:
        found: list[Entry] = [
            (254, 4, [0]), (256, 4, [width]), (257, 4, [height]), (258, 3, [8 * pixels.dtype.itemsize] * channels),
            (259, 3, [1 if predictor is None else 8]), (262, 3, [32803 if channels == 1 else 34892]),
            (273, 4, [start]), (274, 3, [1]), (317, 3, [predictor or 1]),
            (277, 3, [channels]), (278, 4, [height]), (279, 4, [len(content)]), (284, 3, [1]),
            (339, 3, [3 if pixels.dtype.kind == "f" else 1] * channels),
        ]  # fmt: skip
        found += [] if white is None else [(50717, 4, [white] * channels)]
        found += [(50714, 4, [black] * channels)] if isinstance(black, int) else black
        found += [(33421, 3, [2, 2]), (33422, 1, [0, 1, 1, 2])] if channels == 1 else []
        return found + [(tag, 7, list(data)) for tag, data in (opcodes or {}).items()]

    def thumbnail(start: int, below: int) -> list[Entry]:
        return [
            (254, 4, [1]), (256, 4, [4]), (257, 4, [3]), (258, 3, [8] * 3), (259, 3, [1]), (262, 3, [2]),
            (273, 4, [start]), (277, 3, [3]), (278, 4, [3]), (279, 4, [36]), (284, 3, [1]), (330, 4, [below]),
        ]  # fmt: skip

    def laid(start: int, inner: int, below: int, small: int) -> tuple[bytes, bytes]:
        """The first directory, and the picture's own if that is another."""
        more = [(34665, 4, [inner])] if exif else []
        if not nested:
            return tiff_directory([*picture(start), *main, *more], 8), b""
        return tiff_directory([*thumbnail(small, below), *main, *more], 8), tiff_directory(
            picture(start), below
        )

    first, second = laid(0, 0, 0, 0)
    inner = 8 + len(first)
    below = inner + (len(tiff_directory(exif, inner)) if exif else 0)
    small = below + len(second)
    first, second = laid(small + 36, inner, below, small)
    middle = tiff_directory(exif, inner) if exif else b""
    path.write_bytes(b"II*\0" + struct.pack("<I", 8) + first + middle + second + bytes(range(36)) + content)
    return path


def predicted(pixels: np.ndarray, predictor: int) -> bytes:
    """Floats as the predictors 1, 3, 34894 and 34895 have them: bytes by their places, differences along rows."""
    if predictor == 1:
        return np.ascontiguousarray(pixels).tobytes()
    height, width, channels = pixels.shape
    size, stride = pixels.dtype.itemsize, {3: 1, 34894: 2, 34895: 4}[predictor] * channels
    whole = np.ascontiguousarray(pixels.astype(pixels.dtype.newbyteorder(">"))).view(np.uint8)
    rows = whole.reshape(height, width * channels, size).transpose(0, 2, 1).reshape(height, -1)
    differences = rows.copy()
    differences[:, stride:] -= rows[:, :-stride]
    return differences.tobytes()


def opcode(code: int, content: bytes) -> bytes:
    return struct.pack(">4I", code, 0x01030000, 0, len(content)) + content


def opcode_list(*codes: bytes) -> bytes:
    return struct.pack(">I", len(codes)) + b"".join(codes)


def gain_map(
    points: np.ndarray,
    size: tuple[int, int],
    *,
    first: tuple[int, int] = (0, 0),
    pitch: int = 1,
    planes: int = 1,
) -> bytes:
    """Of points (v, h, planes) spread evenly from edge to edge of a picture (height, width)."""
    v, h, depth = points.shape
    head = struct.pack(">10I", *first, *size, 0, planes, pitch, pitch, v, h)
    places = struct.pack(">4d", 1 / (v - 1), 1 / (h - 1), 0.0, 0.0)
    return opcode(9, head + places + struct.pack(">I", depth) + points.astype(">f4").tobytes())


RNG = np.random.default_rng(0)
HEIGHT, WIDTH = 48, 64
EXPOSURE = [(0x829A, 5, [1, 121]), (0x829D, 5, [28, 10])]
LIST1, LIST2, LIST3 = 51008, 51009, 51022


def mosaic(kind: str = "uint16") -> np.ndarray:
    if kind.startswith("float"):
        return RNG.uniform(0, 0.9, (HEIGHT, WIDTH, 1)).astype(kind)
    return RNG.integers(1000, 50000, (HEIGHT, WIDTH, 1)).astype(kind)


def cells(sites: np.ndarray) -> np.ndarray:
    """(h / 2, w / 2, 3) of a mosaic (h, w) of red, green, green, blue."""
    return np.stack([sites[::2, ::2], (sites[::2, 1::2] + sites[1::2, ::2]) / 2, sites[1::2, 1::2]], axis=-1)


def shading(rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Bilinear in the picture: any grid of points has it exactly."""
    y, x = (rows[:, None] + 0.5) / HEIGHT, (columns[None] + 0.5) / WIDTH
    return 1.2 + 0.8 * x + 0.5 * y + 0.6 * x * y


def points(count: tuple[int, int], scale: float = 1.0) -> np.ndarray:
    y, x = np.linspace(0, 1, count[0])[:, None], np.linspace(0, 1, count[1])
    return scale * (1.2 + 0.8 * x + 0.5 * y + 0.6 * x * y)[..., None]
