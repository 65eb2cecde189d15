"""How the board's light changes with lamp and balls: as differences of the light itself."""

import numpy as np
import pytest

from photogonio.calib.geometry.visibility import passed_by, share_of
from photogonio.calib.shading.kernel import light_on_board, misfits, slopes_of_shaded

BALLS = np.array([[10.0, 10, 8, 8], [170, 130, 8, 8], [90, 70, 25, 25]])
LAMP, RADIUS, NARROW, AIM = np.array([300.0, -80, 350]), 7.0, 0.4, np.array([90.0, 70, 25])
SOFT, STEP = 0.3, 1e-4
SPREAD = np.array([0.25, 0.1, 0.5])


def board(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3), share of white (n,) and place across the board (2, n)."""
    rng = np.random.default_rng(3)
    points = np.column_stack([rng.uniform(0, 180, count), rng.uniform(0, 140, count), np.zeros(count)])
    return points, rng.uniform(0, 1, count), rng.uniform(-1, 1, (2, count))


def light(points, white, across, *, place=LAMP, lamp=RADIUS, balls=BALLS) -> np.ndarray:
    found, tilts = np.empty((4, len(points))), np.array([0.01, -0.02])
    spread = np.tile(SPREAD, (len(points), 1))
    light_on_board(
        points, white, spread, across, place, 1.7, 0.05, lamp, NARROW, AIM, tilts, SOFT, balls, found
    )
    return found


def test_slopes_are_differences_of_the_light():
    """Of what changes no ball's shadow on a point they are left out there, and are zero to rounding; there, those by
    the lamp's place are derivatives, and off by what a step of a ten-thousandth of its distance leaves."""
    points, white, across = board(4000)
    places = LAMP + STEP * 450 * np.eye(3)
    tables = [BALLS + STEP * (np.arange(12) == k).reshape(3, 4) for k in range(12)]
    lamps = np.array([RADIUS * (1 + STEP), *[RADIUS] * 12])
    step = np.array([STEP * 450] * 3 + [STEP] * 13)
    now, slopes = light(points, white, across), np.empty((20, len(points)))
    rows = np.array([0, 1, 2, *range(7, 20)])
    spread, tables = np.tile(SPREAD, (len(points), 1)), np.array([BALLS, *tables])
    fixed = LAMP, RADIUS, NARROW, AIM, SOFT, BALLS
    slopes_of_shaded(points, spread, now, *fixed, places, lamps, tables, step, 0.5, rows, slopes)
    moved = [light(points, white, across, place=p) for p in places]
    moved += [light(points, white, across, lamp=r, balls=b) for r, b in zip(lamps, tables, strict=True)]
    for row, there, size in zip(rows, moved, step, strict=True):
        expected = (there[2] - now[2]) / size * now[3]
        rounding, curved = 1e-13 * np.abs(now[2]).max() / size, 1e-3 * np.abs(expected).max()
        np.testing.assert_allclose(slopes[row], expected, atol=curved if row < 3 else rounding)
    edges = [np.count_nonzero(slopes[row]) for row in rows[3:]]
    assert min(edges) > 20 and sum(edges) < len(points)


@pytest.mark.parametrize("margin", [0.0, 2.0])
def test_where_the_way_to_the_lamp_passes_all_balls_it_is_seen_whole(margin):
    points, _, _ = board(4000)
    xx, xy, yy = SPREAD
    clear = np.array([passed_by(p, LAMP, RADIUS, BALLS, xx, yy, margin) for p in points])
    share = np.array([share_of(p, LAMP, RADIUS, BALLS, xx, xy, yy) for p in points])
    assert 0.3 < clear.mean() < 1.0 and (share < 1).any()
    assert (share[clear] == 1.0).all()


def test_the_lamp_that_lit_the_board_agrees_best():
    points, white, across = board(700)
    level = light(points, white, across * 0)[2]
    tone = 0.05 + 0.95 * white
    places = LAMP + np.array([[0.0, 0, 0], [40, 0, 0], [0, -60, 0], [0, 0, 80], [-150, 150, 0]])
    found = np.empty(len(places))
    misfits(points, tone, level, places, RADIUS, BALLS, SOFT, 0.1, found)
    assert found.argmin() == 0 and found[0] < 0.1 < found[-1]
