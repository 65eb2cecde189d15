"""A sample ball far from its place in the manifest is found by its limb before the print; one in its place is left."""

from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from photogonio.calib.detect.gray import GrayPart
from photogonio.calib.detect.limb import settled_limb
from photogonio.calib.detect.observation import FIXED_POSE, Observation
from photogonio.calib.detect.photo_reader import Reader, look
from photogonio.calib.diagnose.photos import displaced_ball as astray
from photogonio.calib.diagnose.photos.displaced_ball import ball_elsewhere
from photogonio.calib.geometry.camera import Camera, focal
from photogonio.calib.geometry.cones import outline
from photogonio.capture.photoset import Photo, PhotoSet, Sphere
from tests.drawn.board_photos import MIDDLE, NOISE
from tests.drawn.boards import BOARD, CAMERA, SIZE, draw, looking_at, quiet, radiance

BALL = Sphere(np.array([50.0, 33.0, 12.0]), 12.0)
POSE = looking_at(MIDDLE + np.array([5.0, -60.0, 190.0]), MIDDLE)
LAMPS = np.array([[0.5, 0.3, 0.8], [-0.6, 0.2, 0.77], [0.0, -0.6, 0.8], [0.1, 0.7, 0.7]])


def with_ball(lamp: np.ndarray, seed: int) -> np.ndarray:
    """The board under the ball, which is gray and has one side dark."""
    level = draw(CAMERA, POSE, NOISE, seed)
    x, y = np.meshgrid(np.arange(float(SIZE[0])), np.arange(float(SIZE[1])))
    rays = CAMERA.world_rays(POSE, np.column_stack([x.ravel(), y.ravel()]))
    away = POSE.center - BALL.center
    along = rays @ away
    root = along**2 - (away @ away - BALL.radius**2)
    normal = (away + (-along - np.sqrt(np.maximum(root, 0)))[:, None] * rays) / BALL.radius
    shade = 0.4 * np.maximum(normal @ lamp, 0.0)
    return np.where(root > 0, shade, level.ravel()).reshape(level.shape)


@pytest.fixture(scope="module")
def levels():
    return {f"{k}.png": with_ball(lamp, k) for k, lamp in enumerate(LAMPS)}


def looked_for(levels, told: Sphere):
    photos = tuple(Photo(name, "sample") for name in levels)
    photoset = PhotoSet(Path("."), "drawn", "mm", told, "auto", photos, BOARD)
    reader = Reader(photoset, lambda _, view: radiance(levels[view.name], NOISE))
    seen = look(reader, photoset.views("sample"), quiet, "")
    observations = [Observation(s.view, s.view.name, s.corners, POSE, FIXED_POSE) for s in seen]
    brightest = np.max(list(levels.values()), axis=0).astype(np.float32)
    within = 2.0 + 0.04 * told.radius * focal(CAMERA) / 190.0
    usable = np.ones(brightest.shape, bool)
    observations[0].limb = settled_limb(
        GrayPart(brightest, usable), CAMERA, POSE, told.center, told.radius, within
    )
    return ball_elsewhere(photoset, reader, CAMERA, observations)


@pytest.mark.parametrize("off", [(5.0, 0.0, 0.0), (-9.0, 6.0, 0.0), (0.0, 0.0, -12.0)])
def test_a_ball_far_from_its_place_is_found(levels, off):
    found = looked_for(levels, Sphere(BALL.center + off, BALL.radius))
    # as near as its limb is looked for about the manifest's place
    assert np.linalg.norm(found.center - BALL.center) < 0.04 * BALL.radius


def test_few_places_are_tried_at_once(levels, monkeypatch):
    """So that memory does not grow with the picture."""
    told = Sphere(BALL.center + np.array([-9.0, 6.0, 0.0]), BALL.radius)
    sizes, share = [], astray._Picture.share
    monkeypatch.setattr(
        astray._Picture, "share", lambda self, limbs: sizes.append(len(limbs)) or share(self, limbs)
    )
    found = looked_for(levels, told)
    most = max(sizes)
    monkeypatch.setattr(astray, "_AT_ONCE", 100)
    sizes.clear()
    np.testing.assert_array_equal(looked_for(levels, told).center, found.center)
    assert max(sizes) <= 100 < most


def test_in_a_large_picture_a_limb_is_looked_for_in_a_smaller_one():
    """A disc of 443 pixels' radius, in a picture of a fourth of the size."""
    scale = 10
    matrix = CAMERA.matrix * np.array([[scale], [scale], [1]])
    large = Camera(matrix, CAMERA.distortion, (scale * SIZE[0], scale * SIZE[1]))
    limb = outline(large, POSE, BALL.center, BALL.radius, 400)
    level = np.zeros(large.size[::-1], np.float32)
    cv2.fillPoly(level, [np.round(limb).astype(np.int32)], 1.0)
    observation = SimpleNamespace(pose=POSE, corners=None)
    shown = astray._picture(large, observation, level, (0, 0, *large.size), BALL)
    off = BALL.radius * np.array([[0.0, 0, 0], [0.2, 0, 0], [0, -0.2, 0], [0.5, 0.5, 0]])
    share = astray._shares([shown], large, BALL.center + off, BALL.radius)
    assert shown.shrunk == 4
    assert share[0] > 0.6 and share[1:].max() < 0.5 * share[0]


def test_a_diameter_that_is_told_for_the_radius_is_seen(levels):
    found = looked_for(levels, Sphere(np.array([50.0, 33.0, 24.0]), 2 * BALL.radius))
    assert found.radius == BALL.radius and np.linalg.norm(found.center - BALL.center) < 0.04 * BALL.radius


def test_a_ball_in_its_place_is_left_there(levels):
    assert looked_for(levels, BALL) is None


def test_no_ball_is_found_where_none_is():
    bare = {f"{k}.png": draw(CAMERA, POSE, NOISE, k) for k in range(4)}
    assert looked_for(bare, BALL) is None
