"""A photo with what calibration found drawn on it: where it is, in its own colour."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.detect.gray import gray
from photogonio.calib.geometry.cones import outline
from photogonio.calib.report.overlay import (
    BALL,
    CORNER,
    HIGHLIGHT,
    REJECTED,
    SAMPLE,
    draw_marks,
    mark_view,
    picture_of,
    white_of,
)
from photogonio.calib.setup import Light, Marks, Setup, ViewSetup
from photogonio.capture.photoset import MirrorBall, Plane, Sphere
from tests.drawn.boards import radiance
from tests.drawn.rooms import camera, overhead

CAMERA, ABOVE = camera(160, 120, 400.0), overhead(400.0)
NONE = np.zeros((0, 2))
LAMP = Light("a", "point", np.array([0.0, 0, 300]), np.zeros((3, 3)), "given")
BALLS = (MirrorBall(np.array([-40.0, 20, 8]), 8.0),)


def image():
    y, x = np.mgrid[0:120, 0:160]
    return radiance(0.2 + 0.001 * (x + y), 0.0, 3)


def pictured(one):
    return picture_of(one, white_of(gray(one)))


@pytest.mark.parametrize("channels", [1, 3, 5])
def test_tones_rise_with_light_whatever_the_exposure(channels):
    level = np.linspace(0.01, 1.0, 160) * np.ones((120, 1))
    found = [pictured(radiance(scale * level, 0.0, channels)) for scale in (1.0, 1000.0)]
    assert found[0].shape == (120, 160, 3) and found[0].dtype == np.uint8
    assert np.abs(found[0].astype(int) - found[1]).max() <= 1
    assert (np.diff(found[0][0, :, 0].astype(int)) >= 0).all() and found[0].max() == 255
    assert not pictured(radiance(np.zeros((4, 4)), 0.0, channels)).any()


def test_pixels_that_are_not_used_are_tinted_unless_they_are_dark():
    one = image()
    one.saturated[10, 20] = True
    one.valid[30, 40] = one.valid[50, 60] = False
    one.value[50, 60] = 0.0
    plain, found = pictured(image()).astype(int), pictured(one).astype(int)
    changed = np.argwhere((found != plain).any(axis=2))
    assert changed.tolist() == [[10, 20], [30, 40], [50, 60]]
    for y, x in changed[:2]:
        np.testing.assert_allclose(found[y, x], (plain[y, x] + np.array(REJECTED)) / 2, atol=1)
    assert (found[50, 60] == 0).all()


def near(picture: np.ndarray, plain: np.ndarray, color, pixels: np.ndarray) -> np.ndarray:
    """Which of some pixels (n, 2) are drawn, toward a colour, within a pixel of them."""
    moved = picture.astype(int) - plain
    toward = (moved * (np.array(color) - plain)).sum(axis=2) > 2000
    return np.array(
        [toward[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].any() for x, y in np.round(pixels).astype(int)]
    )


@pytest.mark.parametrize("flat", [False, True])
def test_outlines_lie_where_ball_and_sample_are_seen(flat):
    ball, sheet = (
        Sphere(np.array([20.0, -10, 15]), 15.0),
        np.array([[0.0, -30], [40, -30], [40, 10], [0, 10]]),
    )
    sample = Plane(sheet, 5.0) if flat else ball
    view = ViewSetup("a", LAMP, ABOVE, np.ones(3), np.zeros(3), "none")
    setup = Setup(CAMERA, sample, (view,), "relative", ("R", "G", "B"), mirror_balls=BALLS)
    plain = pictured(image())
    picture = plain.copy()
    mark_view(picture, setup, view)
    limb = outline(CAMERA, ABOVE, BALLS[0].center, BALLS[0].radius)
    assert near(picture, plain, BALL, limb).all()
    edge = outline(CAMERA, ABOVE, ball.center, ball.radius)
    if flat:
        corners, share = (
            CAMERA.project(ABOVE, np.column_stack([sheet, np.full(4, 5.0)])),
            np.linspace(0, 1, 9),
        )
        edge = corners[:, None] + share[:, None] * (np.roll(corners, 1, axis=0) - corners)[:, None]
        edge = edge.reshape(-1, 2)
    assert near(picture, plain, SAMPLE, edge).all()
    drawn = (picture != plain).any(axis=2).sum()
    assert 0 < drawn < 3 * (np.pi * 16 + 4 * 45)  # lines, and no more


def test_residuals_are_drawn_a_hundredfold():
    plain = pictured(image())
    marks = Marks(np.array([[40.0, 60.0]]), np.array([[0.3, 0.0]]), NONE, NONE, NONE, NONE)
    picture = plain.copy()
    draw_marks(picture, marks)
    along = np.column_stack([np.arange(44, 71), np.full(27, 60)])
    assert near(picture, plain, CORNER, along).all()
    assert not near(picture, plain, CORNER, np.array([[74.0, 60.0], [30.0, 60.0]])).any()


def test_every_kind_of_mark_has_its_colour_and_places_outside_do_no_harm():
    plain = pictured(image())
    nowhere = np.array([[np.nan, 5.0], [1e9, -1e9]])
    marks = Marks(
        np.vstack([[[20.0, 20]], nowhere]),
        np.zeros((3, 2)),
        np.array([[60.0, 20]]),
        np.array([[100.0, 20]]),
        np.array([[20.0, 80]]),
        np.vstack([[[60.0, 80]], nowhere]),
    )
    picture = plain.copy()
    draw_marks(picture, marks)
    ring = np.array([[64.0, 80]])
    for color, place in (
        (CORNER, [[22.0, 20]]),
        (REJECTED, [[60.0, 20]]),
        (SAMPLE, [[100.0, 20]]),
        (HIGHLIGHT, [[20.0, 80]]),
        (HIGHLIGHT, ring),
    ):
        assert near(picture, plain, color, np.array(place)).all()
    again, inside = plain.copy(), replace(marks, corners=marks.corners[:1], corner_misses=np.zeros((1, 2)))
    draw_marks(again, replace(inside, expected_highlights=marks.expected_highlights[:1]))
    np.testing.assert_array_equal(again, picture)
