"""Corners placed by the whole print: what is kept of a photo about them, and where they then lie."""

import numpy as np
import pytest
from scipy.special import erf

from photogonio.calib.detect.gray import finite, gray
from photogonio.calib.detect.subpixel import Around, Template, refined_corners, register
from photogonio.calib.geometry.board import board_points
from photogonio.calib.geometry.camera import Camera, Pose
from photogonio.calib.geometry.print_map import Print, draw_print
from tests.drawn.board_photos import POSES
from tests.drawn.boards import BOARD, CAMERA, views_of

RNG = np.random.default_rng(0)
REACH = 24  # of what is kept about a place
PLACES = np.array([[40.2, 30.7], [3.0, 50.0], [70.0, 57.6]])


@pytest.fixture(scope="module")
def level() -> np.ndarray:
    return RNG.uniform(size=(60, 80)).astype(np.float32)


def test_pieces_are_the_photo_about_each_place(level):
    usable = np.ones(level.shape, bool)
    usable[31, 40] = False
    around = Around.of(level, usable, PLACES)
    assert around.level.shape == (3, 2 * REACH + 1, 2 * REACH + 1)
    for k in range(3):
        x0, y0 = around.first[k]
        assert np.abs(around.first[k] + REACH - PLACES[k]).max() <= 0.5
        for y, x in np.ndindex(around.level.shape[1:]):
            there, here = (y0 + y, x0 + x), around.level[k, y, x]
            inside = 0 <= there[0] < 60 and 0 <= there[1] < 80 and usable[there]
            assert here == level[there] if inside else np.isnan(here)


def test_what_is_masked_may_not_be_used(level):
    around = Around.of(level, np.ones(level.shape, bool), PLACES)
    mask = RNG.random(level.shape) < 0.3
    np.testing.assert_array_equal(around.without(mask).level, Around.of(level, ~mask, PLACES).level)


@pytest.mark.parametrize(("off", "held"), [(10, True), (-10, True), (11, False), (-11, False)])
def test_a_corner_may_be_ten_pixels_astray(off, held):
    blank = np.ones((200, 200), np.float32)
    around = Around.of(blank, blank > 0, np.array([[100.0, 100.0], [60.0, 60.0]]))
    assert around.holds(np.array([[100.0 + off, 100.0], [60.0, 60.0]])) == held
    assert (
        around.holds(np.array([[500.0, 100.0], [60.0, 60.0 + off]])) == held
    )  # the first is not in the picture


@pytest.fixture(scope="module")
def photo(reader):
    image = reader(views_of(reader)[0])
    every = board_points(BOARD)
    return Around.of(gray(image), finite(image), CAMERA.project(POSES[0], every)), every


@pytest.mark.parametrize("turn", [0.0, 0.002])
def test_corners_lie_where_they_are_wherever_they_were_thought_to_be(photo, turn):
    """A pose that is off by a third of a pixel: what is found does not follow it."""
    around, every = photo
    pose = Pose.from_rodrigues([0, 0, turn], [0, 0, 0]) @ POSES[0]
    template = Template(draw_print(BOARD), BOARD.square_length)
    found, pixels, sigma = register(template, CAMERA, pose, around, every)
    true = CAMERA.project(POSES[0], every)
    assert found.sum() > 0.9 * len(every)
    miss = (pixels - true)[found]
    assert np.abs(miss.mean(0)).max() < 0.02 and np.sqrt((miss**2).mean()) < 0.05
    assert np.isfinite(sigma[found]).all() and (sigma[found] < 0.12).all() and np.isinf(sigma[~found]).all()
    apart = np.abs(CAMERA.project(pose, every) - true).max()
    assert (turn == 0) == (apart < 1e-9)


def test_squares_alone_tell_it_too(photo):
    around, every = photo
    template = Template(draw_print(BOARD), BOARD.square_length, bare=True)
    found, pixels, _ = register(template, CAMERA, POSES[0], around, every)
    miss = (pixels - CAMERA.project(POSES[0], every))[found]
    assert found.sum() > 0.6 * len(every) and np.abs(miss.mean(0)).max() < 0.03


def test_where_most_corners_are_lost_the_old_ones_stay(photo, first):
    around, every = photo
    template, corners = Template(draw_print(BOARD), BOARD.square_length), first[0].corners
    better = refined_corners(template, CAMERA, POSES[0], around, every, corners)
    assert better is not corners and set(corners.ids) <= set(better.ids)
    height, width = 360, 480
    hidden = around.without(np.arange(width)[None, :] * np.ones((height, 1)) > width / 3)
    assert refined_corners(template, CAMERA, POSES[0], hidden, every, corners) is corners


def four_squares(scale: float) -> Print:
    """Of 20 lengths a side, black at the lower left and the upper right."""
    size = round(20 * scale)
    white = np.zeros((2 * size, 2 * size), bool)
    white[:size, :size] = white[size:, size:] = True
    whole = np.ones(white.shape)
    return Print(white, white.astype(np.float32), whole.astype(np.float32), scale, whole.astype(bool))


def blurred_edge(places: np.ndarray, blur: float) -> np.ndarray:
    """Means over pixels about ``places`` of a step from -1 to 1 at 0 under a normal distribution."""

    def below(x: np.ndarray) -> np.ndarray:
        t = x / (np.sqrt(2.0) * blur)
        return np.sqrt(2.0) * blur * (t * erf(t) + np.exp(-t * t) / np.sqrt(np.pi))

    return below(places + 0.5) - below(places - 0.5)


@pytest.mark.parametrize("blur", [0.4, 0.5, 0.8])
@pytest.mark.parametrize("scale", [5.0, 8.0, 21.0])
def test_edges_along_the_rows_of_pixels_are_no_steps(scale, blur):
    """All along such an edge pixels cut the print alike, so that what a drawing in steps of a third of a pixel is off
    there, a tenth and more, all corners of a row are: wherever the row lies. A camera that looks straight on, a pixel a
    length; the blur that is drawn is half a pixel, and what another's shape differs is off by hundredths.
    """
    camera = Camera(
        np.array([[100.0, 0.0, 40.0], [0.0, 100.0, 40.0], [0.0, 0.0, 1.0]]), np.zeros(5), (81, 81)
    )
    pose = Pose(np.diag([1.0, -1.0, -1.0]), np.array([-20.0, 20.0, 100.0]))
    corners = np.array([[20.0, 20.0, 0.0], [40.0, 40.0, 0.0]])  # the second is the print's own
    template, step = Template(four_squares(scale), 20.0), np.arange(81) - 40.0
    for phase in np.arange(8) / 8 - 0.45:
        level = 0.5 + 0.5 * np.outer(blurred_edge(step - phase, blur), blurred_edge(step - 0.31, blur))
        level = level.astype(np.float32)
        around = Around.of(level, np.ones(level.shape, bool), camera.project(pose, corners))
        found, pixels, _ = register(template, camera, pose, around, corners)
        assert found[0]
        np.testing.assert_allclose(pixels[0], [40.31, 40.0 + phase], atol=0.03)
