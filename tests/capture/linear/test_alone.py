"""A photo by itself reads as it does in its set."""

import numpy as np
import pytest

from photogonio.capture.containers.tone import SRGB, Tone
from photogonio.capture.files.images import Image
from photogonio.capture.linear.alone import encoding_alone, gray_alone
from photogonio.capture.linear.encoding import srgb_to_linear
from photogonio.capture.photoset import Radiometry

CODES = np.arange(192, dtype=np.uint8).reshape(8, 8, 3)
PICTURE = Image(CODES, 255.0, ("R", "G", "B"), tone=Tone((SRGB,), "sRGB"))


def test_codes_are_read_by_the_curve_of_the_file_or_of_the_manifest():
    told, _ = gray_alone(PICTURE, encoding_alone(Radiometry()))
    np.testing.assert_allclose(told, srgb_to_linear(CODES / 255.0).mean(2), rtol=1e-5)
    plain, _ = gray_alone(PICTURE, encoding_alone(Radiometry(encoding="linear", black_level=0.1)))
    np.testing.assert_allclose(plain, (CODES.mean(2) / 255.0 - 0.1) / 0.9, atol=1e-6)


@pytest.mark.parametrize("lossy", [False, True])
def test_full_pixels_are_not_usable(lossy):
    codes = CODES.copy()
    codes[2, 3] = 255
    _, usable = gray_alone(Image(codes, 255.0, ("R", "G", "B"), lossy=lossy), encoding_alone(Radiometry()))
    assert not usable[2, 3] and usable.sum() == 63


def test_a_curve_that_brackets_would_tell_is_taken_from_the_file():
    assert encoding_alone(Radiometry(encoding="unknown")).kind == "file"
