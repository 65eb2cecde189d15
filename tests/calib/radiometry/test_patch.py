"""A lamp's strength read off the white patch or the paper; patches that lie are not believed."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.calib.radiometry.patch import Stray, read_paper, read_patch
from photogonio.calib.shading.model import Ball, ShadingScene
from tests.drawn.boards import plane_points
from tests.drawn.patches import CAMERA, FAR, HEIGHT, NEAR, PATCH, POSE, SIZE, STRENGTH, paper, photo, read


@pytest.mark.parametrize("light", [NEAR, FAR], ids=["near", "far"])
def test_strength_comes_back_from_a_patch(light):
    found = read(photo(light), light)
    assert found.value is not None, found.problem
    expected = STRENGTH * np.array(PATCH.reflectance) / np.pi
    # thousands of pixels with 0.2 % to 0.5 % of noise each: their median is sure to a few parts in ten thousand
    np.testing.assert_allclose(found.value, expected, rtol=5e-4)
    assert (np.abs(found.value - expected) < 2 * found.error).all()


def test_strength_is_what_a_narrow_lamp_sends_along_its_axis():
    """A lamp that points beside the patch lights it less, by the cosine squared at each pixel."""
    aim, power = np.array([40.0, 60.0, 0.0]), 2.0
    x, y = plane_points(CAMERA, POSE, HEIGHT)
    ray, axis = np.stack([x, y, np.full_like(x, HEIGHT)], axis=-1) - NEAR.place, aim - NEAR.place
    cosine = (ray @ axis / np.linalg.norm(ray, axis=-1) / np.linalg.norm(axis)).mean(0)
    image = photo(NEAR)
    dimmed = replace(image, value=(image.value * cosine[..., None] ** power).astype(np.float32))
    stray = Stray(ShadingScene((), None, 1.0, 0.05, 0.0, narrow=power, aim=tuple(aim)), np.zeros(3), 0.0)
    expected = STRENGTH * np.array(PATCH.reflectance) / np.pi
    np.testing.assert_allclose(read(dimmed, NEAR, stray).value, expected, rtol=5e-4)
    ignored = read(dimmed, NEAR)
    assert ignored.value is None or (ignored.value < 0.95 * expected).all()


def test_the_light_across_the_patch_is_uneven_enough_to_need_falloff_and_angle():
    image = photo(NEAR)
    wrong = replace(NEAR, place=NEAR.place + np.array([0.0, 0, 30.0]))
    truth, off = read(image, NEAR), read(image, wrong)
    assert truth.value is not None
    assert off.value is None or np.abs(off.value / truth.value - 1).min() > 0.1


def test_the_pull_is_how_the_reading_turns_with_the_lamps_place():
    image, step = photo(NEAR), 0.05
    pull = read(image, NEAR).pull
    slopes = []
    for axis in np.eye(3):
        there, back = (read(image, replace(NEAR, place=NEAR.place + s * step * axis)) for s in (1, -1))
        slopes.append(-np.log(there.value / back.value).mean() / (2 * step))
    # the median's slope is that of the middle of the patch; the mean's differs by its curvature, percents
    np.testing.assert_allclose(slopes, pull, atol=0.05 * np.linalg.norm(pull))
    np.testing.assert_array_equal(read(photo(FAR), FAR).pull, 0.0)


def test_a_clipped_patch_is_not_believed():
    image = photo(NEAR)
    level = image.value[..., 0]
    saturated = level > np.quantile(level, 0.7)
    found = read(replace(image, saturated=saturated, valid=~saturated), NEAR)
    assert found.value is None
    assert "clipped" in found.problem


def test_a_patch_in_a_soft_shadow_is_not_believed():
    image = photo(NEAR)
    across = np.linspace(0.2, 1.0, SIZE[0])[None, :, None]
    found = read(replace(image, value=(image.value * across).astype(np.float32)), NEAR)
    assert found.value is None
    assert "uneven" in found.problem


@pytest.mark.parametrize("share", [0.1, 0.35, 0.6, 0.9])
@pytest.mark.parametrize("tone", [0.0, 0.3, 0.85])
def test_a_hard_shadow_does_not_lower_the_strength_however_much_it_covers(share, tone):
    """Also what hides a part of the patch, where it is darker."""
    image = photo(NEAR)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    seen = CAMERA.project(POSE, np.column_stack([PATCH.outline, np.full(4, HEIGHT)]))
    low, high = seen[:, 0].min(), seen[:, 0].max()
    edge = np.clip((x + 0.1 * y - low - share * (high - low)) / 2, 0, 1)  # soft over two pixels
    value = image.value * (tone + (1 - tone) * edge)[..., None]
    found = read(replace(image, value=value.astype(np.float32)), NEAR)
    assert found.value is not None, found.problem
    expected = STRENGTH * np.array(PATCH.reflectance) / np.pi
    # hundreds of pixels are left: their median is sure to a part in two thousand
    np.testing.assert_allclose(found.value, expected, rtol=2e-3)
    assert (np.abs(found.value - expected) < 2 * found.error).all()


def test_blemishes_and_an_even_gradient_are_no_shadow():
    image = photo(NEAR)
    value = image.value.copy()
    value[::11, ::13] *= 0.5
    clean = read(image, NEAR)
    np.testing.assert_allclose(read(replace(image, value=value), NEAR).value, clean.value, rtol=1e-3)
    across = np.linspace(0.97, 1.03, SIZE[0])[None, :, None]
    tilted = read(replace(image, value=(image.value * across).astype(np.float32)), NEAR)
    np.testing.assert_allclose(tilted.value, clean.value, rtol=0.01)


@pytest.mark.parametrize("gain", [1.15, 1.4])
def test_bright_specks_all_over_make_no_shadow_of_the_rest(gain):
    """A rough metal ball throws them: what is beside every speck is not dark, though it is darker."""
    image = photo(NEAR)
    specks = np.random.default_rng(4).random(SIZE[::-1]) < 0.05
    thrown = replace(image, value=(image.value * np.where(specks, gain, 1.0)[..., None]).astype(np.float32))
    found, clean = read(thrown, NEAR), read(image, NEAR)
    assert found.value is not None, found.problem
    # of ten thousand pixels a twentieth is gone: the median moves by a part of its own error
    assert (np.abs(found.value - clean.value) < clean.error).all()


def test_a_patch_in_the_samples_shadow_is_not_read():
    foot = np.array([0.0, 0, HEIGHT])
    ball = Ball(foot + 0.6 * (NEAR.place - foot), 30.0)
    stray = Stray(ShadingScene((), ball, 1.0, 0.05, 0.1), np.zeros(3), 0.0)
    found = read(photo(NEAR), NEAR, stray)
    assert found.value is None
    assert "shadow" in found.problem


def test_a_patch_outside_the_picture_or_black_is_not_read():
    away = replace(PATCH, outline=PATCH.outline + 400.0)
    assert read_patch(photo(NEAR), CAMERA, POSE, NEAR, away, None).value is None
    image = photo(NEAR)
    assert "black" in read(replace(image, value=np.zeros_like(image.value)), NEAR).problem


def test_a_lamp_below_the_patch_lights_nothing():
    assert read(photo(NEAR), replace(NEAR, place=np.array([10.0, 0, -50]))).value is None


@pytest.mark.parametrize("light", [NEAR, FAR], ids=["near", "far"])
def test_paper_and_print_tell_strength_times_reflectance(light):
    reading = paper(light, 0.85, 0.05)
    np.testing.assert_allclose(read_paper(reading, light, None).value, 0.85 * STRENGTH / np.pi, rtol=1e-6)
    dark = read_paper(reading, light, None, white=False)
    np.testing.assert_allclose(dark.value, 0.05 * STRENGTH / np.pi, rtol=1e-6)
