"""First looks that are kept: the same come back, and only for the same photo, read and described alike."""

from dataclasses import replace

import numpy as np
import pytest

from photogonio.cache.corners import KeptLooks
from photogonio.cache.store import Store
from photogonio.calib.detect.photo_reader import Seen
from photogonio.calib.detect.subpixel import Around
from photogonio.calib.geometry.board import Corners
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.photoset import CharucoBoard


@pytest.fixture
def reader(tiny_set):
    return prepare(load_photoset(tiny_set.folder))


@pytest.fixture
def store(tmp_path):
    return Store(tmp_path / "kept")


def hashes(reader):
    return {photo.file: f"hash of {photo.file}" for photo in reader.photoset.photos}


def seen_in(view, *, corners=True, around=True):
    rng = np.random.default_rng(0)
    found = Corners(
        np.arange(4), rng.normal(size=(4, 3)), rng.normal(size=(4, 2)), rng.random(4),
        np.arange(2), rng.normal(size=(2, 4, 2)),
    )  # fmt: skip
    level = rng.random((4, 5, 5)).astype(np.float32)
    level[0, 0] = np.nan
    kept = Around((160, 120), rng.integers(0, 99, (4, 2)), level)
    return Seen(view, found if corners else None, (160, 120), kept if around else None)


@pytest.mark.parametrize("parts", [{}, {"around": False}, {"corners": False, "around": False}])
def test_what_was_found_comes_back(reader, store, parts):
    view = reader.photoset.views("sample")[0]
    seen = seen_in(view, **parts)
    KeptLooks(store, reader, hashes(reader)).put(seen, around=True)
    again = KeptLooks(store, reader, hashes(reader)).get(view, around=True)
    assert (again.view, again.size) == (view, seen.size)
    for one, other in ((seen.corners, again.corners), (seen.around, again.around)):
        assert (one is None) == (other is None)
        for name in () if one is None else one.__slots__:
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
            if name != "size":
                assert getattr(one, name).dtype == getattr(other, name).dtype


def changed(reader, what):
    known, photoset = hashes(reader), reader.photoset
    file = photoset.views("sample")[0].photos[0].file
    if what == "bytes":
        return reader, known | {file: "another"}
    if what == "no hash":
        return reader, {}
    if what == "exposure":
        exposure = replace(reader.exposures[file], exposure_time=0.125)
        return replace(reader, exposures=dict(reader.exposures) | {file: exposure}), known
    if what == "clip":
        return replace(reader, sensor=replace(reader.sensor, clip=0.5)), known
    if what == "gain":
        return replace(reader, gain=np.ones((120, 160, 1), np.float32)), known
    board = CharucoBoard("DICT_4X4_50", (5, 4), 20.0, 15.0)
    return replace(reader, photoset=replace(photoset, board=board)), known


@pytest.mark.parametrize("what", ["bytes", "no hash", "exposure", "clip", "gain", "board"])
def test_only_the_same_photo_read_alike_is_at_hand(reader, store, what):
    view = reader.photoset.views("sample")[0]
    KeptLooks(store, reader, hashes(reader)).put(seen_in(view), around=True)
    assert KeptLooks(store, reader, hashes(reader)).get(view, around=False) is None
    assert KeptLooks(store, *changed(reader, what)).get(view, around=True) is None


def test_noise_that_one_more_photo_changes_does_not_matter_to_a_single_photo(reader, store):
    view = reader.photoset.views("sample")[0]
    KeptLooks(store, reader, hashes(reader)).put(seen_in(view), around=True)
    noise = replace(reader.sensor.noise, read=2 * reader.sensor.noise.read)
    other = replace(reader, sensor=replace(reader.sensor, noise=noise))
    assert KeptLooks(store, other, hashes(reader)).get(view, around=True) is not None


def test_a_damaged_look_counts_as_absent(reader, store):
    view = reader.photoset.views("sample")[0]
    looks = KeptLooks(store, reader, hashes(reader))
    looks.put(seen_in(view), around=True)
    (path,) = store.folder.rglob("*.npz")
    whole = path.read_bytes()
    for damaged in (whole[: len(whole) // 2], b"", b"something else"):
        path.write_bytes(damaged)
        assert looks.get(view, around=True) is None
