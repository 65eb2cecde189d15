"""Sample and board as the adjustment starts with them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.adjust.start import start_sample, start_scene
from photogonio.calib.detect.limb import Limb
from photogonio.calib.geometry.cones import outline
from photogonio.capture.photoset import LightEntry, Plane
from tests.drawn.setups import BALLS, BLACK, BOARD, MIDDLE, PAPER, SAMPLE, photoset_of

PLANE = Plane(np.array([[60.0, 50], [120, 50], [120, 90]]), 3.0)


def seen(world, k: int, reading=None, *, points: int = 0) -> SimpleNamespace:
    """A photo with as many points of the true limb of the ball."""
    ball = world.sample
    edge = outline(world.camera, world.views[k], ball.center, ball.radius, points) if points else None
    limb = None if edge is None else Limb(edge, np.full(points, 0.5))
    return SimpleNamespace(pose=world.views[k], limb=limb, reading=reading, has_paper=reading is not None)


def test_a_ball_starts_where_its_limbs_show_it(drawn):
    """Across the sight, and from photos of one place no farther; limbs of a few points have no say."""
    world = replace(
        drawn[0], sample=replace(drawn[0].sample, center=SAMPLE.center + np.array([0.5, -0.4, 0.0]))
    )
    told = np.append(SAMPLE.center, SAMPLE.radius)
    found = start_sample(world.camera, [seen(world, k, points=72) for k in range(4)], SAMPLE)
    sight = world.sample.center - world.views[0].center
    off = np.cross(found[:3] - world.sample.center, sight / np.linalg.norm(sight))
    assert np.linalg.norm(off) < 0.02  # of the 0.6 that the manifest is off by
    np.testing.assert_array_equal(start_sample(world.camera, [seen(world, 0, points=20)], SAMPLE), told)
    np.testing.assert_array_equal(start_sample(world.camera, [seen(world, 0)], SAMPLE), told)
    assert start_sample(world.camera, [seen(world, 0, points=72)], PLANE) is None


@pytest.fixture
def photos(drawn):
    world, readings = drawn
    return photoset_of(world, fixed=True), world.camera, [seen(world, k, r) for k, r in enumerate(readings)]


def test_the_scene_is_the_manifests_and_the_prints(photos):
    photoset, camera, observations = photos
    told = np.append(SAMPLE.center, SAMPLE.radius)
    scene = start_scene(photoset, camera, observations, told)
    np.testing.assert_array_equal(scene.table, [[*b.center, b.radius] for b in (*BALLS, SAMPLE)])
    assert scene.black == pytest.approx(BLACK / PAPER, rel=0.01)
    assert scene.aim == tuple(SAMPLE.center) and scene.narrow == 0.0 and scene.falloff == (0.0, 0.0)
    assert scene.lamp_radius == pytest.approx(0.02 * 2 * np.linalg.norm(MIDDLE))


def test_a_shadows_edge_is_blurred_by_a_part_of_a_pixel(photos):
    """What 0.7 of a pixel is in the middle of the board, square to the sight."""
    photoset, camera, observations = photos
    scene = start_scene(photoset, camera, observations, None)
    pose = observations[0].pose
    across = pose.rotation[0]  # the camera's x in the world
    ends = camera.project(pose, MIDDLE + np.outer([-0.5, 0.5], across * scene.blur))
    assert np.linalg.norm(ends[1] - ends[0]) == pytest.approx(
        0.7, rel=0.05
    )  # the lens bends by some hundredths


@pytest.mark.parametrize(("radii", "expected"), [((5.0,), 5.0), ((5.0, None, 9.0), 7.0)])
def test_lamps_are_as_large_as_the_manifest_says(photos, radii, expected):
    photoset, camera, observations = photos
    lights = tuple(LightEntry(f"{k}", radius=r) for k, r in enumerate(radii))
    assert start_scene(replace(photoset, lights=lights), camera, observations, None).lamp_radius == expected


def test_lamps_look_at_the_middle_of_the_sample(photos):
    photoset, camera, observations = photos
    flat = start_scene(replace(photoset, sample=PLANE), camera, observations, None)
    np.testing.assert_allclose(flat.aim, [100.0, 190 / 3, 3.0])
    assert flat.sample is None
    np.testing.assert_allclose(start_scene(photoset, camera, observations, None).aim, SAMPLE.center)


def test_without_paper_or_board_there_is_no_scene(photos):
    photoset, camera, observations = photos
    dark = [SimpleNamespace(pose=s.pose, has_paper=False, reading=None) for s in observations]
    assert start_scene(photoset, camera, dark, None) is None
    assert start_scene(replace(photoset, board=None), camera, observations, None) is None
    assert start_scene(photoset, camera, dark + observations, None) is not None and BOARD is photoset.board
