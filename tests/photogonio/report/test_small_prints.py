"""Prints are made of what is decoded anyway, look like their photos, and are those of any order of decoding."""

from __future__ import annotations

import numpy as np

from photogonio.cache.kept import KeptSetup
from photogonio.cache.scratch import Scratch
from photogonio.cache.store import Store
from photogonio.capture.files.images import Image
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset
from photogonio.report.viewer import small_prints
from photogonio.report.viewer.small_prints import WIDTH, SmallPrints, small_print


def image(value: np.ndarray, kind=np.uint16) -> Image:
    full = np.iinfo(kind).max
    pixels = np.repeat((value * full).astype(kind)[..., None], 3, axis=2)
    return Image(pixels, float(full), ("R", "G", "B"))


def test_a_print_is_as_wide_as_asked_and_in_tones_for_the_eye():
    ramp = np.tile(np.linspace(0.0, 0.5, 1920), (1280, 1))
    linear, coded = (small_print(image(ramp, kind)).astype(float) for kind in (np.uint16, np.uint8))
    assert linear.shape == coded.shape == (213, WIDTH, 3)
    middle = WIDTH // 2
    # half of the brightest, in square-root tones and as it is; the percentile that is white is 0.99 of it
    assert abs(linear[100, middle, 0] - 255 * np.sqrt(0.5 / 0.99)) < 2
    assert abs(coded[100, middle, 0] - 255 * 0.5 / 0.99) < 2


def test_what_is_clipped_is_tinted():
    value = np.full((480, 640), 0.3)
    value[:240, :320] = 1.0
    red, green, _ = small_print(image(value))[60, 80].astype(int)
    assert red > green + 50
    assert np.ptp(small_print(image(value))[200, 80]) == 0


def test_no_photo_is_decoded_for_its_print_nor_printed_again(tiny_set, tmp_path, monkeypatch):
    photoset = load_photoset(tiny_set.folder)
    small, decoded = SmallPrints(photoset), []

    def show(path, one):
        decoded.append(path)
        small.add(path, one)

    store = Store(tmp_path / "kept")
    with Scratch(decoded=show) as scratch:
        radiance = prepare(photoset, decode=scratch.take)
        kept = KeptSetup.of(photoset, store, 1)
        for view in photoset.views("sample")[:4]:
            radiance.read(view)
        seen = set(decoded)
        first = small.of(radiance, kept, 2)
        assert {path.name for path in set(decoded) - seen} <= {"s4.png", "s5.png"}
        assert list(first) == [view.name for view in photoset.views("sample")]
        decoded.clear()
        recalled = SmallPrints(photoset)
        recalled.recall(kept)
        again = recalled.of(radiance, kept, 1)
    assert not decoded  # they were kept
    monkeypatch.setattr(small_prints, "small_print", lambda image: decoded.append(image))
    for photo in photoset.photos:
        recalled.add(photoset.folder / photo.file, image(np.zeros((4, 4))))
    assert not decoded
    assert all((first[name] == again[name]).all() for name in first)
