"""The shadow of a thick flat sample on the board, and the light of its sides."""

import numpy as np
import pytest

from photogonio.calib.diagnose.lights.thick_sample import _pieces, is_thick, shaded, side_light
from photogonio.capture.photoset import CharucoBoard, Plane, Sphere

OUTLINE = np.array([[50.0, 40.0], [120.0, 40.0], [120.0, 100.0], [50.0, 100.0]])
BOARD = CharucoBoard("DICT_5X5_250", squares=(9, 7), square_length=20.0, marker_length=15.0)


def through(points, lamp, height, steps=400):
    """Whether the straight way from each point to the lamp passes through the box, by marching along it."""
    share = np.linspace(1e-6, 1.0, steps)[:, None]
    blocked = np.zeros(len(points), bool)
    for k, point in enumerate(points):
        way = point + share * (lamp - point)
        inside = (way[:, :2] > OUTLINE[0]).all(1) & (way[:, :2] < OUTLINE[2]).all(1) & (way[:, 2] < height)
        blocked[k] = inside.any()
    return blocked


@pytest.mark.parametrize("lamp", [[300.0, 220.0, 150.0], [85.0, 70.0, 400.0], [-250.0, 60.0, 90.0]])
def test_nothing_that_the_slab_hides_from_the_lamp_is_left(lamp):
    """And what is dropped besides lies close."""
    height = 20.0
    sample, lamp = Plane(OUTLINE, height), np.array(lamp)
    x, y = np.meshgrid(np.arange(2.0, 180.0, 4.0), np.arange(2.0, 140.0, 4.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    dark, dropped = through(points, lamp, height), shaded(points, lamp, sample)
    assert dark.any() and not (dark & ~dropped).any()
    apart = np.linalg.norm(points[dropped & ~dark, None] - points[None, dark], axis=-1).min(1)
    assert apart.max() < 0.4 * height + 6.0  # the grid's pitch


def test_a_lit_side_lights_the_board_before_it_as_a_wall_does():
    """Against rays cast from the point: of all its view, weighted by the cosine, the part that meets the lit side."""
    height, lamp = 20.0, np.array([400.0, 70.0, 60.0])
    rng = np.random.default_rng(0)
    z = np.sqrt(rng.uniform(size=400_000))  # cosine-weighted directions
    turn = rng.uniform(0.0, 2.0 * np.pi, len(z))
    way = np.column_stack([np.sqrt(1.0 - z**2) * np.cos(turn), np.sqrt(1.0 - z**2) * np.sin(turn), z])
    points = np.array([[130.0, 70.0, 0.0], [150.0, 90.0, 0.0], [100.0, 120.0, 0.0]])
    found = side_light(points, lamp, Plane(OUTLINE, height))
    for point, light in zip(points, found, strict=True):
        far = (OUTLINE[1, 0] - point[0]) / way[:, 0]
        met = point + far[:, None] * way
        hits = (far > 0) & (np.abs(met[:, 1] - 70.0) < 30.0) & (met[:, 2] < height)
        offset = lamp - met[hits]
        sent = offset[:, 0] / np.linalg.norm(offset, axis=1) ** 3
        expected = sent.sum() / len(way) if point[0] > OUTLINE[1, 0] else 0.0
        assert light == pytest.approx(expected, rel=0.03, abs=1e-12)


def test_a_round_samples_side_lights_the_board_as_one_of_many_sides_does():
    """However finely the outline is told, and whichever way around: 24 sides lie at most 0.3 behind the circle, of 11
    or more to the points."""
    lamp, points = np.array([400.0, 70.0, 300.0]), np.array([[135.0, 75.0, 0.0], [150.0, 40.0, 0.0]])
    fine, coarse = (2 * np.pi * np.arange(count) / count for count in (240, 24))
    circles = [np.array([90.0, 70.0]) + 35 * np.column_stack([np.cos(t), np.sin(t)]) for t in (fine, coarse)]
    many, few = (side_light(points, lamp, Plane(circle, 20.0)) for circle in circles)
    assert (many > 0).all()
    np.testing.assert_allclose(few, many, rtol=2 * 0.3 / 11)
    np.testing.assert_allclose(side_light(points, lamp, Plane(circles[0][::-1], 20.0)), many, rtol=1e-9)
    assert len(_pieces(circles[0])[0]) == 240  # one of each side: no more than tells the light


def test_only_a_thick_flat_sample_on_a_board_is_one():
    assert is_thick(BOARD, Plane(OUTLINE, 20.0))
    assert not is_thick(BOARD, Plane(OUTLINE, 0.5))
    assert not is_thick(None, Plane(OUTLINE, 20.0))
    assert not is_thick(BOARD, Sphere(np.array([90.0, 70.0, 25.0]), 25.0))
