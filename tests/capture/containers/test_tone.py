"""The tone curve that a file names is found in whatever place it is named."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from photogonio.capture.containers import icc
from photogonio.capture.containers.tone import LINEAR, SRGB, Curve, named, of_cicp, untold
from photogonio.capture.files.images import read_header, read_image
from tests.capture.odd_files import (
    SRGB_TAG,
    app2,
    gamma_tag,
    icc_profile,
    jpeg,
    tiff,
)

CODES = np.linspace(0.0, 1.0, 301)
PICTURE = np.random.default_rng(0).integers(0, 256, (16, 24, 3)).astype(np.uint8)
WIDE = PICTURE.astype(np.uint16) * 257
ADOBE = 563 / 256  # Adobe RGB (1998): 2.19921875


def test_srgb_and_straight_lines_go_by_their_names():
    assert icc.tone_of(icc_profile(SRGB_TAG)).curves == (SRGB,)
    assert named(Curve("gamma", (1.0,))) == LINEAR
    assert named(Curve("gamma", (2.2,))).kind == "gamma"


def test_profiles_in_jpeg_and_tiff(tmp_path):
    profile = icc_profile(gamma_tag(ADOBE), name="Adobe RGB (1998)")
    jpeg(tmp_path / "a.jpg", PICTURE, app2(profile))
    tiff(tmp_path / "a.tif", WIDE, entries=[(34675, 1, list(profile))])
    for name in ("a.jpg", "a.tif"):
        for tone in (read_header(tmp_path / name).tone, read_image(tmp_path / name).tone):
            assert (
                tone.curves == (Curve("gamma", (ADOBE,)),) and tone.source == 'ICC profile "Adobe RGB (1998)"'
            )


@pytest.mark.parametrize(
    ("space", "index", "curve"), [(1, "R98", SRGB), (65535, "R03", "adobe"), (65535, "R98", None)]
)
def test_colour_space_of_exif(tmp_path, space, index, curve):
    jpeg(tmp_path / "a.jpg", PICTURE, (0xE1, exif_block(space, index)))
    tone = read_header(tmp_path / "a.jpg").tone
    assert tone.curves == (SRGB if curve in (SRGB, None) else Curve("gamma", (ADOBE,)),)
    assert tone.told == (curve is not None)


def exif_block(space: int, index: str) -> bytes:
    """EXIF with a ColorSpace and an interoperability index."""
    base = 8
    first = struct.pack("<HHHIII", 1, 0x8769, 4, 1, base + 18, 0)
    inner = struct.pack("<HHHIHHHHIII", 2, 0xA001, 3, 1, space, 0, 0xA005, 4, 1, base + 18 + 30, 0)
    last = struct.pack("<HHHI4sI", 1, 1, 2, 4, index.encode().ljust(4, b"\0"), 0)
    return b"Exif\0\0II*\0" + struct.pack("<I", base) + first + inner + last


def test_openexr_is_linear(tmp_path, files):
    files["oiio"](tmp_path / "a.exr", PICTURE.astype(np.float32), "half")
    tone = read_header(tmp_path / "a.exr").tone
    assert tone.curves == (LINEAR,) and tone.told


def test_broadcast_curves():
    """ITU-R BT.2100: PQ 0.5081 is 100 of 10,000 cd/m^2; HLG 0.5 is 1/12. BT.709: 0.081 is 0.018, rounded."""
    curves = {name: of_cicp(code, "").curves[0] for name, code in (("pq", 16), ("hlg", 18), ("bt709", 1))}
    assert curves["pq"].light(np.array([0.50808, 1.0])) == pytest.approx([0.01, 1.0], rel=1e-3)
    assert curves["hlg"].light(np.array([0.5, 1.0])) == pytest.approx([1 / 12, 1.0], rel=1e-5)
    assert curves["bt709"].light(np.array([0.081, 1.0])) == pytest.approx([0.018, 1.0], rel=5e-3)
    assert of_cicp(2, "") is None and of_cicp(200, "") is None


def test_what_says_nothing_is_taken_by_its_bits():
    assert untold(bits=8, lossy=False).curves == (SRGB,) == untold(bits=16, lossy=True).curves
    assert untold(bits=16, lossy=False).curves == (LINEAR,) == untold(bits=0, lossy=False).curves


def test_smpte_240m():
    """Its transfer function from light to codes, and back."""
    light = np.array([0.0, 0.01, 0.0228, 0.1, 0.5, 1.0])
    code = np.where(light < 0.0228, 4 * light, 1.1115 * light**0.45 - 0.1115)
    assert np.allclose(of_cicp(7, "a chunk").curves[0].light(code), light, atol=2e-4)
