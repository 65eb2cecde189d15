"""Print that is seen is told from print that is hidden, in shade too."""

import numpy as np
import pytest

from photogonio.calib.identify.covered import cover_of
from tests.drawn.boards import BOARD, CAMERA, draw, looking_at

POSE = looking_at(np.array([48.0, -90.0, 220.0]), np.array([48.0, 36.0, 0.0]))


@pytest.fixture(scope="module")
def level():
    return draw(CAMERA, POSE, 0.003, 0).astype(np.float32)


def test_of_a_bare_board_nothing_is_hidden(level):
    assert cover_of(BOARD, level, CAMERA, POSE).share < 0.005


def test_light_that_falls_off_hides_nothing(level):
    width, height = CAMERA.size
    fading = np.linspace(1.0, 0.3, width, dtype=np.float32)[None] * np.ones((height, 1), np.float32)
    assert cover_of(BOARD, level * fading, CAMERA, POSE).share < 0.01


def test_what_lies_on_the_board_is_hidden(level):
    spoilt = level.copy()
    middle = CAMERA.project(POSE, np.array([[48.0, 36.0, 0.0]]))[0].astype(int)
    spoilt[middle[1] - 40 : middle[1] + 40, middle[0] - 40 : middle[0] + 40] = 0.35
    cover = cover_of(BOARD, spoilt, CAMERA, POSE)
    near = np.linalg.norm(cover.points - [48.0, 36.0], axis=1)
    assert (cover.hidden[near < 6] == 1).mean() > 0.5 and not (cover.hidden[near < 6] == 0).any()
    assert (cover.hidden[near > 30] == 1).mean() < 0.01
