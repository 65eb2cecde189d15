"""The code at which a sensor is full: by the padding, and by the pile of pixels in it."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.linear.clipping import clip_code


def photos_of_clipped(clip: int, shift: int, count: int = 3) -> list[np.ndarray]:
    """Photos of which a part is clipped at a code and shifted up."""
    light = np.linspace(0.1, 1.3, 200)[None, :, None] * np.ones((60, 1, 3))
    photos = []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        codes = light * clip + rng.normal(0, 0.004 * clip, light.shape)
        photos.append((np.clip(np.round(codes), 0, clip).astype(np.uint16)) << shift)
    return photos


def test_padding_shows_where_full_scale_is():
    assert clip_code(photos_of_clipped(16383, 2), 65535.0) == 65532
    dark = [(photo // 16) << 2 for photo in photos_of_clipped(16383, 0)]  # nothing is clipped in these
    assert clip_code(dark, 65535.0) == 65532


def test_a_pile_shows_where_the_sensor_is_full():
    assert clip_code(photos_of_clipped(58000, 0), 65535.0) == 58000
    assert clip_code(photos_of_clipped(58000, 0, count=1), 65535.0) == 65535  # one photo is no proof
    floats = [photo.astype(np.float32) / 65535 for photo in photos_of_clipped(58000, 0)]
    assert clip_code(floats, 1.0) == pytest.approx(58000 / 65535)


def test_without_a_pile_full_scale_stands():
    below = [np.minimum(photo, 40000 + k) for k, photo in enumerate(photos_of_clipped(58000, 0))]
    assert clip_code(below, 65535.0) == 65535
    smooth = [np.linspace(0, 0.9, 3000, dtype=np.float32).reshape(50, 60, 1)] * 2
    assert clip_code(smooth, 1.0) == np.inf


def test_jpeg_leaves_room_for_ringing():
    photo = np.full((20, 20, 3), 255, np.uint8)
    photo[5] = 97
    assert clip_code([photo, photo], 255.0, lossy=True) == 252
