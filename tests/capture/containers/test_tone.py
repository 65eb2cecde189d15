"""The tone curve that a file names is found in whatever place it is named."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from photogonio.capture.containers import icc
from photogonio.capture.containers.tone import LINEAR, SRGB, Curve, named, of_cicp, untold
from photogonio.capture.files.images import read_header, read_image
from tests.capture.odd_files import (
    SRGB_CHRM,
    SRGB_TAG,
    app2,
    gama,
    gamma_tag,
    icc_profile,
    iccp,
    jpeg,
    parametric_tag,
    png,
    table_tag,
    tiff,
)

CODES = np.linspace(0.0, 1.0, 301)
PICTURE = np.random.default_rng(0).integers(0, 256, (16, 24, 3)).astype(np.uint8)
WIDE = PICTURE.astype(np.uint16) * 257
ADOBE = 563 / 256  # Adobe RGB (1998): 2.19921875
PROPHOTO = parametric_tag(3, 1.8, 1.0, 0.0, 1 / 16, 0.031248)


def srgb_light(code: np.ndarray) -> np.ndarray:
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def prophoto_light(code: np.ndarray) -> np.ndarray:
    return np.where(code < 0.031248, code / 16, code**1.8)


@pytest.mark.parametrize(
    ("tag", "light"),
    [
        (gamma_tag(ADOBE), lambda x: x**ADOBE),
        (parametric_tag(0, 1.8), lambda x: x**1.8),
        (parametric_tag(1, 2.0, 1.25, -0.25), lambda x: np.maximum(1.25 * x - 0.25, 0) ** 2),
        (parametric_tag(2, 2.0, 1.25, -0.25, 0.1), lambda x: np.maximum(1.25 * x - 0.25, 0) ** 2 + 0.1),
        (PROPHOTO, prophoto_light),
        (SRGB_TAG, srgb_light),
        (parametric_tag(4, 2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045, 0.0, 0.0), srgb_light),
        (table_tag(np.linspace(0, 1, 1024) ** 1.9), lambda x: x**1.9),
        (table_tag(srgb_light(np.linspace(0, 1, 1024))), srgb_light),
        (b"curv" + bytes(8), lambda x: x),
    ],
)
def test_curves_of_profiles(tag, light):
    """Numbers of 16 binary places, and tables of 1024 steps, leave less than 1e-3 of full scale."""
    tone = icc.tone_of(icc_profile(tag, name="some name"))
    assert len(tone.curves) == 1 and tone.source == 'ICC profile "some name"'
    assert np.abs(tone.curves[0].light(CODES) - light(CODES)).max() < 1e-3


def test_profiles_with_a_curve_a_channel_and_of_gray():
    three = icc.tone_of(icc_profile(gamma_tag(1.8), gamma_tag(2.0), gamma_tag(2.25)))
    assert [curve.numbers[0] for curve in three.curves] == pytest.approx([1.8, 2.0, 2.25], abs=1 / 256)
    gray = icc.tone_of(icc_profile(gamma_tag(2.0), space=b"GRAY"))
    assert gray.curves == (Curve("gamma", (2.0,)),)


def test_damaged_profiles_are_refused_and_never_end_otherwise():
    whole = icc_profile(SRGB_TAG)
    for length in range(0, len(whole), 3):
        try:
            icc.tone_of(whole[:length])
        except ValueError as error:
            assert str(error)
    for k in range(len(whole)):
        damaged = bytearray(whole)
        damaged[k] ^= 0xFF
        try:
            icc.tone_of(bytes(damaged))
        except ValueError as error:
            assert str(error)
    with pytest.raises(ValueError, match="CMYK"):
        icc.tone_of(whole[:16] + b"CMYK" + whole[20:])


def test_srgb_and_straight_lines_go_by_their_names():
    assert icc.tone_of(icc_profile(SRGB_TAG)).curves == (SRGB,)
    assert named(Curve("gamma", (1.0,))) == LINEAR
    assert named(Curve("gamma", (2.2,))).kind == "gamma"


@pytest.mark.parametrize(
    ("chunks", "curve"),
    [
        ([], None),
        ([(b"sRGB", b"\0")], SRGB),
        ([gama(2.2), SRGB_CHRM], SRGB),  # as writers of sRGB do it that do not know its chunk
        ([gama(1.0)], LINEAR),
        ([gama(1.8)], Curve("gamma", (1e5 / 55556,))),
        ([gama(2.2)], Curve("gamma", (1e5 / 45455,))),
        ([(b"cICP", bytes([1, 8, 0, 1])), (b"sRGB", b"\0")], LINEAR),
        ([(b"cICP", bytes([9, 16, 0, 1]))], Curve("pq")),
        ([(b"cICP", bytes([1, 2, 0, 1])), iccp(icc_profile(gamma_tag(ADOBE)))], Curve("gamma", (ADOBE,))),
        ([iccp(icc_profile(gamma_tag(ADOBE))), gama(1.0)], Curve("gamma", (ADOBE,))),
    ],
)
@pytest.mark.parametrize("codes", [PICTURE, WIDE], ids=["8", "16"])
def test_chunks_of_png(tmp_path, codes, chunks, curve):
    """The specification's order: cICP, iCCP, sRGB, gAMA; without any, 8 bits are sRGB and 16 linear."""
    path = png(tmp_path / "a.png", codes, *chunks)
    tone = read_header(path).tone
    expected = curve or (SRGB if codes.dtype == np.uint8 else LINEAR)
    assert tone.curves == (expected,) and tone.told == (curve is not None)
    image = read_image(path)
    assert image.tone == tone and np.array_equal(image.pixels, codes)


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


def test_a_profile_that_cannot_be_used_is_told(tmp_path):
    tables = icc_profile(SRGB_TAG).replace(b"rTRC", b"A2B0")
    path = png(tmp_path / "a.png", PICTURE, iccp(tables))
    header = read_header(path)
    assert not header.tone.told and header.tone.curves == (SRGB,)
    assert "no tone curve" in header.doubts[0] and "sRGB" in header.doubts[0]
    path = png(tmp_path / "b.png", PICTURE, (b"iCCP", b"x\0\0 not compressed"))
    assert "damaged" in read_header(path).doubts[0]


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
