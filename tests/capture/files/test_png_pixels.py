"""Pixels that were written by hand, with each filter of the specification, come back bit by bit."""

import zlib

import cv2
import numpy as np
import pytest

from photogonio.capture.files import png_pixels
from photogonio.capture.files.images import read_image
from tests.drawn.png_files import chunk, written


def noise(channels: int, kind: type, size: tuple[int, int] = (23, 31)) -> np.ndarray:
    """Steps and full range: every sum of a filter passes 255 somewhere."""
    rng = np.random.default_rng(channels)
    return rng.integers(0, np.iinfo(kind).max, (*size, channels), kind, endpoint=True)


@pytest.mark.parametrize("filters", [[0], [1], [2], [3], [4], [4, 1, 3, 0, 2, 2, 4, 3]], ids=str)
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_every_filter_comes_back(kind, channels, filters):
    pixels = noise(channels, kind)
    found = png_pixels.decoded(written(pixels, filters))
    assert found.dtype == kind
    np.testing.assert_array_equal(found, pixels)


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_as_opencv_writes_and_reads(kind, channels):
    pixels = np.sort(noise(channels, kind, (60, 70)), axis=0)  # smooth, for its filters
    data = cv2.imencode(".png", pixels[..., ::-1])[1].tobytes()
    np.testing.assert_array_equal(png_pixels.decoded(data), pixels)


def test_a_mask_is_left_out(tmp_path):
    pixels = noise(4, np.uint8)
    (tmp_path / "masked.png").write_bytes(written(pixels, [4]))
    np.testing.assert_array_equal(read_image(tmp_path / "masked.png").pixels, pixels[..., :3])


def test_rarer_kinds_are_left_to_others():
    pixels = noise(3, np.uint8)
    assert png_pixels.decoded(written(pixels, [0], chunk(b"tRNS", b"\0" * 6))) is None
    assert png_pixels.decoded(written(pixels, [0], interlaced=1)) is None
    bits = cv2.imencode(".png", noise(1, np.uint8), [cv2.IMWRITE_PNG_BILEVEL, 1])[1].tobytes()
    assert png_pixels.decoded(bits) is None


@pytest.mark.parametrize("harm", ["cut", "filter", "no pixels", "no head"])
def test_of_damaged_files_nothing_is_said(harm):
    data = written(noise(3, np.uint8, (5, 6)), [1])
    place = data.index(b"IDAT")
    if harm == "filter":
        rows = bytearray(zlib.decompress(data[place + 4 : data.index(b"IEND") - 8]))
        rows[0] = 5
        data = data[: place - 4] + chunk(b"IDAT", zlib.compress(bytes(rows))) + chunk(b"IEND", b"")
    elif harm == "cut":
        data = data[: place + 60]
    elif harm == "no pixels":
        data = data[: place - 4] + chunk(b"IEND", b"")
    else:
        data = data[:8]
    assert png_pixels.decoded(data) is None
