"""White patches as paper: the light that was drawn on one, cell by cell, and what must not be read."""

from dataclasses import replace

import numpy as np

from photogonio.calib.detect.paper_reading import PatchSamples, patch_places, sample_patches
from photogonio.capture.linear.signal import Windows
from photogonio.capture.photoset import Sphere, WhitePatch
from photogonio.capture.radiance import RadianceImage
from tests.drawn.patches import CAMERA, HEIGHT, NEAR, NOISE, PATCH, POSE, SIZE, STRENGTH, lit_by

AWAY = Sphere(np.array([500.0, 500, 25]), 25.0)


def picture(clipped: slice | None = None) -> RadianceImage:
    """The patch under a near lamp, everywhere in the plane of its top; columns of it clipped."""
    value = lit_by(NEAR)[..., None] * STRENGTH * np.array(PATCH.reflectance) / np.pi
    full = np.zeros(value.shape[:2], bool)
    if clipped is not None:
        full[:, clipped] = True
    return RadianceImage(value, (NOISE * value) ** 2, ~full, full)


def read(image: RadianceImage, patch: WhitePatch = PATCH, sample: Sphere = AWAY) -> PatchSamples | None:
    def near(pixels: np.ndarray) -> RadianceImage:
        windows = Windows(pixels, 0, 1)
        parts = (windows.of(one) for one in (image.value, image.variance, image.valid, image.saturated))
        return RadianceImage(*parts)

    places = patch_places(CAMERA, POSE, (patch,), step=2.0, cell=20.0, sample=sample, balls=())
    return None if places is None else sample_patches(places, near)


def test_samples_are_what_the_lamp_makes_of_the_patch():
    found = read(picture())
    assert found is not None and len(found) > 300
    low, high = PATCH.outline.min(0), PATCH.outline.max(0)
    assert ((found.points[:, :2] > low) & (found.points[:, :2] < high)).all()
    assert (found.points[:, 2] == HEIGHT).all()
    offset = NEAR.place - found.points
    light = offset[:, 2] / np.linalg.norm(offset, axis=1) ** 3
    expected = light * (STRENGTH * np.array(PATCH.reflectance)).mean() / np.pi
    np.testing.assert_allclose(found.level, expected, rtol=2e-3)  # between pixels light is taken as straight
    np.testing.assert_allclose(found.reflectance, np.mean(PATCH.reflectance))
    assert len(np.unique(found.square)) == 9  # of 60 by 50, in cells of 20


def test_of_a_cell_that_is_partly_clipped_nothing_is_read():
    whole, cut = read(picture()), read(picture(slice(SIZE[0] // 2, None)))
    assert whole is not None and cut is not None
    lost = set(whole.square) - set(cut.square)
    assert lost and len(cut) < len(whole)
    for cell in set(cut.square):
        assert (cut.square == cell).sum() == (whole.square == cell).sum()


def test_what_stands_before_a_patch_and_what_lies_outside_the_picture_is_left_out():
    before = Sphere(np.array([0.0, -25, 12]), 12.0)
    hidden = read(picture(), sample=before)
    whole = read(picture())
    assert hidden is not None and whole is not None and len(hidden) < len(whole)
    assert read(picture(), replace(PATCH, outline=PATCH.outline + 5000.0)) is None


def test_a_patch_narrower_than_the_grid_is_read_along_its_middle():
    narrow = replace(PATCH, outline=PATCH.outline * [1.0, 0.3])
    found = read(picture(), narrow)
    assert found is not None and np.ptp(found.points[:, 0]) > 40


def test_some_of_the_samples_are_kept_with_all_that_belongs_to_them():
    found = read(picture())
    assert found is not None
    some = found.keep(found.square == found.square[0])
    assert 0 < len(some) < len(found) and some.points.shape == (len(some), 3) and len(some.aside) == len(some)
