"""Shadows of polished balls, the light that they throw, and what both tell of a lamp."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.detect.paper import PaperSamples
from photogonio.calib.detect.paper_near_balls import Close
from photogonio.calib.detect.paper_reading import PaperReading
from photogonio.calib.geometry.visibility import direct
from photogonio.calib.shading.fit import fit_shading
from photogonio.calib.shading.interreflection import glossy_bounce, polished_bounce
from photogonio.calib.shading.kernel import light_on_board
from photogonio.calib.shading.model import Ball, ShadingScene
from photogonio.calib.shading.parameters import BALL, LOCAL, SHARED

BALLS = (Ball(np.array([10.0, 10, 8]), 8.0), Ball(np.array([170.0, 130, 8]), 8.0))
TABLE = np.array([[*b.center, b.radius] for b in BALLS])
LAMP_RADIUS = 7.0
SPREAD = np.array([0.25, 0.1, 0.5])  # covariance on the board, mm^2: a slanting view
LAMPS = [
    np.array([90 + 400.0 * np.cos(t), 70 + 400 * np.sin(t), 420 * h]) for t, h in ((0.6, 0.4), (2.5, 0.9))
]


def disc(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 2) on the unit disc that stand for equal areas."""
    radius = np.sqrt((np.arange(count**2) + 0.5) / count**2)
    turn = np.arange(count**2) * np.pi * (3 - np.sqrt(5))
    return radius * np.cos(turn), radius * np.sin(turn)


def seen_of_lamp(points: np.ndarray, lamp: np.ndarray, count: int = 12) -> np.ndarray:
    """Share (n,) of a lamp's disc seen past the balls, by rays to its parts: no formula of a limb."""
    axis = lamp / np.linalg.norm(lamp)
    side = np.cross(axis, [0, 0, 1.0])
    side /= np.linalg.norm(side)
    u, v = disc(count)
    free = np.zeros(len(points))
    for a, b in zip(u, v, strict=True):
        ray = lamp + LAMP_RADIUS * (a * side + b * np.cross(axis, side)) - points
        ray /= np.linalg.norm(ray, axis=1, keepdims=True)
        clear = np.ones(len(points), bool)
        for x, y, z, radius in TABLE:
            offset = np.array([x, y, z]) - points
            clear &= np.linalg.norm(np.cross(offset, ray), axis=1) > radius
        free += clear
    return free / len(u)


def blurred(points: np.ndarray, lamp: np.ndarray, count: int = 9) -> np.ndarray:
    """The same, averaged over what each point gathers."""
    root = np.linalg.cholesky([[SPREAD[0], SPREAD[1]], [SPREAD[1], SPREAD[2]]])
    radius = np.sqrt(-2 * np.log(1 - (np.arange(count**2) + 0.5) / count**2))
    turn = np.arange(count**2) * np.pi * (3 - np.sqrt(5))
    moves = np.column_stack([radius * np.cos(turn), radius * np.sin(turn)]) @ root.T
    return np.mean([seen_of_lamp(points + np.append(move, 0.0), lamp) for move in moves], axis=0)


def ring_of(rng: np.random.Generator, count: int) -> np.ndarray:
    """Points (count, 3) about the balls, 1.2 to 4 of their radii from the foot."""
    ball = TABLE[rng.integers(0, 2, count)]
    away, turn = ball[:, 3] * rng.uniform(1.2, 4.0, count), rng.uniform(0, 2 * np.pi, count)
    return np.column_stack(
        [ball[:, 0] + away * np.cos(turn), ball[:, 1] + away * np.sin(turn), np.zeros(count)]
    )


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


@pytest.mark.parametrize("lamp", LAMPS)
def test_light_off_a_polished_ball_between_its_nodes(lamp):
    points = ring_of(np.random.default_rng(2), 3000)
    exact = sum(glossy_bounce(points, lamp, b.center, b.radius, f0=1.0) for b in BALLS)
    off = (polished_bounce(points, lamp, TABLE) - exact) / direct(points, lamp)
    assert np.abs(off).max() < 0.02  # at the line beyond which the ball hides its own light
    assert np.sqrt(np.mean(off**2)) < 0.002


def test_far_off_a_polished_ball_scatters_alike_in_all_directions():
    """(R / 2 d)^2 of the light that meets it (geometrical optics of a sphere), times the cosine at the ground of a way
    that begins where the normal halves the right angle. The images' depth in the ball counts with 3/2 R / d."""
    turn = np.arange(6.0)
    points = np.column_stack([10 + 230 * np.cos(turn), 10 + 230 * np.sin(turn), np.zeros(6)])
    lamp = np.array([10.0, 10, 4e4])
    height, away = 8 + 8 / np.sqrt(2), 230 - 8 / np.sqrt(2)
    expected = (8 / (2 * away)) ** 2 * (height / away) / np.linalg.norm(lamp) ** 2
    np.testing.assert_allclose(polished_bounce(points, lamp, TABLE[:1]), expected, rtol=1.5 * 8 / 230)


def paper_about(rng: np.random.Generator, lamp: np.ndarray, mirror: float) -> PaperReading:
    """A board of even white, its paper and what is close to the balls, each by rays; balls reflect ``mirror``."""
    x, y = np.meshgrid(np.arange(2, 180, 4.0), np.arange(2, 140, 4.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    clear = (np.hypot(*(points[:, None, :2] - TABLE[:, :2]).transpose(2, 0, 1)) > 24).all(1)
    points = points[clear]
    near = ring_of(rng, 3000)
    near = near[(near[:, :2] > 0).all(1) & (near[:, :2] < [180, 140]).all(1)]

    def level(points: np.ndarray) -> np.ndarray:
        thrown = sum(glossy_bounce(points, lamp, b.center, b.radius, f0=1.0) for b in BALLS)
        light = 1e5 * (direct(points, lamp) * seen_of_lamp(points, lamp) + mirror * thrown)
        return light * (1 + 0.01 * rng.normal(size=len(points)))

    far, close = level(points), level(near)
    square = (points[:, 0] // 20 + 9 * (points[:, 1] // 20)).astype(int)
    samples = PaperSamples(points, np.ones(len(points), bool), far[:, None], 1e-4 * far[:, None] ** 2, square)
    square = (near[:, 0] // 20 + 9 * (near[:, 1] // 20)).astype(int)
    white, still = np.ones(len(near)), np.zeros((len(near), 3))
    about = Close(near, white, close, 1e-4 * close**2, square, still, np.zeros(len(near)))
    return PaperReading(samples, far, 1e-4 * far**2, close=about)


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
