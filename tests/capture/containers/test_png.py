"""What the chunks of a PNG say of its tone curve."""

from __future__ import annotations

import struct
import zlib
from itertools import pairwise

import numpy as np
import pytest

from photogonio.capture.containers.integrity import PNG_SIGNATURE
from photogonio.capture.containers.png import about, pixel_stream, spans, tone_of
from photogonio.capture.containers.tone import LINEAR, SRGB, Curve
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import read_header, read_image
from tests.capture.odd_files import (
    SRGB_CHRM,
    exif_block,
    gama,
    gamma_tag,
    icc_profile,
    iccp,
    png,
)
from tests.drawn import png_files

PICTURE = np.random.default_rng(0).integers(0, 256, (16, 24, 3)).astype(np.uint8)
WIDE = PICTURE.astype(np.uint16) * 257
ADOBE = 563 / 256  # Adobe RGB (1998): 2.19921875


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
        ([(b"cICP", bytes([1, 12, 0, 1]))], Curve("bt709")),
        ([(b"cICP", bytes([12, 17, 0, 1]))], Curve("gamma", (2.6,))),
        ([gama(1.0), gama(2.2)], LINEAR),  # a second is no PNG's: decoders pass over it
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


@pytest.mark.parametrize("gamma", [0, 45454, 45456, 45453, 45457])
def test_a_screens_gamma_is_srgb_to_its_rounding_and_none_is_nothing(tmp_path, gamma):
    """100,000 / 2.2 is 45454.5: writers give the one or the other, and sRGB's primaries beside it."""
    path = png(tmp_path / "a.png", PICTURE, (b"gAMA", struct.pack(">I", gamma)), SRGB_CHRM)
    found = tone_of(about(path))
    if gamma == 0:
        assert found is None
    elif abs(gamma - 45455) <= 1:
        assert found.curves == (SRGB,)
    else:
        assert found.curves == (Curve("gamma", (1e5 / gamma,)),)


def test_other_primaries_make_no_srgb(tmp_path):
    wide = struct.pack(">8I", 31270, 32900, 70800, 29200, 17000, 79700, 13100, 4600)  # ITU-R BT.2020
    found = tone_of(about(png(tmp_path / "a.png", PICTURE, gama(2.2), (b"cHRM", wide))))
    assert found.curves[0].kind == "gamma" and found.source == "gAMA chunk"


def test_chunks_of_other_lengths_than_the_standards_say_nothing(tmp_path):
    for chunk in ((b"gAMA", b"\0\0\1"), (b"cICP", b"\1"), (b"cHRM", bytes(31))):
        assert tone_of(about(png(tmp_path / "a.png", PICTURE, chunk))) is None
    (tmp_path / "b.png").write_bytes(b"no PNG")
    assert tone_of(about(tmp_path / "b.png")) is None


def test_chunks_behind_the_pixels_are_not_looked_at(tmp_path):
    """PNG specification, table 7: they stand before IDAT."""
    whole = png(tmp_path / "a.png", PICTURE).read_bytes()
    late = png(tmp_path / "b.png", PICTURE, gama(1.8)).read_bytes()[33 : 33 + 16]  # one chunk, whole
    (tmp_path / "a.png").write_bytes(whole[:-12] + late + whole[-12:])
    assert tone_of(about(tmp_path / "a.png")) is None


@pytest.mark.parametrize("gamma", [1, 900, 10_000_000, 0xFFFFFFFF])
def test_a_gamma_that_no_codes_have_is_told(tmp_path, gamma):
    path = png(tmp_path / "a.png", PICTURE, (b"gAMA", struct.pack(">I", gamma)))
    found = read_header(path)
    assert found.tone.curves == (SRGB,) and not found.tone.told and "gAMA" in found.doubts[0]


@pytest.mark.parametrize("transfer", [9, 10])
def test_logarithmic_codes_are_told(tmp_path, transfer):
    found = read_header(png(tmp_path / "a.png", WIDE, (b"cICP", bytes([1, transfer, 0, 1]))))
    assert not found.tone.told and "logarithmic" in found.doubts[0]


