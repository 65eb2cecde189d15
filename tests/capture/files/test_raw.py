"""DNG files in the ways that phones, converters and mergers write them."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.capture.files.images import read_header, read_image
from tests.capture.dng_files import EXPOSURE, HEIGHT, RNG, WIDTH, cells, dng, mosaic, rationals


@pytest.mark.parametrize(
    ("exif", "expected"),
    [
        (EXPOSURE, (1 / 121, 2.8, None)),
        ([*EXPOSURE, (0x8827, 3, [65535]), (0x8830, 3, [2]), (0x8832, 4, [102400])], (1 / 121, 2.8, 102400)),
        ([(0x9201, 10, [6, 1]), (0x9202, 5, [5, 1]), (0x8827, 3, [100])], (1 / 64, 2**2.5, 100)),
        ([(0x829A, 5, [1, 1]), (0x829D, 5, [1, 1])], (1, 1, None)),
        ([], (None, None, None)),
    ],
)
def test_exposure_does_not_hang_on_the_sensitivity(tmp_path, exif, expected):
    found = read_header(dng(tmp_path / "a.dng", mosaic(), white=60000, exif=exif)).exposure
    for value, right in zip((found.exposure_time, found.f_number, found.iso), expected, strict=True):
        assert value is None if right is None else value == pytest.approx(right, rel=1e-6)


@pytest.mark.parametrize("demosaic", ["superpixel", "linear", "ahd"])
def test_linear_dng_is_taken_as_it_is(tmp_path, demosaic):
    written = RNG.integers(600, 50000, (HEIGHT, WIDTH, 3)).astype(np.uint16)
    written[3, 4, 1] = 60000
    path = dng(tmp_path / "a.dng", written, white=60000, black=512)
    image, header = read_image(path, demosaic=demosaic), read_header(path, demosaic=demosaic)
    assert header.size == (WIDTH, HEIGHT) and image.channels == header.channels == ("R", "G", "B")
    assert np.array_equal(image.pixels, written.astype(np.float32) - 512)
    assert image.raw and (image.full_scale, image.black) == (60000 - 512, 512)
    assert np.argwhere(image.saturated).tolist() == [[3, 4]]


@pytest.mark.parametrize(
    ("white", "brightest"),
    [
        (1, 0.95),
        (1, 1.0),
        (1, 4.0),
        (10000, 40000.0),
        (10000, 20000.0),
        (65535, 60000.0),
        (65535, 90000.0),
        (3000, 40000.0),
    ],
)
@pytest.mark.parametrize("demosaic", ["superpixel", "linear"])
def test_floats_above_the_white_level(tmp_path, white, brightest, demosaic):
    """LibRaw makes integers of them, of 14 bits where it scales: by the brightest, here at most 40/3 of white."""
    written = mosaic("float32") * white
    written[5, 5] = brightest
    image = read_image(dng(tmp_path / "a.dng", written, white=white), demosaic=demosaic)
    light = image.pixels / image.full_scale
    sites = light if demosaic == "superpixel" else cells_of_three(light)
    expected = cells(np.minimum(written[..., 0] / white, sites.max()))
    assert np.abs(np.delete(sites - expected, 2, axis=0)).max() <= 40 / 3 * (1.01 / 16383 + 1 / 65535)
    at = (2, 2) if demosaic == "superpixel" else (5, 5)
    assert image.saturated[at] == (brightest >= white) and image.saturated.sum() == image.saturated[at]


LINES = np.tile([0.0, 0.0, 3.0, 7.25], 16)
ROWS, COLUMNS = LINES[:HEIGHT, None], LINES[None, :WIDTH]
FOURS = 200.0 + np.arange(16.0).reshape(4, 4)
HALVES = np.array([[200.9, 201.5], [202.25, 203.75]])
BLACKS = {  # the entries that state it, and the level at each pixel
    "fractions": (
        [(50713, 3, [2, 2]), (50714, 5, rationals(HALVES.ravel()))],
        np.tile(HALVES, (HEIGHT // 2, WIDTH // 2)),
    ),
    "repeat": ([(50713, 3, [4, 4]), (50714, 3, [*range(200, 216)])], np.tile(FOURS, (HEIGHT // 4, WIDTH // 4))),
    "rows": ([(50714, 4, [200]), (50716, 10, rationals(ROWS.ravel()))], 200 + ROWS),
    "columns alone": ([(50715, 10, rationals(COLUMNS.ravel()))], COLUMNS),
    "whole": ([(50713, 3, [2, 2]), (50714, 3, [200, 201, 202, 203])],
              np.tile([[200.0, 201.0], [202.0, 203.0]], (HEIGHT // 2, WIDTH // 2))),
}  # fmt: skip


@pytest.mark.parametrize("stated", BLACKS)
@pytest.mark.parametrize("demosaic", ["superpixel", "linear"])
def test_black_is_what_the_file_states(tmp_path, stated, demosaic):
    """At every pixel. LibRaw rounds its 16 bits down, here and there twice, and scales by a whole mean of black."""
    entries, level = BLACKS[stated]
    light = RNG.integers(0, 40000, (HEIGHT, WIDTH)).astype(float)
    written = np.round(light + level)
    image = read_image(
        dng(tmp_path / "a.dng", written[..., None].astype(np.uint16), white=50000, black=entries),
        demosaic=demosaic,
    )
    expected = cells(np.broadcast_to(written - level, light.shape))
    mean = float(np.broadcast_to(level, light.shape).mean())
    assert image.black / image.full_scale == pytest.approx(mean / (50000 - mean), rel=1e-6)
    if demosaic == "superpixel":
        assert np.allclose(image.pixels, expected, atol=0.01)
        assert image.full_scale == pytest.approx(50000 - mean)
    else:  # below black is cut to 0 there
        found = cells_of_three(image.pixels) / image.full_scale
        assert np.abs(found - np.maximum(expected, 0) / (50000 - mean)).max() <= (2 + 65535 / 50000) / 65535


def test_black_of_linear_pixels_has_fractions(tmp_path):
    written = RNG.integers(600, 40000, (HEIGHT, WIDTH, 3)).astype(np.uint16)
    levels = [512.5, 513.25, 514.75]
    image = read_image(dng(tmp_path / "a.dng", written, white=50000, black=[(50714, 5, rationals(levels))]))
    assert np.allclose(image.pixels, written - np.array(levels), atol=0.01)


def cells_of_three(pixels: np.ndarray) -> np.ndarray:
    """What a demosaic leaves at the sites themselves."""
    green = (pixels[::2, 1::2, 1] + pixels[1::2, ::2, 1]) / 2
    return np.stack([pixels[::2, ::2, 0], green, pixels[1::2, 1::2, 2]], axis=-1)


def test_a_dng_by_another_name_is_a_dng(tmp_path):
    written = mosaic()
    path = dng(tmp_path / "a.tif", written, white=60000)
    assert np.array_equal(read_image(path).pixels, cells(written[..., 0].astype(np.float32)))


@pytest.mark.parametrize("size", [(4, 4), (2, 4), (3, 3), (8, 2)])
def test_a_mosaic_that_repeats_otherwise_is_refused(tmp_path, size):
    """LibRaw takes it for one of 2 x 2, and mixes its colours."""
    path = dng(tmp_path / "a.dng", mosaic(), white=60000)
    data = path.read_bytes()
    place = data.index(struct.pack("<HHIHH", 33421, 3, 2, 2, 2))
    path.write_bytes(data[:place] + struct.pack("<HHIHH", 33421, 3, 2, *size) + data[place + 12 :])
    with pytest.raises(InputError, match=rf"a\.dng: .*mosaic that repeats by {size[0]} x {size[1]}"):
        read_image(path)


@pytest.mark.parametrize("black", [60000, 61000])
@pytest.mark.parametrize("channels", [1, 3])
def test_black_at_or_above_white_is_refused(tmp_path, black, channels):
    written = RNG.integers(1000, 50000, (HEIGHT, WIDTH, channels)).astype(np.uint16)
    with pytest.raises(InputError, match=rf"a\.dng: .*black level of {black}, .*white"):
        read_image(dng(tmp_path / "a.dng", written, white=60000, black=black))
