"""The shadow of a thick flat sample on the board."""

import numpy as np
import pytest

from calib.slab import is_thick, shaded
from capture.photoset import Board, Plane, Sphere

OUTLINE = np.array([[50.0, 40.0], [120.0, 40.0], [120.0, 100.0], [50.0, 100.0]])
BOARD = Board("charuco", "DICT_5X5_250", squares=(9, 7), square_length=20.0, marker_length=15.0)


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
    """And what is dropped besides lies no farther off than the slab is high."""
    height = 20.0
    sample, lamp = Plane(OUTLINE, height), np.array(lamp)
    x, y = np.meshgrid(np.arange(2.0, 180.0, 4.0), np.arange(2.0, 140.0, 4.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    dark, dropped = through(points, lamp, height), shaded(points, lamp, sample)
    assert dark.any() and not (dark & ~dropped).any()
    apart = np.linalg.norm(points[dropped & ~dark, None] - points[None, dark], axis=-1).min(1)
    assert apart.max() < height + 6.0  # the grid's pitch


def test_only_a_thick_flat_sample_on_a_board_is_one():
    assert is_thick(BOARD, Plane(OUTLINE, 20.0))
    assert not is_thick(BOARD, Plane(OUTLINE, 0.5))
    assert not is_thick(None, Plane(OUTLINE, 20.0))
    assert not is_thick(BOARD, Sphere(np.array([90.0, 70.0, 25.0]), 25.0))
