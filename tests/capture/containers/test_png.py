"""What the chunks of a PNG say of its tone curve."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.containers.tone import LINEAR, SRGB, Curve
from photogonio.capture.files.images import read_header, read_image
from tests.capture.odd_files import (
    SRGB_CHRM,
    gama,
    gamma_tag,
    icc_profile,
    iccp,
    png,
)

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
