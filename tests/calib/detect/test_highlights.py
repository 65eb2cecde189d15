"""The lamp in a mirror ball, found and placed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.detect.highlights import find_highlight
from photogonio.calib.geometry.camera import Pose
from tests.drawn.boards import radiance
from tests.drawn.mirror_balls import BALLS, CAMERA, LAMP, POSE, SIZE, highlight, spot


def test_a_clipped_core_does_not_move_the_highlight():
    true = highlight(0, LAMP).pixel + 0.3
    level = 0.05 + spot(true, 1.4, 6.0) + 0.002 * np.random.default_rng(1).normal(size=CAMERA.size[::-1])
    image = radiance(np.minimum(level, 1.0), 0.002)
    full = image.value[..., 0] >= 1.0
    found = find_highlight(replace(image, saturated=full, valid=~full), CAMERA, POSE, BALLS[0], 0)
    assert found is not None and found.clipped
    assert np.abs(found.pixel - true).max() < 2 * found.sigma


@pytest.mark.parametrize("shift", [0.0, 0.25, 0.5, 0.75])
def test_a_drawn_highlight_is_found_where_it_is(shift):
    true = highlight(0, LAMP).pixel + shift
    level = 0.05 + spot(true, 1.2, 3.0) + 0.002 * np.random.default_rng(1).normal(size=SIZE[::-1])
    found = find_highlight(radiance(level, 0.002), CAMERA, POSE, BALLS[0], 0)
    assert found is not None
    assert np.abs(found.pixel - true).max() < found.sigma
    assert not found.clipped


@pytest.mark.parametrize(("peak", "lamp"), [(40.0, True), (0.3, False)])
def test_a_clipped_lamp_is_brighter_than_a_window_that_sends_more_than_its_pixels_hold(peak, lamp):
    """A window's image, 3 x 3 pixels and blurred, holds more than a lamp's clipped at 1 does, and less than the lamp's
    own. A pixel that is always full is neither."""
    there = highlight(0, LAMP).pixel
    apart = there + np.array([0.0, 9.0])
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    window = 0.65 * (np.hypot(x - apart[0], y - apart[1]) < 2.6)
    level = 0.05 + spot(there, 0.5, peak) + window + 0.002 * np.random.default_rng(1).normal(size=SIZE[::-1])
    level[int(there[1]) + 4, int(there[0]) - 5] = 1.0
    image = radiance(np.minimum(level, 1.0), 0.002)
    full = image.value[..., 0] >= 1.0
    found = find_highlight(replace(image, saturated=full, valid=~full), CAMERA, POSE, BALLS[0], 0)
    place = there if lamp else apart
    assert found is not None and found.clipped == lamp
    assert np.hypot(*(found.pixel - place)) < 1.0


def test_a_highlight_outside_the_ball_is_none_of_its():
    away = highlight(1, LAMP).pixel
    level = 0.05 + spot(away, 1.2, 3.0) + 0.002 * np.random.default_rng(1).normal(size=SIZE[::-1])
    assert find_highlight(radiance(level, 0.002), CAMERA, POSE, BALLS[0], 0) is None
    assert find_highlight(radiance(level, 0.002), CAMERA, POSE, BALLS[1], 1) is not None


def test_a_dark_ball_shows_no_highlight():
    level = 0.05 + 0.002 * np.random.default_rng(1).normal(size=SIZE[::-1])
    assert find_highlight(radiance(level, 0.002), CAMERA, POSE, BALLS[0], 0) is None


def test_a_ball_outside_the_picture_is_not_searched():
    aside = Pose(POSE.rotation, POSE.translation + np.array([1000.0, 0, 0]))
    assert find_highlight(radiance(np.zeros(SIZE[::-1]), 0.002), CAMERA, aside, BALLS[0], 0) is None
