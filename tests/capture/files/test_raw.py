"""DNG files in the ways that phones, converters and mergers write them."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.files.images import read_header, read_image
from tests.capture.dng_files import EXPOSURE, HEIGHT, RNG, WIDTH, cells, dng, mosaic


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


def cells_of_three(pixels: np.ndarray) -> np.ndarray:
    """What a demosaic leaves at the sites themselves."""
    green = (pixels[::2, 1::2, 1] + pixels[1::2, ::2, 1]) / 2
    return np.stack([pixels[::2, ::2, 0], green, pixels[1::2, 1::2, 2]], axis=-1)


def test_a_dng_by_another_name_is_a_dng(tmp_path):
    written = mosaic()
    path = dng(tmp_path / "a.tif", written, white=60000)
    assert np.array_equal(read_image(path).pixels, cells(written[..., 0].astype(np.float32)))
