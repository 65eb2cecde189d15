"""The print as a photometric target: where paper may be read, and what is read there."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.detect.paper import PaperPlaces, covered, paper_places, sample_paper, spread_of
from photogonio.calib.geometry.camera import Camera, Pose, project_with_scale
from photogonio.calib.geometry.print_map import draw_print
from photogonio.capture.linear.signal import Windows
from photogonio.capture.photoset import MirrorBall, Plane, Sphere, WhitePatch
from photogonio.capture.radiance import RadianceImage
from tests.drawn.rooms import overhead
from tests.drawn.setups import BALLS, BOARD, photoset_of

APART = 3.0


@pytest.fixture(scope="module")
def places(drawn) -> tuple[PaperPlaces, Camera, Pose]:
    world, _ = drawn
    photoset = photoset_of(world, fixed=True)
    return (
        paper_places(photoset, world.camera, world.views[0], step=1.5, apart=APART),
        world.camera,
        world.views[0],
    )


def test_paper_is_read_clear_of_edges_things_and_the_pictures_border(places):
    found, view, pose = places
    assert len(found.points) > 1000 and not found.points[:, 2].any()
    pixels, scale = project_with_scale(view, pose, found.points)
    np.testing.assert_allclose(found.pixels, pixels)
    white, clear = draw_print(BOARD).at(found.points[:, :2])
    np.testing.assert_array_equal(found.white, white)
    assert (clear * scale > np.where(white, 2.3, 3.3)).all() and {True, False} == set(white.tolist())
    assert (pixels > 2).all() and (pixels < np.array(view.size) - 3).all()
    for ball in BALLS:
        assert np.hypot(*(found.points[:, :2] - ball.center[:2]).T).min() > APART * ball.radius


def test_samples_of_one_square_lie_within_it(places):
    found = places[0]
    for square in np.unique(found.square)[:10]:
        own = found.points[found.square == square, :2]
        assert (np.ptp(own, axis=0) <= BOARD.square_length).all()
        assert len(np.unique(own // BOARD.square_length, axis=0)) == 1


def plain(places: PaperPlaces, image: RadianceImage):
    """As a reader gives it: each pixel's four neighbours right and down."""

    def near(pixels):
        windows = Windows(pixels, 0, 1)
        parts = (image.value, image.variance, image.valid, image.saturated)
        return RadianceImage(*(windows.of(part) for part in parts))

    return sample_paper(places, near)


def test_a_pictures_ramp_is_read_between_its_pixels(places):
    """Bilinear: exact for a plane of light, and variances weigh as the light does."""
    found, view, _ = places
    width, height = view.size
    y, x = np.mgrid[0:height, 0:width].astype(float)
    value = np.stack([0.2 + 1e-3 * x + 2e-3 * y, 1.0 - 1e-3 * y], axis=-1)
    clear = np.ones((height, width), bool)
    image = RadianceImage(value, 1e-6 * value, clear, ~clear)
    samples = plain(found, image)
    u, v = found.pixels.T
    expected = np.stack([0.2 + 1e-3 * u + 2e-3 * v, 1.0 - 1e-3 * v], axis=-1)
    np.testing.assert_allclose(samples.value, expected, rtol=1e-12)
    np.testing.assert_allclose(samples.variance, 1e-6 * expected, rtol=1e-12)


def test_what_touches_a_saturated_or_missing_pixel_is_left_out(places):
    found, view, _ = places
    width, height = view.size
    value, clear = np.ones((height, width, 1)), np.ones((height, width), bool)
    saturated = np.zeros_like(clear)
    one, other = np.floor(found.pixels[[5, 400]]).astype(int)
    saturated[one[1] + 1, one[0]] = True
    value[other[1], other[0] + 1] = np.nan
    samples = plain(found, RadianceImage(value, 1e-4 * np.ones_like(value), clear, saturated))
    corners = np.floor(found.pixels).astype(int)
    off = np.zeros(len(corners), bool)
    for x, y in ((one[0], one[1] + 1), (other[0] + 1, other[1])):
        off |= ((corners <= [x, y]) & (corners >= [x - 1, y - 1])).all(1)
    assert len(samples) == len(corners) - off.sum() < len(corners)
    np.testing.assert_array_equal(samples.points, found.points[~off])
    assert sample_paper(found, lambda pixels: None) is None


def test_a_pixel_gathers_what_its_blur_covers_of_the_board(drawn):
    """Drawn pixels about each place, followed to the board: their covariance, to what 4000 draws tell."""
    world, _ = drawn
    view, pose, rng = world.camera, world.views[1], np.random.default_rng(0)
    points = np.array([[60.0, 40, 0], [120, 100, 0]])
    spread = spread_of(view, pose, points, 0.4)
    for point, (xx, xy, yy) in zip(points, spread, strict=True):
        pixels = view.project(pose, point[None]) + np.sqrt(0.4) * rng.normal(size=(4000, 2))
        rays = view.world_rays(pose, pixels)
        there = pose.center - (pose.center[2] / rays[:, 2])[:, None] * rays
        sampled = np.cov(there[:, :2].T)
        size = np.sqrt(np.linalg.det(sampled))
        np.testing.assert_allclose(
            [xx, xy, yy], sampled[[0, 0, 1], [0, 1, 1]], atol=5 * np.sqrt(2 / 4000) * 2 * size
        )


EYE = overhead(300.0)
BALL = Sphere(np.array([0.0, 0, 10]), 10.0)
SHEET = WhitePatch(np.array([[40.0, -10], [60, -10], [60, 10], [40, 10]]), 0.0, (0.9,))


@pytest.mark.parametrize(("beyond", "hidden"), [(-0.05, True), (0.05, False)])
def test_what_a_ball_hides_is_the_shadow_of_the_eye(beyond, hidden):
    """From straight above: the tangent cone meets the board at R cot of its half angle, sin = R / (d - R)."""
    half = np.arcsin(12.0 / (300.0 - 10.0))
    reach = 300.0 * np.tan(half) + beyond
    turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    points = np.column_stack([reach * np.cos(turn), reach * np.sin(turn), np.zeros(16)])
    assert (covered(points, EYE, BALL, (), (), 2.0) == hidden).all()
    beside = MirrorBall(BALL.center, BALL.radius)
    away = Plane(np.array([[90.0, 90], [95, 90], [95, 95]]), 0.0)
    assert (covered(points, EYE, away, (beside,), (), 2.0) == hidden).all()


@pytest.mark.parametrize(("beyond", "hidden"), [(-0.05, True), (0.05, False)])
def test_sheets_hide_their_outline_and_a_margin(beyond, hidden):
    x = 60 + 3.0 + beyond
    assert (covered(np.array([[x, 0.0, 0.0]]), EYE, BALL, (), (SHEET,), 3.0) == hidden).all()
    raised = WhitePatch(
        SHEET.outline, 30.0, (0.9,)
    )  # a tenth of the way up to the eye: it hides 10/9 as far out
    far = (60 + 3.0 + beyond) / 0.9
    assert (covered(np.array([[far, 0.0, 0.0]]), EYE, BALL, (), (raised,), 3.0) == hidden).all()


def test_no_print_no_places(drawn):
    world, _ = drawn
    photoset = replace(photoset_of(world, fixed=True), board=None)
    assert paper_places(photoset, world.camera, world.views[0], step=2.0, apart=3.0) is None
