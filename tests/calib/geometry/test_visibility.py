"""Shadows of balls under a lamp that is no point, and what stands in the way."""

import numpy as np
import pytest

from photogonio.calib.geometry.visibility import direct
from photogonio.calib.shading.kernel import light_on_board
from tests.drawn.shadows import LAMP_RADIUS, LAMPS, SPREAD, TABLE, blurred, ring_of


@pytest.mark.parametrize("lamp", LAMPS)
def test_the_edge_of_a_shadow_is_as_wide_as_lamp_and_blur_make_it(lamp):
    """Against rays. The limb's straight line and three lines for the disc leave 3 % at the worst of an edge whose
    places all lie within what the blur linearises; on the mean over the edges they leave nothing."""
    points = ring_of(np.random.default_rng(1), 1500)
    found, none, spread = np.empty((4, len(points))), np.zeros(2), np.tile(SPREAD, (len(points), 1))
    white, across, aim = np.ones(len(points)), np.zeros((2, len(points))), np.zeros(3)
    light_on_board(
        points, white, spread, across, lamp, 1.0, 0.1, LAMP_RADIUS, 0.0, aim, none, 0.0, TABLE, found
    )
    bare, shaded = found[1], found[2]
    true = blurred(points, lamp)
    edge = (true > 0.02) & (true < 0.98)
    assert edge.sum() > 50
    off = shaded / bare - true
    assert np.sqrt(np.mean(off[edge] ** 2)) < 0.03
    assert abs(off[edge].mean()) < 0.01
    assert np.abs(off[~edge]).max() < 0.03
    np.testing.assert_allclose(bare, direct(points, lamp))
