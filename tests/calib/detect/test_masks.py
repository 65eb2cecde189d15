"""What stands before the board: masks that hold all of it, and little else."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from photogonio.calib.detect.masks import fill, things_mask
from photogonio.capture.photoset import Plane
from tests.drawn.setups import BALLS, PATCH, SAMPLE, photoset_of


def test_a_polygon_is_filled_to_a_part_of_a_pixel():
    """Its area, and half a pixel along its sides at the most, on either side."""
    mask = np.zeros((60, 80), np.uint8)
    polygon = np.array([[10.3, 8.7], [61.2, 12.1], [55.0, 47.9], [14.4, 41.0]])
    fill(mask, polygon)
    around = np.linalg.norm(np.roll(polygon, -1, axis=0) - polygon, axis=1).sum()
    assert abs(int(mask.sum()) - cv2.contourArea(polygon.astype(np.float32))) < around
    y, x = np.nonzero(mask)
    near = [
        cv2.pointPolygonTest(polygon.astype(np.float32), (float(u), float(v)), True)
        for u, v in zip(x, y, strict=True)
    ]
    assert min(near) > -1.0


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1e7])
def test_a_polygon_that_is_nowhere_is_passed_over(wrong):
    mask = np.zeros((20, 20), np.uint8)
    fill(mask, np.array([[1.0, 1], [wrong, 5], [5, 9]]))
    assert not mask.any()


def surface(center: np.ndarray, radius: float) -> np.ndarray:
    """Points (n, 3) of a ball."""
    rng = np.random.default_rng(0).normal(size=(3000, 3))
    return center + radius * rng / np.linalg.norm(rng, axis=1, keepdims=True)


@pytest.mark.parametrize("flat", [False, True])
def test_all_that_stands_on_the_board_is_held(drawn, flat):
    world, _ = drawn
    photoset, pose = photoset_of(world, fixed=True), world.views[0]
    sheet = Plane(np.array([[60.0, 50], [120, 50], [120, 90], [60, 90]]), 3.0)
    photoset = replace(photoset, sample=sheet) if flat else photoset
    width, height = world.camera.size
    masks = {
        grow: things_mask(photoset, world.camera, pose, (height, width), grow, loose=0.0)
        for grow in (0, 2, 6)
    }
    share = np.random.default_rng(1).uniform(size=(500, 2))
    points = [surface(ball.center, ball.radius) for ball in BALLS]
    points += [np.column_stack([[150, 10] + 20 * share, np.full(500, PATCH.height)])]
    points += (
        [np.column_stack([[60, 50] + share * [60, 40], np.full(500, 3.0)])]
        if flat
        else [surface(SAMPLE.center, SAMPLE.radius)]
    )
    pixels = np.round(world.camera.project(pose, np.concatenate(points))).astype(int)
    inside = ((pixels >= 1) & (pixels < [width - 1, height - 1])).all(1)
    x, y = pixels[inside].T
    assert inside.sum() > 1000 and masks[2][y, x].all() and masks[0][y, x].mean() > 0.98
    assert not masks[6].all() and (masks[0] <= masks[2]).all() and (masks[2] <= masks[6]).all()
    square = np.ones((13, 13), np.uint8)
    np.testing.assert_array_equal(masks[6], cv2.dilate(masks[0].view(np.uint8), square) > 0)
