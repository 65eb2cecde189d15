"""A set's own dark, ambient and flat frames: what they take out, and which are left out."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from tests.capture.small_sets import SHAPE, STEP16, value


def test_dark_ambient_and_flat_together(make, light):
    """Photos with dark signal, room light and vignetting, at their own exposures, give back the lamp's
    light.
    """
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    even = (1 - 0.3 * ((x - 39.5) ** 2 + (y - 29.5) ** 2) / 40**2)[..., None] * np.ones(3)
    dark = 0.01 + 0.005 * (x[..., None] % 7) / 7 * np.ones(3)
    room = 0.03 * (1 + y[..., None] / 60) * np.ones(3)
    photos = [
        ("s.png", "sample", (light + room) * even * 0.5 + dark, {"exposure_time": 0.5}),
        ("off.png", "ambient", room * even * 2 + dark, {"exposure_time": 2.0}),
        ("cap.png", "dark", dark, {"exposure_time": 0.5}),
        ("sheet.png", "flat", 0.6 * even + dark, {"exposure_time": 1.0}),
    ]
    photoset, reader = make(photos, '[radiometry]\nvignetting = "flat"')
    found = value(photoset, reader)
    # 1 where the flat's middle is: a tenth of the picture, where it is even to 0.3 %; and a dozen steps of rounding
    assert np.abs(found / light - 1).max() < 0.003 + 12 * STEP16 / 0.01


def test_ambient_of_another_light_is_not_subtracted(make, light):
    photos = [
        ("a.png", "sample", light + 0.1, {"light": "one"}),
        ("b.png", "sample", light + 0.2, {"light": "two"}),
        ("c.png", "ambient", np.full_like(light, 0.1), {"light": "one"}),
        ("d.png", "ambient", np.full_like(light, 0.2), {}),
    ]
    photoset, reader = make(photos)
    for number in range(2):
        assert np.abs(value(photoset, reader, number) - light).max() < 3 * STEP16


def test_cos4_divides_by_the_fourth_power(make, light):
    class Wide:
        size = SHAPE[::-1]

        def rays(self, pixels):
            plane = (pixels - [39.5, 29.5]) / 60
            rays = np.column_stack([plane, np.ones(len(plane))])
            return rays / np.linalg.norm(rays, axis=1, keepdims=True)

    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    cosine = Wide().rays(np.column_stack([x.ravel(), y.ravel()]).astype(float))[:, 2].reshape(*SHAPE, 1)
    photos = [("a.png", "sample", light * cosine**4, {})]
    photoset, reader = make(photos, '[radiometry]\nvignetting = "cos4"', camera=Wide())
    assert np.abs(value(photoset, reader) - light).max() < 3 * STEP16  # the corners are raised 1.9 times


@pytest.mark.parametrize(
    ("role", "extra", "said"),
    [("dark", "", "a dark frame"), ("flat", '[radiometry]\nvignetting = "flat"', "a flat field")],
)
def test_saturated_frames_are_refused(make, light, role, extra, said):
    with pytest.raises(InputError, match=rf"frame\.png: {said}"):
        make([("a.png", "sample", light, {}), ("frame.png", role, np.ones_like(light), {})], extra)


def test_a_dark_frame_that_shows_a_picture_is_refused_or_left_out_by_name(make, light):
    frames = [("a.png", "sample", light, {}), ("lit.png", "dark", light, {})]
    with pytest.raises(InputError, match=r"lit\.png: a dark frame, but it shows a picture"):
        make(frames)
    _, reader = make([*frames, ("cap.png", "dark", np.full_like(light, 0.01), {})])
    assert any("lit.png" in warning for warning in reader.warnings)


@pytest.mark.parametrize("role", ["dark", "ambient", "flat"])
def test_one_bad_frame_among_others_is_left_out_and_named(make, light, tmp_path, role):
    """What remains is used: the result is that of the good frame alone."""
    level = {"dark": 0.01, "ambient": 0.1, "flat": 0.6}[role]
    frames = [("a.png", "sample", light, {}), ("b.png", role, np.full_like(light, level), {})]
    extra = '[radiometry]\nvignetting = "flat"' if role == "flat" else ""
    photoset, reader = make(frames, extra)
    expected = value(photoset, reader)
    (tmp_path / "c.png").write_bytes((tmp_path / "b.png").read_bytes()[:200])
    photoset, reader = make([*frames, ("c.png", role, None, {})], extra)
    assert any("left out" in warning and "c.png: truncated" in warning for warning in reader.warnings)
    assert np.array_equal(value(photoset, reader), expected)
