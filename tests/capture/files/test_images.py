"""Every listed format decodes to what was written; damaged files are refused, however they are cut."""

from __future__ import annotations

import itertools
import os
import struct

import numpy as np
import pytest
import rawpy

from photogonio.capture.errors import InputError
from photogonio.capture.files.images import HEAD, copies, read_header, read_image

SHAPE = (24, 31)


def codes(channels: int, kind: type) -> np.ndarray:
    return (
        np.random.default_rng(channels).integers(0, np.iinfo(kind).max + 1, (*SHAPE, channels)).astype(kind)
    )


@pytest.mark.parametrize("suffix", [".png", ".tif"])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels", [1, 3])
def test_integers_come_back_exactly(tmp_path, files, suffix, kind, channels):
    written = codes(channels, kind)
    files["png"](tmp_path / f"a{suffix}", written)
    image, header = read_image(tmp_path / f"a{suffix}"), read_header(tmp_path / f"a{suffix}")
    assert image.pixels.dtype == kind and np.array_equal(image.pixels, written)
    assert image.full_scale == np.iinfo(kind).max
    assert header.size == SHAPE[::-1] and header.channels == image.channels
    assert image.channels == (("R", "G", "B") if channels == 3 else image.channels)


@pytest.mark.parametrize("compression", ["none", "lzw", "zip"])
def test_tiff_compressions_and_many_channels(tmp_path, files, compression):
    for channels in (3, 6):  # six go another way than three
        written = codes(channels, np.uint16)
        files["oiio"](tmp_path / "a.tif", written, "uint16", compression=compression)
        assert np.array_equal(read_image(tmp_path / "a.tif").pixels, written)


@pytest.mark.parametrize(("kind", "step"), [("half", 2.0**-11), ("float", 0.0)])
def test_openexr(tmp_path, files, kind, step):
    written = np.random.default_rng(0).uniform(-0.1, 40, (*SHAPE, 3)).astype(np.float32)
    files["oiio"](tmp_path / "a.exr", written, kind)
    image = read_image(tmp_path / "a.exr")
    assert image.pixels.dtype == (np.float16 if kind == "half" else np.float32)
    assert image.full_scale == 1.0 and image.channels == ("R", "G", "B")
    assert np.abs(image.pixels - written).max() <= step * np.abs(written).max()


def test_alpha_is_dropped_and_colour_not_multiplied_by_it(tmp_path, files):
    written = codes(4, np.uint16)
    files["oiio"](tmp_path / "a.png", written, "uint16", oiio__UnassociatedAlpha=1)
    image = read_image(tmp_path / "a.png")
    assert np.array_equal(image.pixels, written[..., :3])


def test_jpeg_is_near_and_not_turned_upright(tmp_path, files):
    ramp = np.linspace(20, 230, 64).astype(np.uint8)
    written = np.repeat(np.broadcast_to(ramp, (48, 64))[..., None], 3, axis=2)
    files["oiio"](tmp_path / "a.jpg", written, "uint8", Compression="jpeg:98", Orientation=6)
    image = read_image(tmp_path / "a.jpg")
    assert image.lossy and image.pixels.shape == (48, 64, 3)
    assert np.abs(image.pixels.astype(int) - written).max() <= 3  # quality 98: some codes


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.tif", "b.tif", "a.exr"])
@pytest.mark.parametrize("share", [0.0, 0.05, 0.5, 0.9, 0.99])
def test_truncated_files_are_refused(tmp_path, files, capfd, name, share):
    path = tmp_path / name
    if name.startswith("b"):  # OpenCV writes the directory at the end of a TIFF, OpenImageIO at its beginning
        files["oiio"](path, codes(3, np.uint16), "uint16")
    elif name.endswith("exr"):
        files["oiio"](path, codes(3, np.uint8).astype(np.float32), "half")
    else:
        files["png"](path, codes(3, np.uint8))
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(InputError) as caught:
        read_image(path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)
    assert capfd.readouterr().err == ""  # the libraries underneath keep quiet


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tif", ".exr", ".dng", ".txt"])
def test_what_is_no_image_is_refused(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"a shopping list, not a photo")
    for read in (read_image, read_header):
        with pytest.raises(InputError, match=r"a\.\w+: "):
            read(path)


def test_a_missing_file_is_refused(tmp_path):
    for suffix in (".png", ".exr", ".dng"):
        with pytest.raises(InputError):
            read_image(tmp_path / f"gone{suffix}")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="a system without pipes")
