"""Linear signal of files: curves and levels undone, and noise as it is stated."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.linear.encoding import linear_to_gamma, linear_to_srgb
from tests.capture.small_sets import SHAPE, STEP16, value


@pytest.mark.parametrize(
    ("encoding", "encode"),
    [
        ('encoding = "srgb"', linear_to_srgb),
        ('encoding = "gamma"\ngamma = 1.8', lambda x: linear_to_gamma(x, 1.8)),
        ('encoding = "gamma"\ngamma = 2.4', lambda x: linear_to_gamma(x, 2.4)),
    ],
)
@pytest.mark.parametrize("name", ["a.png", "a.exr"])
def test_encodings_are_undone(make, light, encoding, encode, name):
    photoset, reader = make([(name, "sample", encode(light), {})], f"[radiometry]\n{encoding}")
    # the steepest slope of these curves, at the top, is their exponent
    assert np.abs(value(photoset, reader) - light).max() < 3 * STEP16


@pytest.mark.parametrize("encoding", ["linear", "srgb"])
def test_half_floats_read_as_the_same_numbers_in_full(make, light, encoding):
    """Whole, in parts, at single pixels, as gray levels; with an ambient photo, and a pile of full pixels."""
    held = np.float16(np.minimum(1.3 * light, 0.6) * np.linspace(0.9, 1.1, SHAPE[1])[:, None])
    held[10:20, 60:] = 1.0
    photos = [
        ("a.exr", "sample", held, {}),
        ("b.exr", "sample", held, {}),
        ("c.exr", "ambient", held / 16, {}),
    ]
    places = np.array([[10, 12], [40, 30], [61, 20]])
    found = []
    for kind in ("half", "float"):
        photoset, reader = make(photos, f'[radiometry]\nencoding = "{encoding}"', kind=kind)
        (view, _), (x0, y0, x1, y1) = photoset.views("sample"), (13, 8, 70, 50)
        whole, part = reader.read(view), reader.read(view, (x0, y0, x1, y1))
        assert whole.saturated[10:20, 60:].all() and not whole.saturated[:9].any()
        np.testing.assert_array_equal(part.value, whole.value[y0:y1, x0:x1])
        level = (*reader.read_level(view), *reader.read_level(view, (x0, y0, x1, y1)))
        found.append((whole.value, whole.variance, whole.valid, *level, *reader.read_at(view, places)))
    for half, full in zip(*found, strict=True):
        np.testing.assert_array_equal(half, full)


def test_levels(make, light):
    photoset, reader = make(
        [("a.png", "sample", 0.1 + 0.7 * light, {})], "[radiometry]\nblack_level = 0.1\nwhite_level = 0.8"
    )
    assert np.abs(value(photoset, reader) - light).max() < 2 * STEP16


@pytest.mark.parametrize("encoding", ["linear", "srgb"])
def test_the_stated_variance_is_the_scatter(make, light, sensor, encoding):
    """Photon and read noise of the manifest's electrons, exposure divided out: 95 % lie within 1.96 errors."""
    extra = f'[radiometry]\nencoding = "{encoding}"\ngain_electrons = 5000\nread_noise_electrons = 8'
    noisy = sensor(light, electrons=5000, read=8)
    codes = linear_to_srgb(noisy) if encoding == "srgb" else noisy
    photoset, reader = make(
        [("a.png", "sample", codes, {"exposure_time": 0.25})],
        extra,
        full=255 if encoding == "srgb" else 65535,
    )
    found = reader.read(photoset.views("sample")[0])
    normal = (found.value - light / 0.25) / np.sqrt(found.variance)
    # 14400 values: 0.6 % of scatter of the deviation, 0.2 % of the share
    assert normal.std() == pytest.approx(1.0, abs=0.03)
    assert np.mean(np.abs(normal) < 1.96) == pytest.approx(0.95, abs=0.01)
