"""Photos that are stored upside down: of a fixed camera by where they show the board, of a moving one by where the
lens's axis goes through them."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.adjust.intrinsics import quick_camera
from photogonio.calib.detect.photo_reader import Seen, look
from photogonio.calib.diagnose.photos.turned_photos import (
    mirrored_photos,
    turned_against_given,
    turned_against_lens,
    turned_photos,
    upright,
)
from photogonio.calib.geometry.camera import Camera
from tests.drawn.board_photos import POSES
from tests.drawn.boards import BOARD, CAMERA, draw, quiet, radiance, reader_of, views_of
from tests.drawn.calibrations import Drawn
from tests.drawn.setups import SIZE


def about(corners):
    return replace(corners, pixels=np.array(SIZE) - 1 - corners.pixels)


def drawn_photos(turned: tuple[int, ...], *, views: int = 8, fixed: bool = True, seed: int = 3):
    drawn = Drawn(seed, fixed=fixed, views=views)
    return drawn, [about(one) if k in turned else one for k, one in enumerate(drawn.samples)]


@pytest.mark.parametrize("turned", [(), (2,), (0, 5), (1, 4, 7)])
def test_those_that_are_upside_down_are_found(turned):
    _, corners = drawn_photos(turned)
    assert turned_photos([(one, SIZE) for one in corners]) == list(turned)


def test_none_is_accused_where_as_many_are_one_way_as_the_other():
    _, corners = drawn_photos((0, 1, 2, 3))
    assert turned_photos([(one, SIZE) for one in corners]) == []


def test_a_photo_turned_twice_is_as_it_was():
    drawn, _ = drawn_photos(())
    one = Seen(drawn.photoset.views("sample")[0], drawn.samples[0], SIZE)
    twice = upright(upright(one))
    assert twice.view == one.view and upright(one).view.photos[0].turned
    np.testing.assert_allclose(twice.corners.pixels, one.corners.pixels)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("turned", [(), (2,), (0, 3, 5)])
def test_a_moving_cameras_are_found_by_its_lens(turned, seed):
    """Most of them, and nobody else: all whose own corners tell."""
    drawn, corners = drawn_photos(turned, fixed=False, seed=seed)
    every = [*drawn.boards, *corners]
    found = turned_against_lens(quick_camera(every, SIZE), every)
    wanted = {len(drawn.boards) + k for k in turned}
    assert set(found) <= wanted and len(found) >= len(wanted) - 1


@pytest.mark.parametrize("seed", range(4))
def test_none_is_accused_whose_axis_goes_through_the_middle(seed):
    drawn, _ = drawn_photos((), fixed=False, seed=seed)
    camera = drawn.world.camera
    centred = Camera(camera.matrix.copy(), camera.distortion * [1, 1, 0, 0, 0], SIZE)
    centred.matrix[:2, 2] = 0.5 * (np.array(SIZE) - 1)
    rng, every = np.random.default_rng(seed), []
    for pose, one in zip(
        [*drawn.world.boards, *drawn.world.views], [*drawn.boards, *drawn.samples], strict=False
    ):
        there = centred.project(pose, one.points)
        every.append(replace(one, pixels=there + 0.03 * rng.normal(size=there.shape)))
    assert turned_against_lens(quick_camera(every, SIZE), every) == []


@pytest.mark.parametrize("turned", [(), (1, 4), tuple(range(8))])
def test_a_given_camera_tells_them_each(turned):
    drawn, corners = drawn_photos(turned, fixed=False, seed=2)
    assert turned_against_given(drawn.world.camera, corners) == list(turned)


def test_a_mirrored_photo_among_others_is_found_and_one_without_a_board_is_not():
    shown = draw(CAMERA, POSES[0], 0.004, 0)
    levels = {
        "a.png": shown,
        "b.png": np.ascontiguousarray(shown[:, ::-1]),
        "c.png": np.full_like(shown, 0.3),
    }
    reader = reader_of(BOARD, {name: radiance(level, 0.004) for name, level in levels.items()})
    assert mirrored_photos(reader, look(reader, views_of(reader), quiet, "")) == ["b.png"]


@pytest.mark.parametrize("zoom", [0.97, 1.01, 1.03])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("fixed", [True, False])
def test_none_is_accused_that_was_focused_or_zoomed_otherwise(zoom, seed, fixed):
    """The bare board's photos, or the later half of the sample's; and of those that are turned as well, no others."""
    drawn, _ = drawn_photos((), fixed=fixed, seed=seed)
    middle = 0.5 * (np.array(SIZE) - 1)

    def zoomed(corners):
        return replace(corners, pixels=middle + zoom * (corners.pixels - middle))

    boards, some = [zoomed(one) for one in drawn.boards], [zoomed(one) for one in drawn.samples[4:]]
    for every in ([*boards, *drawn.samples], [*drawn.boards, *drawn.samples[:4], *some]):
        assert turned_against_lens(quick_camera(every, SIZE), every) == []
    if not fixed:
        every = [*boards, *(about(one) if k in (0, 3, 5) else one for k, one in enumerate(drawn.samples))]
        wanted = {len(boards) + k for k in (0, 3, 5)}
        assert set(turned_against_lens(quick_camera(every, SIZE), every)) <= wanted


@pytest.mark.parametrize("zoom", [0.97, 0.99, 1.01, 1.03])
def test_a_given_camera_hardly_accuses_any_that_was_focused_or_zoomed_otherwise(zoom):
    """One photo by itself may be as well explained turned, by chance: of 32, one at most."""
    accused, middle = 0, 0.5 * (np.array(SIZE) - 1)
    for seed in range(4):
        drawn, corners = drawn_photos((), fixed=False, seed=seed)
        zoomed = [replace(one, pixels=middle + zoom * (one.pixels - middle)) for one in corners]
        accused += len(turned_against_given(drawn.world.camera, zoomed))
    assert accused <= 1
