"""Files of phones and browsers: HEIC, AVIF, JPEG XL, WebP, BMP, and JPEG with more in it than a picture."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from photogonio.capture.containers.tone import SRGB, Curve
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import read_header, read_image
from tests.capture.odd_files import exif_block, gamma_tag, icc_profile
from tests.capture.phone_files import ADOBE, heic, near, smooth


def test_heic(tmp_path):
    assert near(heic(tmp_path / "a.heic", smooth(), exif=exif_block()), smooth(), 3)
    exposure = read_header(tmp_path / "a.heic").exposure
    assert (exposure.exposure_time, exposure.f_number, exposure.iso) == (1 / 64, 2.8, 100)
    assert read_header(tmp_path / "a.heic").tone.curves == (SRGB,)
    assert read_image(tmp_path / "a.heic").lossy


def test_heic_of_ten_bits_keeps_its_codes(tmp_path):
    codes = smooth(np.uint16) >> 6
    assert near(heic(tmp_path / "a.heic", codes, bits=10), codes, 4)
    assert read_image(tmp_path / "a.heic").full_scale == 1023


def test_heic_gray_and_its_profile(tmp_path):
    path = heic(
        tmp_path / "a.heic", smooth(), icc_profile=icc_profile(gamma_tag(ADOBE), name="Adobe RGB (1998)")
    )
    assert read_header(path).tone.curves == (Curve("gamma", (ADOBE,)),)
    assert near(heic(tmp_path / "b.heic", smooth()[..., :1]), smooth()[..., :1], 3)


@pytest.mark.parametrize("bits", [8, 10, 12])
def test_avif(tmp_path, bits):
    codes = smooth() if bits == 8 else smooth(np.uint16) >> (16 - bits)
    settings = [cv2.IMWRITE_AVIF_DEPTH, bits, cv2.IMWRITE_AVIF_QUALITY, 100]
    assert cv2.imwrite(str(tmp_path / "a.avif"), codes[..., ::-1], settings)
    assert near(tmp_path / "a.avif", codes, 2 ** (bits - 8) * 3)
    assert read_image(tmp_path / "a.avif").full_scale == 2**bits - 1
    assert near_gray(tmp_path / "b.avif")


def near_gray(path: Path) -> bool:
    assert cv2.imwrite(str(path), smooth()[..., 0], [cv2.IMWRITE_AVIF_QUALITY, 100])
    return near(path, smooth()[..., :1], 3)


def test_a_heic_without_a_picture_is_refused(tmp_path):
    """Every byte of its directory is spoilt in turn: whatever follows, it is one line or a picture."""
    path = heic(tmp_path / "a.heic", smooth())
    whole = path.read_bytes()
    for k in range(24, min(len(whole), 480), 3):
        path.write_bytes(whole[:k] + b"\xff\xff" + whole[k + 2 :])
        for read in (read_header, read_image):
            try:
                read(path)
            except InputError as error:
                assert "\n" not in str(error)
