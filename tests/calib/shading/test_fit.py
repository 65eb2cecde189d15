"""A lamp by how it lights the paper: of two places the one that explains the photo."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.detect.paper import PaperSamples
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.geometry.camera import Pose
from photogonio.calib.geometry.visibility import direct
from photogonio.calib.shading.fit import fit_shading, fits_better, pooled_patches, stepped
from photogonio.calib.shading.model import USUAL_PATCHES, Ball, LitPaper, ShadingScene
from photogonio.calib.shading.parameters import BALL, LOCAL, SHARED, THROWN
from tests.drawn.setups import scene_of, strip_of
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


def test_a_lamp_that_sends_no_light_to_the_board_stays_where_it_is(drawn):
    """A beam so narrow that all around its axis is black: no sample says anything of the place."""
    world, readings = drawn
    scene, lamp = replace(scene_of(world), narrow=1e8, aim=(1e4, 0.0, 0.0)), world.lamps[0]
    end = stepped(LitPaper.of(readings[0]), scene, lamp, 15)
    assert np.isfinite(end.local).all()
    np.testing.assert_allclose(end.local[:3], lamp)


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
    assert found.local[THROWN[-1]] == pytest.approx(mirror, abs=0.1)


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


PLAIN = ShadingScene((), None, 4.0, 0.05, 0.0)
TORCHES = [np.array(place) for place in ([-60.0, 330, 300], [350.0, 20, 210], [80.0, -260, 340])]
PAPER = 0.82


def small_print(place: np.ndarray, rng: np.random.Generator, *, white: bool, common: float) -> PaperReading:
    """A board in a small picture: black squares whose light is off by ``common`` each, relative, and, where there are
    any, narrow white ones that are not."""
    x, y = (side.ravel() for side in np.meshgrid(np.arange(1.0, 180.0, 2.0), np.arange(1.0, 140.0, 2.0)))
    column, row = (x // 20).astype(int), (y // 20).astype(int)
    bright = (column + row) % 2 == 1
    kept = ~bright | (white & (x % 20 < 4.0) & (y % 20 < 4.0))
    points, bright, square = np.column_stack([x, y, 0 * x])[kept], bright[kept], (column + 9 * row)[kept]
    level = np.where(bright, 1.0, 0.05) * direct(points, place)
    level = level * np.where(bright, 1.0, (1 + common * rng.normal(size=63))[square])
    sigma = np.where(bright, 0.01, 0.05) * level
    level = level + sigma * rng.normal(size=len(level))
    flat = np.tile([0.2, 0.0, 0.2], (len(level), 1))
    samples = PaperSamples(
        points, bright, level[:, None], sigma[:, None] ** 2, square, flat, np.zeros(len(level))
    )
    return PaperReading(samples, level, sigma**2)


def test_a_white_strip_tells_the_lamp_where_white_print_is_lost():
    """A photo without white print leans on its black and on the strip, whose share of the paper's light the other
    photos know; as well as is stated, and twice as well as by black print alone."""
    rng = np.random.default_rng(11)
    usual = PLAIN
    for _ in range(3):
        fits, alone = [], []
        for k, place in enumerate(TORCHES):
            paper = small_print(place, rng, white=k > 0, common=0.015)
            both = replace(paper, patches=strip_of(place, 0.8 / PAPER, rng))
            fits.append(fit_shading(both, usual, place + 5.0, 30))
            alone.append(fit_shading(paper, PLAIN, place + 5.0, 30))
        usual = replace(usual, patches=pooled_patches(fits, USUAL_PATCHES))
    share, error = usual.patches
    assert share == pytest.approx(-np.log(PAPER), abs=4 * error) and error < 0.01
    for fit, other, place in zip(fits, alone, TORCHES, strict=True):
        off = fit.place - place
        assert off @ np.linalg.solve(fit.covariance(), off) < 16.3  # chi square of 3, one in a thousand
        assert np.linalg.det(fit.covariance()) < np.linalg.det(other.covariance())
    assert np.trace(fits[0].covariance()) < np.trace(alone[0].covariance()) / 4


def test_a_view_without_patches_says_nothing_of_them():
    place = TORCHES[0]
    fit = fit_shading(small_print(place, np.random.default_rng(1), white=True, common=0.0), PLAIN, place, 30)
    assert fit.patches[1] == 0.0
    assert pooled_patches([fit], USUAL_PATCHES)[0] == pytest.approx(USUAL_PATCHES[0])


def test_black_print_that_is_off_by_squares_moves_no_lamp_beyond_what_is_stated():
    """Ink's share of the light differs from square to square, and each square's samples share that: white, which does
    not, has its say."""
    place, rng = TORCHES[1], np.random.default_rng(4)
    found: dict[float, list[float]] = {0.0: [], PLAIN.ink: []}
    for _ in range(12):
        paper = small_print(place, rng, white=True, common=0.015)
        for ink, misses in found.items():
            fit = fit_shading(paper, replace(PLAIN, ink=ink), place, 15)
            off = fit.place - place
            misses.append(off @ off)
            if ink:
                assert (
                    off @ np.linalg.solve(fit.covariance(), off) < 16.3
                )  # chi square of 3, one in a thousand
    alone, common = (np.mean(misses) for misses in found.values())
    assert (
        common < 0.8 * alone
    )  # half as large here; with samples that are taken to err alone black print has it all