def test_codes_of_narrow_range_are_refused(tmp_path):
    """16 to 235 of 255 stand for black and white there."""
    with pytest.raises(InputError, match=r"a\.png: .*narrow range"):
        read_image(png(tmp_path / "a.png", PICTURE, (b"cICP", bytes([1, 13, 0, 0]))))


@pytest.mark.parametrize(
    ("chunks", "told"),
    [
        ([(b"sRGB", b"\0"), gama(1.0)], "sRGB by its sRGB chunk and linear by its gAMA chunk"),
        ([iccp(icc_profile(gamma_tag(1.0))), gama(2.2)], "linear by its ICC profile"),
        ([(b"cICP", bytes([1, 8, 0, 1])), gama(2.2)], "linear by its cICP chunk"),
        ([(b"sRGB", b"\0"), gama(2.2)], None),  # as the standard asks for
        ([iccp(icc_profile(gamma_tag(ADOBE))), gama(2.2)], None),
        ([iccp(icc_profile(gamma_tag(1.8))), gama(1.8)], None),
    ],
)
def test_chunks_that_contradict_are_told(tmp_path, chunks, told):
    doubts = read_header(png(tmp_path / "a.png", PICTURE, *chunks)).doubts
    assert told in doubts[0] if told else not doubts


def test_exif_behind_the_pixels_says_the_exposure(tmp_path):
    """PNG, third edition, 11.3.2.5: it may stand anywhere between IHDR and IEND."""
    path = png(tmp_path / "a.png", WIDE)
    whole, block = path.read_bytes(), exif_block()[6:]
    chunk = struct.pack(">I", len(block)) + b"eXIf" + block + struct.pack(">I", zlib.crc32(b"eXIf" + block))
    path.write_bytes(whole[:-12] + chunk + whole[-12:])
    exposure = read_header(path).exposure
    assert (exposure.exposure_time, exposure.f_number, exposure.iso) == (1 / 64, 2.8, 100)
    assert np.array_equal(read_image(path).pixels, WIDE)


def test_a_file_in_memory_tells_what_it_tells_on_disk(tmp_path):
    path = png(tmp_path / "a.png", WIDE, gama(1.8), gama(2.2))
    whole, block = path.read_bytes(), exif_block()[6:]
    behind = png_files.chunk(b"eXIf", block)
    path.write_bytes(whole[:-12] + behind + png_files.chunk(*gama(1.0)) + whole[-12:] + behind)
    found = about(path)
    assert found == about(path, path.read_bytes())
    assert found[b"eXIf"] == block
    assert found[b"gAMA"] == struct.pack(">I", round(1e5 / 1.8))


@pytest.mark.parametrize("lengths", [[5], [4, 4, 4, 3], [1, 2, 2, 7, 7, 0, 7], []])
def test_pixels_in_chunks_of_any_lengths_are_one_stream(lengths):
    stream = np.random.default_rng(len(lengths)).bytes(sum(lengths))
    cuts = np.cumsum([0, *lengths])
    parts = [png_files.chunk(b"IDAT", stream[a:b]) for a, b in pairwise(cuts)]
    head, end = png_files.chunk(b"IHDR", bytes(13)), png_files.chunk(b"IEND", b"")
    data = PNG_SIGNATURE + head + b"".join(parts) + end
    found = list(spans(data))
    assert [kind for kind, *_ in found] == [b"IHDR", *[b"IDAT"] * bool(lengths), b"IEND"]
    assert b"".join(data[a:b] for _, a, b in found) == data[len(PNG_SIGNATURE) :]
    for kind, start, stop in found:
        if kind == b"IDAT":
            assert pixel_stream(data, start, stop).tobytes() == stream
    cut = [kind for kind, *_ in spans(data[:-1])]  # of what is cut off nothing is said
    assert cut == [kind for kind, *_ in found[:-1]]
