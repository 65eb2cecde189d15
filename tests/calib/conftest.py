"""Drawn photos of the board and what is found in them, once for all tests."""

import numpy as np
import pytest

from photogonio.calib.adjust.intrinsics import quick_camera
from photogonio.calib.detect.photo_reader import look, look_closer
from tests.drawn.board_photos import NOISE, POSES
from tests.drawn.boards import BOARD, CAMERA, SIZE, draw, quiet, radiance, reader_of, views_of
from tests.drawn.setups import draw_paper, draw_world


@pytest.fixture(scope="session")
def reader():
    images = {f"{k}.png": radiance(draw(CAMERA, p, NOISE, k), NOISE) for k, p in enumerate(POSES)}
    return reader_of(BOARD, images)


@pytest.fixture(scope="session")
def first(reader):
    return look(reader, views_of(reader), quiet, "")


@pytest.fixture(scope="session")
def closer(reader, first):
    return look_closer(reader, quick_camera([s.corners for s in first], SIZE), first, quiet)


@pytest.fixture(scope="session")
def drawn():
    """A world and the paper of its four photos."""
    rng = np.random.default_rng(5)
    world = draw_world(rng, fixed=True, views=4)
    return world, [draw_paper(world, k, rng) for k in range(4)]
