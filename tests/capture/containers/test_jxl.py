"""JPEG XL: its EXIF, and what its decoder does by itself."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from photogonio.capture.containers import jxl
from photogonio.capture.files.images import read_header, read_image
from tests.capture.dng_files import HEIGHT, WIDTH
from tests.capture.odd_files import exif_block, gamma_tag, icc_profile
from tests.capture.phone_files import ADOBE, smooth


@pytest.mark.parametrize("kind", ["uint8", "uint16", "half", "float"])
def test_jpeg_xl(tmp_path, files, kind):
    whole = np.uint8 if kind == "uint8" else np.uint16
    written = smooth(whole)
    pixels = written if kind.startswith("uint") else (written / 65535).astype(np.float32)
    profile = icc_profile(gamma_tag(ADOBE), name="Adobe RGB (1998)")
    path = tmp_path / "a.jxl"
    with_profile(path, pixels, kind, profile, compression="jpegxl:100")
    image = read_image(path)
    tolerance = 3 * (1 if kind == "uint8" else 257) if kind.startswith("uint") else 3 / 255
    assert np.abs(image.pixels.astype(float) - pixels).max() <= tolerance
    assert image.tone.curves[0].numbers[0] == pytest.approx(ADOBE, abs=1e-4)


def with_profile(path: Path, pixels: np.ndarray, kind: str, profile: bytes, **more: object) -> None:
    spec = oiio.ImageSpec(WIDTH, HEIGHT, 3, kind)
    spec.attribute(
        "ICCProfile", oiio.TypeDesc(f"uint8[{len(profile)}]"), np.frombuffer(profile, np.uint8).copy()
    )
    for name, value in more.items():
        spec.attribute(name, value)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec) and file.write_image(pixels), file.geterror()
    file.close()


def test_exif_of_jpeg_xl(tmp_path, files):
    path = tmp_path / "a.jxl"
    files["oiio"](path, smooth(), "uint8")
    block = bytes(4) + exif_block().removeprefix(b"Exif\0\0")
    path.write_bytes(path.read_bytes() + struct.pack(">I4s", 8 + len(block), b"Exif") + block)
    assert read_header(path).exposure.exposure_time == 1 / 64


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ([(1, 1), (5, 5), (3, 1), (1, 1)], 1),  # small, ratio 1 : 1, all as usual
        ([(1, 0), (13 + 2, 1 | 47 << 2), (3, 0), (9 + 2, 0 | 63 << 2), (1, 0), (1, 1), (3, 5)], 6),
        ([(1, 1), (5, 5), (3, 0), (5, 7), (1, 0), (1, 1), (3, 2)], 3),
        ([(1, 1), (5, 5), (3, 1), (1, 0), (1, 0)], 1),
    ],
)
def test_the_orientation_in_a_codestream(fields, expected):
    """Fields are packed from the lowest bit up (ISO/IEC 18181-1, sections 9 and D)."""
    value, place = 0, 0
    for width, field in fields:
        value |= field << place
        place += width
    assert jxl.orientation(b"\xff\x0a" + value.to_bytes(16, "little")) == expected