def test_pipes_and_devices_are_refused_before_they_are_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")
    (tmp_path / "zero.png").symlink_to("/dev/zero")
    for name in ("pipe.png", "zero.png"):
        for read in (read_header, read_image):
            with pytest.raises(InputError, match="no ordinary file"):
                read(tmp_path / name)
    assert copies(tmp_path, ["pipe.png", "zero.png"]) == {}


def test_pixels_that_are_not_finite_are_refused_with_their_place(tmp_path, files):
    pixels = np.ones((*SHAPE, 3), np.float32)
    for value, kind in itertools.product((np.nan, np.inf, -np.inf), ("float", "half")):
        pixels[7, 5, 1] = value
        files["oiio"](tmp_path / "a.exr", pixels, kind)
        with pytest.raises(InputError, match="not finite, first at x 5, y 7"):
            read_image(tmp_path / "a.exr")


def test_other_pixel_types_are_refused(tmp_path):
    tags = [
        (256, 2),
        (257, 2),
        (258, 32),
        (259, 1),
        (262, 1),
        (273, 134),
        (277, 1),
        (278, 2),
        (279, 16),
        (339, 1),
    ]
    entries = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags)
    data = b"II*\0" + struct.pack("<IH", 8, len(tags)) + entries + struct.pack("<I4I", 0, 1, 2, 3, 4)
    (tmp_path / "a.tif").write_bytes(data)  # 2 x 2 pixels of 32 bit integers
    with pytest.raises(InputError, match="pixels of type uint"):
        read_image(tmp_path / "a.tif")


def test_exif_orientation_leaves_the_size_alone(tmp_path, files):
    files["oiio"](tmp_path / "a.jpg", codes(3, np.uint8), "uint8", Orientation=8)
    assert read_header(tmp_path / "a.jpg").size == SHAPE[::-1]


@pytest.fixture(scope="module")
def dng(shared):
    return shared / "data" / "raw" / "colorchart.dng"


def test_raw_superpixels_are_the_mosaic_above_black(dng):
    image = read_image(dng)
    with rawpy.imread(str(dng)) as raw:
        mosaic = raw.raw_image_visible.astype(np.float64)
    black, white = 2056, 15000  # as the file says
    assert image.raw and image.channels == ("R", "G", "B") and image.full_scale == white - black
    assert image.black == black and image.sites == (1, 2, 1)
    planes = [mosaic[0::2, 0::2], (mosaic[0::2, 1::2] + mosaic[1::2, 0::2]) / 2, mosaic[1::2, 1::2]]
    assert np.array_equal(image.pixels, np.stack(planes, axis=-1) - black)  # halves are exact in float32
    assert read_header(dng).size == image.pixels.shape[1::-1]
    assert not image.saturated.any()  # the brightest site reads 12128


@pytest.mark.parametrize("method", ["linear", "ahd"])
def test_raw_demosaic_keeps_what_the_sites_say(dng, method):
    """No curve, no white balance, no brightening: at each site its own colour is the mosaic's, to the
    rounding.
    """
    image = read_image(dng, demosaic=method)
    sites = read_image(dng)
    height, width = sites.pixels.shape[:2]
    for channel, (y, x) in ((0, (0, 0)), (2, (1, 1))):
        found = image.pixels[y : 2 * height : 2, x : 2 * width : 2, channel] / image.full_scale
        expected = np.maximum(sites.pixels[..., channel] / sites.full_scale, 0)
        assert np.abs(found - expected).max() <= 1.01 / 65535
    assert read_header(dng, demosaic=method).size == image.pixels.shape[1::-1]


def test_a_truncated_raw_is_refused(dng, tmp_path):
    whole = dng.read_bytes()
    for share in (0.01, 0.5, 0.9):
        (tmp_path / "a.dng").write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(InputError, match=r"a\.dng"):
            read_image(tmp_path / "a.dng")


def test_copies_are_files_of_the_same_bytes(tmp_path):
    """Of the same size and start, and different only far behind, files are no copies."""
    start = bytes(2 * HEAD)
    for name, rest in {"a": b"1", "b": b"2", "c": b"1", "d": b"12", "e": b"1", "f": b"2"}.items():
        (tmp_path / name).write_bytes(start + rest)
    names = ["a", "missing", "b", "c", "d", "e", "f"]
    assert copies(tmp_path, names) == {"c": "a", "e": "a", "f": "b"}
