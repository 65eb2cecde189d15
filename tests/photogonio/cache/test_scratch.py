"""Photos kept decoded: as a decoder gives them, within the room there is, from any number of threads."""

import mmap
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
import pytest

from photogonio.cache import scratch as scratches
from photogonio.cache.scratch import Scratch
from photogonio.capture.errors import InputError
from photogonio.capture.files import images

SIZE = (40, 30)
PHOTO_BYTES = -(-40 * 30 * 3 * 2 // mmap.ALLOCATIONGRANULARITY) * mmap.ALLOCATIONGRANULARITY  # in whole pages


@pytest.fixture
def photos(tmp_path):
    paths = [tmp_path / f"{k}.png" for k in range(4)]
    for k, path in enumerate(paths):
        rng = np.random.default_rng(k)
        cv2.imwrite(str(path), rng.integers(0, 65535, (SIZE[1], SIZE[0], 3), dtype=np.uint16))
    return paths


@pytest.fixture
def decoded(monkeypatch):
    """Files in the order in which they were decoded."""
    names = []

    def decode(path, **how):
        names.append(path.name)
        return images.read_image(path, **how)

    monkeypatch.setattr(scratches, "read_image", decode)
    return names


def test_a_kept_photo_is_read_back_and_not_decoded_again(photos, decoded):
    with Scratch(1 << 20) as scratch:
        first = [scratch.keep(path) for path in photos]
        again = [scratch.take(path) for path in reversed(photos)][::-1]
        assert decoded == [path.name for path in photos]
        scratch.keep(photos[0])
        assert len(decoded) == 4
    for a, b in zip(first, again, strict=True):
        np.testing.assert_array_equal(a.pixels, b.pixels)
        assert (a.pixels.dtype, a.channels, a.full_scale) == (b.pixels.dtype, b.channels, b.full_scale)


def test_what_a_raw_decoder_knows_of_saturation_is_kept_too(photos, monkeypatch):
    full = np.zeros((SIZE[1], SIZE[0]), bool)
    full[3, 4] = True
    image = images.Image(
        np.ones((SIZE[1], SIZE[0], 4), np.float32), 1.0, ("R", "G", "B", "E"), True, 0.1, full
    )
    monkeypatch.setattr(scratches, "read_image", lambda path, **how: image)
    with Scratch(1 << 20) as scratch:
        scratch.keep(photos[0])
        monkeypatch.undo()
        again = scratch.take(photos[0])
    np.testing.assert_array_equal(again.saturated, full)
    np.testing.assert_array_equal(again.pixels, image.pixels)
    assert (again.raw, again.black) == (True, 0.1)


def test_no_more_is_kept_than_there_is_room_for(photos, decoded):
    with Scratch(2 * PHOTO_BYTES + 100) as scratch:
        for path in photos:
            scratch.keep(path)
        for path in photos:
            scratch.take(path)
    assert decoded[4:] == ["2.png", "3.png"]


def test_photos_that_are_only_taken_are_not_kept_but_for_the_latest(photos, decoded):
    with Scratch(1 << 20) as scratch:
        for k in (0, 0, 1, 1, 0):
            scratch.take(photos[k])
    assert decoded == ["0.png", "1.png", "0.png"]


def test_several_threads_get_their_own_photos(photos):
    with Scratch(1 << 20) as scratch, ThreadPoolExecutor(4) as pool:
        for turn in (scratch.keep, scratch.take, scratch.take):
            for path, image in zip(photos * 5, pool.map(turn, photos * 5), strict=True):
                np.testing.assert_array_equal(image.pixels, images.read_image(path).pixels)


def test_a_photo_that_cannot_be_read_says_so(tmp_path):
    (tmp_path / "x.png").write_bytes(b"no photo")
    with Scratch(1 << 20) as scratch, pytest.raises(InputError, match=r"x\.png"):
        scratch.keep(tmp_path / "x.png")


def test_nothing_is_left_on_the_disk(photos, tmp_path, monkeypatch):
    monkeypatch.setattr(scratches.tempfile, "tempdir", str(tmp_path / "here"))
    (tmp_path / "here").mkdir()
    with Scratch(1 << 20) as scratch:
        scratch.keep(photos[0])
        assert list((tmp_path / "here").iterdir()) == []  # nor while it runs: kill -9 leaves nothing


def test_what_is_put_aside_comes_back_as_a_copy_however_little_room_photos_have(photos):
    value = {"name": "s0", "level": np.arange(60_000.0)}
    with Scratch(PHOTO_BYTES) as scratch:
        scratch.keep(photos[0])  # all there is for photos
        recall = scratch.put(value)
        scratch.keep(photos[1])
        first = recall()
        first["level"][:] = 0.0
        np.testing.assert_array_equal(recall()["level"], value["level"])
        assert recall()["level"] is not value["level"]
        np.testing.assert_array_equal(scratch.take(photos[0]).pixels, images.read_image(photos[0]).pixels)


def test_what_cannot_be_written_stays_in_memory(monkeypatch):
    value = {"level": np.arange(5.0)}

    def full(*_):
        raise OSError("no space left on device")

    with Scratch(1 << 20) as scratch:
        monkeypatch.setattr(scratches.os, "pwrite", full)
        assert scratch.put(value)() is value
    assert Scratch(0).put(value)() is value
