"""A lamp by how it lights the paper: of two places the one that explains the photo."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.geometry.camera import Pose
from photogonio.calib.shading.fit import fit_shading, fits_better, stepped
from photogonio.calib.shading.model import Ball, LitPaper, ShadingScene
from photogonio.calib.shading.parameters import BALL, LOCAL, SHARED
from tests.drawn.setups import scene_of
from tests.drawn.shadows import BALLS, LAMP_RADIUS, LAMPS, paper_about

BOUNCE = slice(4, 6)
POSE = Pose(np.eye(3), np.zeros(3))


@pytest.mark.parametrize("k", range(4))
def test_a_wrong_place_is_no_better_for_supposing_much_bounce(drawn, k):
    """Errors grow with the bounce supposed, and with them the misfit in its own errors would shrink."""
    world, readings = drawn
    scene, lamp = scene_of(world), world.lamps[k]
    board = LitPaper.of(readings[k])
    right = stepped(board, scene, lamp, 15)
    local = right.local.copy()
    local[:3] += 0.1 * np.linalg.norm(lamp) * np.array([0.6, -0.6, 0.5])
    local[BOUNCE] = 20.0 * np.abs(local[BOUNCE]) + 1.0
    wrong = stepped(board, scene, local, 0)
    assert fits_better(right, wrong)
    assert not fits_better(wrong, right)
    assert not fits_better(right, right)


@pytest.mark.parametrize("k", range(2))
def test_a_room_that_is_known_leaves_the_lamp_where_it_is(drawn, k):
    """Light from everywhere, a tenth of the lamp's: not known it draws the lamp nearer many errors; known, none."""
    world, readings = drawn
    scene, lamp, dark = scene_of(world), world.lamps[k], readings[k]
    room = 0.1 * np.median(dark.level[dark.samples.white])
    level = dark.level + room * np.where(dark.samples.white, 1.0, scene.black)
    right = fit_shading(dark, scene, lamp)
    known = fit_shading(replace(dark, level=level, beside=(room, 0.01 * room)), scene, lamp)
    ignored = fit_shading(replace(dark, level=level), scene, lamp)
    error = np.sqrt(np.diag(right.covariance()))
    assert (np.abs(known.place - right.place) < 2.0 * error).all()
    assert np.abs((ignored.place - right.place) / error).max() > 3.0
    assert known.local[6] * known.level == pytest.approx(room, rel=0.05)


@pytest.mark.parametrize("mirror", [0.0, 0.85])
@pytest.mark.parametrize("lamp", LAMPS)
def test_shadows_of_small_balls_tell_where_a_lamp_is(lamp, mirror):
    """Several times better than falloff alone, and as well as is stated, whatever light the balls throw."""
    reading = paper_about(np.random.default_rng(3), lamp, mirror)
    scene = ShadingScene(BALLS, None, LAMP_RADIUS, 0.05, 0.0)
    start = lamp + np.array([6.0, -8.0, 5.0])
    found = fit_shading(reading, scene, start, 30)
    alone = fit_shading(replace(reading, close=None), scene, start, 30)
    across = np.cross(lamp, [0, 0, 1.0]) / np.linalg.norm(lamp[:2])
    error, without = (float(np.sqrt(across @ fit.covariance() @ across)) for fit in (found, alone))
    assert error < without / 2
    off = found.place - lamp
    assert off @ np.linalg.solve(found.covariance(), off) < 16.3  # chi square of 3, one in a thousand
    assert found.local[-1] == pytest.approx(mirror, abs=0.1)


def test_a_shadow_beside_its_ball_moves_the_ball():
    """With the lamp held where it is, steps on a ball's values take it back to where it stands."""
    lamp = LAMPS[0]
    reading = paper_about(np.random.default_rng(4), lamp, 0.0)
    local = fit_shading(reading, ShadingScene(BALLS, None, LAMP_RADIUS, 0.05, 0.0), lamp, 30).local
    one, center = LOCAL + SHARED + BALL + np.arange(2), BALLS[1].center + np.array([0.3, -0.2, 0.0])
    for _ in range(6):
        scene = ShadingScene((BALLS[0], Ball(center, 8.0)), None, LAMP_RADIUS, 0.05, 0.0)
        held = fit_shading(reading, scene, np.append(lamp, local[3:]), 0)
        assert len(held.normal) == LOCAL + SHARED + 2 * BALL
        inverse = np.linalg.inv(held.normal[np.ix_(one, one)])
        center = center - np.append(inverse @ held.gradient[one], 0.0)
    error = np.sqrt(np.diag(inverse))
    assert (error < 0.1).all()
    assert (np.abs(center - BALLS[1].center)[:2] < 2 * error).all()
