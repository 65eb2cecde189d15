"""Colours of two BRDFs brought together."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.compare.colours import in_common_colours, rendered
from photogonio.compare.known import Known
from photogonio.reconstruct.export.radiance_xml import LUMINANCE
from tests.drawn.exports import random_pairs

RGB = np.array([0.5, 0.2, 0.1])
XYZ = np.array([0.2957733, 0.2565782, 0.1285568])  # by the matrix of IEC 61966-2-1, worked out apart


def even(channels, values, **more):
    values = np.array(values)
    return Known("k", channels, True, lambda i, r: np.broadcast_to(values, (len(i), len(values))), **more)


def test_x_y_z_are_linear_srgb_beside_r_g_b():
    rgb, xyz = even(("R", "G", "B"), RGB), even(("X", "Y", "Z"), XYZ)
    for pair in ((rgb, xyz), (xyz, rgb)):
        a, b = in_common_colours(*pair)
        assert a.channels == b.channels == ("R", "G", "B")
        up = np.array([[0.0, 0.0, 1.0]])
        np.testing.assert_allclose(a.evaluate(up, up), b.evaluate(up, up), atol=2e-4)


def test_r_g_b_is_its_luminance_beside_one_and_as_it_is_beside_any_other_channel():
    rgb, up = even(("B", "G", "R"), RGB[::-1]), np.array([[0.0, 0.0, 1.0]])
    a, b = in_common_colours(rgb, even(("Y",), [0.2], luminance=True))
    assert a.channels == b.channels == ("Y",)
    np.testing.assert_allclose(a.evaluate(up, up)[0, 0], RGB @ LUMINANCE, rtol=1e-5)
    assert in_common_colours(rgb, even(("Y",), [0.2]))[0] is rgb


def test_pictures_are_rendered_in_r_g_b_and_what_was_not_measured_is_black():
    where = random_pairs(5)
    np.testing.assert_allclose(rendered(even(("X", "Y", "Z"), XYZ))(*where), np.tile(RGB, (5, 1)), atol=2e-4)
    assert (rendered(even(("R",), [np.nan]))(*where) == 0.0).all()
    with pytest.raises(InputError, match="fit it first"):
        rendered(Known("k", ("R",), True))
