"""Tone curves of ICC profiles."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.containers import icc
from photogonio.capture.containers.tone import SRGB, Curve
from photogonio.capture.files.images import read_header
from tests.capture.odd_files import (
    SRGB_TAG,
    gamma_tag,
    icc_profile,
    iccp,
    parametric_tag,
    png,
    table_tag,
)

CODES = np.linspace(0.0, 1.0, 301)
PICTURE = np.random.default_rng(0).integers(0, 256, (16, 24, 3)).astype(np.uint8)
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


def test_a_profile_that_cannot_be_used_is_told(tmp_path):
    tables = icc_profile(SRGB_TAG).replace(b"rTRC", b"A2B0")
    path = png(tmp_path / "a.png", PICTURE, iccp(tables))
    header = read_header(path)
    assert not header.tone.told and header.tone.curves == (SRGB,)
    assert "no tone curve" in header.doubts[0] and "sRGB" in header.doubts[0]
    path = png(tmp_path / "b.png", PICTURE, (b"iCCP", b"x\0\0 not compressed"))
    assert "damaged" in read_header(path).doubts[0]
