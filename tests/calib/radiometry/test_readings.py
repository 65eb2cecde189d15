"""What patch and paper of one view say of its lamp."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from photogonio.calib.radiometry.patch import UNEVEN, Stray
from photogonio.calib.radiometry.readings import _mean, aimed, read_view
from photogonio.calib.shading.model import ShadingScene
from tests.drawn.boards import plane_points
from tests.drawn.patches import CAMERA, HEIGHT, NEAR, PATCH, POSE, SET, SIZE, STRENGTH, photo, read, strength


def test_strength_is_that_toward_the_sample_of_a_lamp_that_points_beside_it():
    """A beam whose axis passes the sample by 6 degrees: over the board its light is that of one aimed at the sample,
    but tilted. At the patch, 34 degrees from the sample, what is linear in both angles changes it by the power times
    the product of their tangents, 0.41; what is not, by half the square of that."""
    aim, beside, power = np.array([60.0, -25.0, HEIGHT]), np.array([60.0, -13.0, HEIGHT]), 6.0

    def beam(points, at):
        ray, axis = points - NEAR.place, at - NEAR.place
        return (ray @ axis / np.linalg.norm(ray, axis=-1) / np.linalg.norm(axis)) ** power

    step = 0.1 * np.eye(3)[:2]
    slope = np.array([np.log(beam(aim + s, beside) / beam(aim - s, beside)).item() for s in step]) / 0.2
    x, y = plane_points(CAMERA, POSE, HEIGHT)
    image = photo(NEAR)
    points = np.stack([x, y, np.full_like(x, HEIGHT)], axis=-1)
    dimmed = replace(image, value=(image.value * beam(points, beside).mean(0)[..., None]).astype(np.float32))
    scene = ShadingScene((), None, 1.0, 0.05, 0.0, narrow=power, aim=tuple(aim))
    low, high = np.array([-90.0, -70.0]), np.array([90.0, 70.0])
    paper, tilts = SimpleNamespace(span=(low, high)), slope * (high - low) / 2
    tilt = aimed(scene, paper, tilts)
    assert tilt[0] + np.dot(tilt[1:], aim[:2]) == pytest.approx(1.0)
    expected = STRENGTH * np.array(PATCH.reflectance) / np.pi * beam(aim, beside)
    found = read(dimmed, NEAR, Stray(scene, np.zeros(3), 0.0, tilt))
    change = power * np.tan(np.radians(5.7)) * np.tan(np.radians(34.3))
    np.testing.assert_allclose(found.value, expected, rtol=change**2 / 2)
    plain = read(dimmed, NEAR, Stray(scene, np.zeros(3), 0.0))
    assert plain.value is None and (np.abs(plain.rough.value / expected - 1) > change**2 / 2).all()
    assert aimed(replace(scene, narrow=0.0), paper, tilts) == (1.0, 0.0, 0.0)


def test_what_an_uneven_patch_tells_is_not_lost_beside_one_that_is_not_in_the_picture():
    away, image = replace(PATCH, outline=PATCH.outline + 400.0), photo(NEAR)
    image = replace(
        image, value=(image.value * np.linspace(0.2, 1.0, SIZE[0])[None, :, None]).astype(np.float32)
    )
    settled, observation = (
        SimpleNamespace(camera=CAMERA, scene=None),
        SimpleNamespace(pose=POSE, reading=None),
    )
    one, *more = (
        read_view(replace(SET, white_patches=sheets), image, settled, observation, NEAR).patch
        for sheets in ((PATCH,), (PATCH, away), (away, PATCH))
    )
    assert one.problem == UNEVEN
    for found in more:
        assert found.problem == UNEVEN
        np.testing.assert_array_equal(found.rough.value, one.rough.value)


def test_of_two_patches_the_one_in_shadow_is_not_believed():
    lit, dark = strength(STRENGTH), strength(0.6 * STRENGTH)
    found = _mean([dark, lit])
    np.testing.assert_allclose(found.value, STRENGTH)
    assert "darker" in found.problem
    assert _mean([lit, strength(1.004 * STRENGTH)]).problem == ""
