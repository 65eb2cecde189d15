"""The floats of a DNG come out as they were written, however it is compressed: LibRaw makes integers of them."""

from __future__ import annotations

import numpy as np
import pytest

from photogonio.capture.containers import float_tiles, tiff
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import read_image
from tests.capture.dng_files import HEIGHT, RNG, WIDTH, cells, dng, mosaic, rationals


def directory(path, number):
    with path.open("rb") as file:
        return list(tiff.with_children(file))[number]


@pytest.mark.parametrize("kind", ["float16", "float32"])
@pytest.mark.parametrize("predictor", [None, 1, 3, 34894, 34895])
def test_floats_below_a_thumbnail_and_compressed(tmp_path, kind, predictor):
    """As converters write merged exposures; above the white level a pixel is full, below 0 it stays."""
    written = mosaic(kind)
    written[5, 5] = 4.0
    written[7, 7] = -0.01
    path = dng(tmp_path / "a.dng", written, white=1, nested=True, predictor=predictor)
    assert np.array_equal(float_tiles.picture(path, directory(path, 1)), written.astype(np.float32))
    image = read_image(path)
    assert image.full_scale == 1.0
    assert np.allclose(image.pixels, cells(written[..., 0].astype(float)), rtol=1e-6)
    assert np.argwhere(image.saturated).tolist() == [[2, 2]]


@pytest.mark.parametrize("kind", ["float16", "float32"])
def test_a_white_level_that_is_not_stated_is_one(tmp_path, kind):
    written = mosaic(kind)
    image = read_image(dng(tmp_path / "a.dng", written, white=None))
    assert np.allclose(image.pixels / image.full_scale, cells(written[..., 0].astype(float)), rtol=1e-6)


@pytest.mark.parametrize("demosaic", ["superpixel", "linear"])
def test_black_of_floats_is_taken_off(tmp_path, demosaic):
    """In fractions of full scale; LibRaw takes none off."""
    written = RNG.uniform(0.2, 0.9, (HEIGHT, WIDTH, 1)).astype("float32")
    path = dng(tmp_path / "a.dng", written, white=1, black=[(50714, 5, rationals([0.125]))])
    image = read_image(path, demosaic=demosaic)
    light = (written[..., 0].astype(float) - 0.125) / 0.875
    if demosaic == "superpixel":
        assert np.allclose(image.pixels / image.full_scale, cells(light), atol=1e-6)
    else:  # LibRaw's 16 bits
        red = image.pixels[::2, ::2, 0] / image.full_scale
        assert np.abs(red - light[::2, ::2]).max() <= 2 / 65535


@pytest.mark.parametrize("kind", ["float16", "float32"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_floats_that_are_not_finite_are_refused(tmp_path, kind, value):
    written = mosaic(kind)
    written[5, 9] = value
    with pytest.raises(InputError, match=r"a\.dng: a pixel is not finite, first at x 9, y 5"):
        read_image(dng(tmp_path / "a.dng", written, white=1))


def test_floats_stored_in_an_unknown_way_are_refused(tmp_path, monkeypatch):
    path = dng(tmp_path / "a.dng", mosaic("float32"), white=1)
    monkeypatch.setattr(float_tiles, "TYPES", {})
    with pytest.raises(InputError, match=r"a\.dng: .*floats .*not read"):
        read_image(path)


def test_floats_of_24_bits():
    """A sign, 7 bits of exponent with a bias of 63, 16 of mantissa."""
    codes = {
        0x3F0000: 1.0,
        0x3F8000: 1.5,
        0xBE0000: -0.5,
        0x000000: 0.0,
        0x000001: 2.0**-78,
        0x400001: 2 + 2.0**-15,
    }
    data = b"".join(code.to_bytes(3, "little") for code in codes)
    assert float_tiles.floats_of(data, "f3", "<").tolist() == list(codes.values())
    assert np.isinf(float_tiles.floats_of(b"\x7f\0\0", "f3", ">")).all()
    assert np.isnan(float_tiles.floats_of(b"\x7f\0\1", "f3", ">")).all()


def test_tiles_and_planes(tmp_path):
    """Tiles reach beyond the picture's edge."""
    written = RNG.uniform(0, 1, (5, 7, 2)).astype("<f4")
    padded = np.pad(written, ((0, 3), (0, 1), (0, 0)), mode="edge")
    parts = [padded[y : y + 4, x : x + 4, c].tobytes() for c in range(2) for y in (0, 4) for x in (0, 4)]
    path = tmp_path / "a"
    path.write_bytes(b"II*\0" + b"".join(parts))
    tags = {
        tiff.WIDTH: (7,), tiff.HEIGHT: (5,), tiff.BITS: (32, 32), tiff.SAMPLES: (2,), tiff.PLANAR: (2,),
        tiff.TILE_WIDTH: (4,), tiff.TILE_PLACES: tuple(4 + 64 * k for k in range(8)), tiff.TILE_SIZES: (64,) * 8,
    }  # fmt: skip
    assert np.array_equal(float_tiles.picture(path, tags), written)
