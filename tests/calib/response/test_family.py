"""Tone curves that are known, as an expectation of those that are not."""

import numpy as np
import pytest

from photogonio.calib.response.curve import BENDS, anchors, basis, prior
from photogonio.calib.response.family import curves, moved_by_them
from photogonio.synthetic.render.tones import linear_to_srgb
from tests.calib.response.phones import CURVES


def test_each_rises_and_ends_at_full_scale():
    every = np.column_stack(list(curves()))
    assert np.diff(every, axis=0).min() > -1e-9
    assert np.abs(every[-1] - 1).max() < 1e-9 and every[0].min() > -1e-9
    assert every[0].max() < 0.03


def test_srgb_itself_is_among_them():
    codes, moved = moved_by_them()
    least = np.abs(moved).max(0).min()
    assert least < 1e-4
    assert np.abs(moved).max() > 0.1 and len(codes) == len(moved)


@pytest.mark.parametrize("name", sorted(CURVES))
def test_a_curve_of_a_phone_is_no_surprise(name):
    """As far from what is expected as a draw of so many numbers is."""
    light = np.geomspace(0.004, 1.0, 200)
    code = CURVES[name](light)
    moved = linear_to_srgb(light) - code
    held = np.vstack([prior(1), anchors(1)])[:, :BENDS]
    step = 0.0015  # of the codes, what it may be missed by
    rows = np.vstack([held, basis(code) / step])
    asked = np.concatenate([np.zeros(len(held)), moved / step])
    bends = np.linalg.lstsq(rows, asked, rcond=None)[0]
    assert np.sum((held @ bends) ** 2) < BENDS
    # one code of 8 bits; nearer to the ends turns may be so short that a spline of this pitch rounds them
    assert np.abs(basis(code) @ bends - moved)[(code > 0.1) & (code < 0.97)].max() < 1 / 255
