"""Codes of print under a near lamp, and how they change with what is unknown."""

import numpy as np
import pytest

from photogonio.calib.response.curve import BENDS
from photogonio.calib.response.paper_light import codes_by, design_of, direct_light
from photogonio.calib.response.unknowns import Unknowns
from photogonio.capture.linear.encoding import srgb_to_linear
from tests.calib.response.phones import CURVES, photos

STEP = 1e-5


def test_light_falls_with_the_cosine_and_the_square():
    light, squared, height = direct_light(np.array([[0.0, 0.0, 2.0], [3.0, 0.0, 4.0]]))
    assert light == pytest.approx([1 / 4, 4 / 5 / 25])
    assert squared == pytest.approx([4.0, 25.0])
    assert height == pytest.approx([2.0, 4.0])


def test_codes_without_bends_are_srgbs():
    codes = np.linspace(0.05, 0.95, 20)
    found, steep = codes_by(np.zeros(BENDS), np.log(srgb_to_linear(codes)))
    assert found == pytest.approx(codes, abs=1e-4)
    above, below = (np.log(srgb_to_linear(codes + by)) for by in (1e-4, -1e-4))
    assert steep == pytest.approx((above - below) / 2e-4, rel=0.02)


@pytest.mark.parametrize("number", [0, 1], ids=["flash", "torch"])
def test_derivatives_are_those_of_the_codes(number):
    told = photos(CURVES["gentle"], count=2, channels=1, noise=0.01)
    one = told[number]
    layout = Unknowns(1, ("flash", "L1"), 2, (1e-5, 1e-5))
    values = np.random.default_rng(2).normal(0.0, 0.003, layout.size)
    place = one.pose.apply(one.place) if one.attached else one.place
    at = layout.places + 3 * number
    values[at : at + 3] = place
    values[layout.strengths + number] = -1.2
    values[layout.ink] = np.log(0.05)
    design = design_of(layout, one, number, values, 0)[0]
    for column, unknown in enumerate(layout.asked(one.light, number, 0)):
        step = STEP * (1e3 if at <= unknown < at + 3 else 1.0)
        up, down = values.copy(), values.copy()
        up[unknown] += step
        down[unknown] -= step
        change = design_of(layout, one, number, down, 0)[1] - design_of(layout, one, number, up, 0)[1]
        expected = design[:, column]
        assert change / (2 * step) == pytest.approx(expected, abs=0.03 * np.abs(expected).max() + 1e-4)
