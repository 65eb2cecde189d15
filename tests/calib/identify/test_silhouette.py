"""A shape is placed by the pixels that it hides, in photos of a print whose edges are stronger than its own."""

import numpy as np
import pytest

from photogonio.calib.geometry.print_map import draw_print
from photogonio.calib.geometry.visibility import behind_ball
from photogonio.calib.identify.covered import cover_of
from photogonio.calib.identify.sample import SamplePhoto, shown_by, silhouette_flat
from photogonio.calib.identify.silhouette import ball_by, best_shape, flat_by, held, seen_about
from photogonio.capture.photoset import Plane, Sphere
from tests.drawn.boards import BOARD, CAMERA, draw, looking_at

EYES = [np.array(eye) for eye in ([48.0, -90.0, 220.0], [160.0, 40.0, 210.0], [-60.0, 60.0, 200.0])]
MIDDLE = np.array([48.0, 36.0, 0.0])
BALL = Sphere(np.array([50.0, 33.0, 14.0]), 14.0)
PIECE = Plane(np.array([[27.0, 21.0], [63.0, 25.0], [60.0, 52.0], [24.0, 48.0]]), 1.5)
LAMP = np.array([120.0, 90.0, 160.0])
NEAR = 0.3  # mm: a pixel is 0.5 mm of the board, an outline some hundred pixels long
PRINT = draw_print(BOARD)


def flat_hides(piece, eye, rays):
    at = (eye + ((piece.height - eye[2]) / rays[:, 2])[:, None] * rays)[:, :2]
    corners = np.asarray(piece.outline)
    edges = np.roll(corners, -1, axis=0) - corners
    off = at[:, None] - corners
    return (edges[:, 0] * off[..., 1] - edges[:, 1] * off[..., 0] >= 0).all(axis=1)


def photos(sample, *, gray, shadow=False):
    """The board with a ball or a flat piece of ``gray``, and what a near lamp leaves of its shadow."""
    width, height = CAMERA.size
    x, y = np.meshgrid(np.arange(float(width)), np.arange(float(height)))
    pixels, made = np.column_stack([x.ravel(), y.ravel()]), []
    for k, eye in enumerate(EYES):
        pose = looking_at(eye, MIDDLE)
        rays = CAMERA.world_rays(pose, pixels)
        points = eye - (eye[2] / rays[:, 2])[:, None] * rays
        level = draw(CAMERA, pose, 0.003, k).astype(np.float32)
        if shadow:
            level[behind_ball(points, LAMP, BALL.center, BALL.radius).reshape(height, width)] *= 0.02
        if sample is not None:
            ball = isinstance(sample, Sphere)
            mask = (
                behind_ball(points, eye, sample.center, sample.radius)
                if ball
                else flat_hides(sample, eye, rays)
            )
            level[mask.reshape(height, width)] = gray
        made.append(SamplePhoto(level, pose, cover_of(BOARD, level, CAMERA, pose)))
    return made


def seen_of(made, radius=22.0):
    about = MIDDLE + radius * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    return [seen_about(p.small, p.cover, p.pose, CAMERA, PRINT, CAMERA.project(p.pose, about)) for p in made]


@pytest.mark.parametrize("gray", [0.12, 0.35, 0.6])  # nearly ink; between; nearly paper, which is 0.7
def test_a_ball_is_placed_beside_its_shadow(gray):
    seen = seen_of(photos(BALL, gray=gray, shadow=True))
    start = np.array([52.0, 35.0, np.log(16.0)])
    values, total = best_shape(seen, ball_by, start, np.array([1.0, 1.0, 0.04]))
    np.testing.assert_allclose(values[:2], BALL.center[:2], atol=NEAR)
    assert np.exp(values[2]) == pytest.approx(BALL.radius, abs=NEAR)
    assert total > held(seen, ball_by, start)


def test_a_flat_piece_is_placed_and_a_corner_too_many_falls_away():
    seen = seen_of(photos(PIECE, gray=0.35))
    corners = np.asarray(PIECE.outline)
    start = np.insert(corners, 1, corners[:2].mean(axis=0) + np.array([0.5, -1.5]), axis=0)
    found, total = silhouette_flat(seen, Plane(start + np.array([1.5, -1.0]), 0.5), 0.0)
    assert len(found.outline) == 4 and total > 0
    apart = np.linalg.norm(corners[:, None] - found.outline[None], axis=2).min(axis=1)
    assert apart.max() < 2 * NEAR  # a corner is where two edges meet
    assert found.height == pytest.approx(PIECE.height, abs=3 * NEAR)


def test_a_polygon_that_falls_behind_is_given_up():
    seen = seen_of(photos(PIECE, gray=0.35))
    start = Plane(np.asarray(PIECE.outline) + 2.0, 0.5)
    _, early = silhouette_flat(seen, start, np.inf)
    _, whole = silhouette_flat(seen, start, 0.0)
    assert early <= whole


@pytest.mark.parametrize("sample", [BALL, PIECE])
def test_a_photo_shows_the_sample_or_the_print(sample):
    with_it, bare = photos(sample, gray=0.35), photos(None, gray=0.0)
    assert shown_by([*with_it, *bare], CAMERA, PRINT, sample) == [True] * 3 + [False] * 3
    assert shown_by(with_it, CAMERA, None, sample) == [None] * 3


def test_depth_is_pixels_within_the_outline():
    """At the corners of a piece and at a ball's nearest limb it is 0, to the size of a pixel; outside below it."""
    for one in seen_of(photos(None, gray=0.0)):
        for depth, values, sample in (
            (ball_by, np.append(BALL.center[:2], np.log(BALL.radius)), BALL),
            (flat_by, np.append(np.ravel(PIECE.outline), PIECE.height), PIECE),
        ):
            rays = one.rays
            inside = (
                behind_ball(
                    one.eye - (one.eye[2] / rays[:, 2])[:, None] * rays, one.eye, BALL.center, BALL.radius
                )
                if sample is BALL
                else flat_hides(PIECE, one.eye, rays)
            )
            within = depth(one, values)
            assert (inside == (within > 0))[np.abs(within) > 0.5].all()
