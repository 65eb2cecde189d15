"""Codes of print and sample, as they are read."""

import numpy as np
import pytest

from photogonio.calib.response.paper_codes import codes_of, middle_white
from photogonio.capture.linear.encoding import Coded, Encoding
from tests.calib.response.phones import CURVES, photos


@pytest.mark.parametrize("kind", ["srgb", "linear"])
def test_codes_come_back_from_the_signal_that_they_were_read_as(kind):
    encoding = Encoding(kind, 1.0, 0.01, 0.98)
    codes = np.random.default_rng(1).uniform(0.05, 0.95, (50, 3))
    found = codes_of(encoding.linear(codes, 3), Coded(1.0, encoding, 255.0))
    assert found == pytest.approx(codes, abs=1e-4)


def test_the_middle_is_of_white_print_alone():
    one = photos(CURVES["srgb"], count=1, channels=2)[0]
    (middle,) = middle_white([one])
    assert middle.shape == (2,)
    assert (middle > one.code[~one.white].max(0)).all()
