"""A lamp by how it lights the paper: of two places the one that explains the photo."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.coverage import draw_paper, draw_world, scene_of
from calib.shading import fit_shading, fits_better
from calib.starts import local_noise

BOUNCE = slice(4, 6)


@pytest.fixture(scope="module")
def drawn():
    rng = np.random.default_rng(5)
    world = draw_world(rng, fixed=True, views=4)
    return world, [draw_paper(world, k, rng) for k in range(4)]


@pytest.mark.parametrize("k", range(4))
def test_a_wrong_place_is_no_better_for_supposing_much_bounce(drawn, k):
    """Errors grow with the bounce supposed, and with them the misfit in its own errors would shrink."""
    world, readings = drawn
    scene, lamp = scene_of(world), world.lamps[k]
    right = fit_shading(readings[k], scene, lamp)
    local = right.local.copy()
    local[:3] += 0.1 * np.linalg.norm(lamp) * np.array([0.6, -0.6, 0.5])
    local[BOUNCE] = 20.0 * np.abs(local[BOUNCE]) + 1.0
    wrong = replace(right, local=local)
    assert fits_better(readings[k], scene, right, wrong)
    assert not fits_better(readings[k], scene, wrong, right)
    assert not fits_better(readings[k], scene, right, right)


def test_noise_is_told_apart_by_tone(drawn):
    """White with noise of 1 %, black with 4 %: each to the error of a median of so many differences."""
    _, readings = drawn
    samples, rng = readings[0].samples, np.random.default_rng(0)
    true = np.where(samples.white, 0.01, 0.04)
    level = np.where(samples.white, 0.5, 0.02) * (1.0 + true * rng.normal(size=len(true)))
    found = local_noise(samples, level)
    for white in (True, False):
        own = samples.white == white
        assert len(set(found[own])) == 1
        assert found[own][0] == pytest.approx(0.01 if white else 0.04, rel=5 * 1.2 / np.sqrt(own.sum()))
