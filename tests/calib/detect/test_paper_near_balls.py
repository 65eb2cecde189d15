"""Paper close to polished balls: the ring that is read, and the print as the camera blurs it."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.detect.paper_near_balls import ClosePlaces, close_paper, close_places
from photogonio.calib.geometry.print_map import draw_print
from photogonio.capture.radiance import RadianceImage
from tests.drawn.setups import BALLS, BOARD, PATCH, SAMPLE


@pytest.fixture(scope="module")
def places(drawn) -> ClosePlaces:
    world, _ = drawn
    return close_places(BOARD, world.camera, world.views[0], sample=SAMPLE, balls=BALLS, patches=(PATCH,))


def test_a_ring_about_each_ball_is_read(places):
    away = np.array([np.hypot(*(places.points[:, :2] - b.center[:2]).T) / b.radius for b in BALLS])
    assert away.min() >= 1.1 and away.min(axis=0).max() <= 4.0
    assert min((away.argmin(axis=0) == k).sum() for k in range(len(BALLS))) > 50
    assert not places.points[:, 2].any() and (places.doubt < 0.2).all()


def test_pixels_see_their_points(places, drawn):
    world, _ = drawn
    seen = world.camera.project(world.views[0], places.points)
    np.testing.assert_allclose(seen, places.pixels, atol=1e-5)


def test_the_share_of_white_is_that_of_the_blurred_print(places, drawn):
    """Against many draws of the blur at some pixels: eight nodes a side of an even mean, and 2000 draws, are 0.03 off
    where an edge of the print runs through."""
    world, _ = drawn
    rng, print_ = np.random.default_rng(1), draw_print(BOARD)
    chosen = rng.choice(len(places.points), 40, replace=False)
    off = []
    for k in chosen:
        pixels = places.pixels[k] + 0.58 * rng.normal(size=(2000, 2))
        rays, eye = world.camera.world_rays(world.views[0], pixels), world.views[0].center
        there = eye - (eye[2] / rays[:, 2])[:, None] * rays
        off.append(print_.tone_at(there[:, :2]).mean() - places.white[k])
    assert np.abs(off).max() < 0.05 and abs(np.mean(off)) < 0.005
    assert places.white.min() < 0.2 and places.white.max() > 0.99


def test_an_even_print_is_the_surest(places):
    """Where all that a pixel sees is white or black, there is no edge that may be drawn beside its place."""
    even = places.uneven < 1e-9
    assert 0.2 < even.mean() < 0.9
    assert np.isin(np.round(places.white[even], 6), [0.0, 1.0]).all()
    white = places.white > 0.5
    assert places.doubt[even].max() <= np.median(places.doubt[~even & white])


def picture(places: ClosePlaces, channels: int = 3) -> RadianceImage:
    """The first of each place's four pixels is its number and more in each channel; the others mean nothing."""
    count = len(places.points)
    value = np.full((count, 4, channels), 99.0)
    value[:, 0] = np.arange(count)[:, None] + np.arange(channels)
    value, clear = value.reshape(2 * count, 2, channels), np.ones((2 * count, 2), bool)
    return RadianceImage(value, np.full_like(value, 0.03), clear, ~clear)


def test_light_is_the_mean_of_the_channels_with_the_drawings_doubt(places):
    found = close_paper(places, lambda pixels: picture(places))
    level = np.arange(len(places.points)) + 1.0
    np.testing.assert_allclose(found.level, level)
    np.testing.assert_allclose(found.noise, 0.03 / 3 + (places.doubt * level) ** 2)


def test_saturated_pixels_are_left_out_and_few_are_none(places):
    count = len(places.points)
    for left in (29, 30):
        image = picture(places)
        saturated = np.zeros((count, 4), bool)
        saturated[left:, 0] = True
        saturated[:, 3] = True  # another's
        found = close_paper(
            places, lambda pixels, s=saturated, i=image: replace(i, saturated=s.reshape(-1, 2))
        )
        assert (found is None) == (left < 30) and (found is None or len(found.level) == left)
    assert close_paper(places, lambda pixels: None) is None


def test_where_no_print_is_known_nothing_is_close(drawn):
    world, _ = drawn
    args = {"sample": SAMPLE, "patches": ()}
    assert close_places(BOARD, world.camera, world.views[0], balls=(), **args) is None


def test_what_is_kept_is_kept_of_all(places):
    found = close_paper(places, lambda pixels: picture(places))
    mask = np.arange(len(found.level)) % 3 == 0
    part = found.keep(mask)
    np.testing.assert_array_equal(part.level, found.level[mask])
    np.testing.assert_array_equal(part.aside, found.aside[mask])
    assert replace(found, aside=None).keep(mask).aside is None
