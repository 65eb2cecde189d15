"""How radiance changes with each value of a fit: against differences of the radiance itself."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.shading.derivatives import slopes
from photogonio.calib.shading.initial import thinned
from photogonio.calib.shading.model import LitPaper
from photogonio.calib.shading.parameters import LOCAL
from tests.drawn.setups import scene_of, strip_of

STEP = 1e-5


@pytest.mark.parametrize(
    ("narrow", "falloff"), [(0.0, (0.0, 0.0)), (0.6, (-0.1, 0.03))], ids=["plain", "beam and lens"]
)
def test_every_slope_is_that_of_differences(drawn, narrow, falloff):
    """What balls throw is held, as the fit does. By lamp, shadows and balls the slopes are differences over 1e-4
    themselves, and off by that much of how they bend."""
    world, (reading, *_) = drawn
    scene = replace(scene_of(world), narrow=narrow, falloff=falloff, aim=tuple(world.sample.center))
    board = LitPaper.of(
        replace(thinned(reading, 400), patches=strip_of(world.lamps[0], 1.3, np.random.default_rng(1)))
    )
    own = np.array([*world.lamps[0], np.log(1.3), 0.3, 1.0, 0.01, 0.002, -0.003, 0.5, 0.1])
    values = np.concatenate([own, scene.shared])
    thrown = board.thrown(scene).of(world.lamps[0])
    light = board.light(values, scene)
    found = slopes(board, values, scene, light, thrown, len(values))
    assert found.shape == (len(values), len(board.level))
    for k in range(len(values)):
        far = float(np.linalg.norm(values[:3])) if k < 3 else 1.0
        moved = []
        for sign in (1, -1):
            there = values.copy()
            there[k] += sign * STEP * far
            moved.append(board.light(there, scene).radiance(there, thrown))
        expected = (moved[0] - moved[1]) / (2 * STEP * far)
        bright = float(np.abs(light.bare).max())
        # an edge of a shadow passes over a sample within some tenths of a millimetre
        scale = max(float(np.abs(expected).max()), bright / far)
        np.testing.assert_allclose(found[k], expected, atol=0.02 * scale, err_msg=str(k))
        assert np.abs(found[k] - expected).mean() < 1e-3 * scale, k


def test_a_views_own_values_come_first_alone(drawn):
    world, (reading, *_) = drawn
    scene, board = scene_of(world), LitPaper.of(thinned(reading, 300))
    values = np.concatenate([[*world.lamps[0], 0.1, 0.3, 1.0, 0.0, 0.0, 0.0, 0.5, 0.2], scene.shared])
    thrown, light = board.thrown(scene).of(world.lamps[0]), board.light(values, scene)
    every = slopes(board, values, scene, light, thrown, len(values))
    np.testing.assert_allclose(slopes(board, values, scene, light, thrown, LOCAL), every[:LOCAL], rtol=1e-9)
