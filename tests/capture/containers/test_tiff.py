"""Every way to store a photo in a TIFF gives its pixels, or one clear line."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from PIL import Image

from photogonio.capture.errors import InputError
from photogonio.capture.files.images import read_header, read_image
from tests.capture.odd_files import tiff, tiff_page

RNG = np.random.default_rng(0)
SHAPE = (11, 14)


def codes(channels: int, kind: str) -> np.ndarray:
    if kind == "float32":
        return RNG.uniform(0, 3, (*SHAPE, channels)).astype(np.float32)
    return RNG.integers(0, np.iinfo(kind).max + 1, (*SHAPE, channels)).astype(kind)


def same(path, expected: np.ndarray) -> bool:
    image, header = read_image(path), read_header(path)
    assert header.size == image.pixels.shape[1::-1] and header.channels == image.channels
    assert image.pixels.dtype == expected.dtype and len(image.channels) == image.pixels.shape[2]
    return np.array_equal(image.pixels, expected)


@pytest.mark.parametrize("kind", ["uint8", "uint16", "float32"])
@pytest.mark.parametrize("channels", [1, 3, 5])
@pytest.mark.parametrize("planar", [False, True])
def test_planes_one_after_another_are_as_good_as_pixels(tmp_path, kind, channels, planar):
    written = codes(channels, kind)
    extra = [(338, 3, [0] * (channels - 3))] if channels > 3 else []
    photometric = 1 if channels == 1 else 2
    path = tiff(tmp_path / "a.tif", written, photometric=photometric, planar=planar, entries=extra)
    assert same(path, written)


@pytest.mark.parametrize("kind", ["uint8", "uint16"])
def test_min_is_white_is_turned_to_light(tmp_path, kind):
    written = codes(1, kind)
    path = tiff(tmp_path / "a.tif", written, photometric=0)
    assert same(path, np.iinfo(kind).max - written)


def test_min_is_white_floats_are_refused(tmp_path):
    path = tiff(tmp_path / "a.tif", codes(1, "float32"), photometric=0)
    with pytest.raises(InputError, match="least is white"):
        read_image(path)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("kind", ["uint8", "uint16"])
@pytest.mark.parametrize("channels", [1, 3])
def test_orientations_leave_the_pixels_as_they_are_stored(tmp_path, orientation, kind, channels):
    written = codes(channels, kind)
    photometric = 1 if channels == 1 else 2
    path = tiff(tmp_path / "a.tif", written, photometric=photometric, entries=[(274, 3, [orientation])])
    assert same(path, written)
    assert len(read_header(path).doubts) == (orientation in (2, 4, 5, 7))


@pytest.mark.parametrize(
    ("channels", "extra", "kept"),
    [
        (4, [0], 4),  # unspecified: another channel
        (4, [1], 3),  # alpha, premultiplied
        (4, [2], 3),  # alpha
        (5, [0, 0], 5),
        (5, [2, 0], 5),  # nobody puts a mask between channels
        (5, [1, 0], 5),
        (8, [2, 0, 0, 0, 0], 8),
    ],
)
@pytest.mark.parametrize("kind", ["uint8", "uint16", "float32"])
def test_samples_beyond_three(tmp_path, channels, extra, kept, kind):
    """Colour is never multiplied by, nor divided by, alpha."""
    written = codes(channels, kind)
    path = tiff(tmp_path / "a.tif", written, entries=[(338, 3, extra)])
    assert same(path, written[..., :kept])


@pytest.mark.parametrize(("extra", "kept"), [(0, 2), (2, 1)])
def test_gray_with_a_second_sample(tmp_path, extra, kept):
    written = codes(2, "uint16")
    path = tiff(tmp_path / "a.tif", written, photometric=1, entries=[(338, 3, [extra])])
    assert same(path, written[..., :kept])


@pytest.mark.parametrize("kind", ["uint8", "uint16"])
def test_a_thumbnail_as_first_page_is_not_the_photo(tmp_path, kind):
    written = codes(3, kind)
    small = np.ascontiguousarray(written[:4, :5])
    for name, subfiles in (("marked", (1, 0)), ("unmarked", (0, 0))):
        assert same(tiff(tmp_path / f"{name}.tif", small, after=[written], subfiles=subfiles), written)
    mask = np.full_like(written, 255)
    assert same(tiff(tmp_path / "mask.tif", written, after=[mask], subfiles=(0, 4)), written)


@pytest.mark.parametrize("subfile", [0, 1])
def test_a_picture_below_a_thumbnail_is_refused_and_a_smaller_one_is_nothing(tmp_path, subfile):
    """As TIFF/EP has them, and pyramids."""
    large, small = codes(3, "uint16"), np.ascontiguousarray(codes(3, "uint16")[:4, :5])
    for name, first, second in (("ep", small, large), ("pyramid", large, small)):
        path = tiff(tmp_path / f"{name}.tif", first, subfiles=(subfile,), entries=[(330, 4, [0])])
        data = path.read_bytes() + bytes(len(path.read_bytes()) % 2)
        entry = struct.pack("<HHI", 330, 4, 1)
        data = data.replace(entry + bytes(4), entry + struct.pack("<I", len(data)))
        page = tiff_page(second, len(data), photometric=2, planar=False, entries=(), subfile=0)
        path.write_bytes(data + page)
    assert same(path, large)
    for read in (read_header, read_image):
        with pytest.raises(InputError, match="below a smaller one"):
            read(tmp_path / "ep.tif")


def test_several_pictures_of_one_size_are_refused(tmp_path):
    path = tiff(tmp_path / "a.tif", codes(3, "uint8"), after=[codes(3, "uint8")])
    for read in (read_header, read_image):
        with pytest.raises(InputError, match="2 pictures of one size"):
            read(path)


@pytest.mark.parametrize(
    ("photometric", "channels", "word"),
    [(5, 4, "CMYK"), (8, 3, "CIE Lab"), (32803, 1, "mosaic"), (9999, 1, "9999")],
)
def test_other_colours_are_refused_by_name(tmp_path, photometric, channels, word):
    path = tiff(tmp_path / "a.tif", codes(channels, "uint16"), photometric=photometric)
    with pytest.raises(InputError, match=rf"a\.tif: .*{word}"):
        read_image(path)


def test_palettes_and_jpeg_inside_are_rgb(tmp_path):
    smooth = np.broadcast_to(np.linspace(10, 240, 64).astype(np.uint8)[None, :, None], (48, 64, 3))
    picture = Image.fromarray(np.ascontiguousarray(smooth))
    few = picture.convert("P")
    few.save(tmp_path / "palette.tif")
    # Pillow writes 255 as 255 * 256, of which 254.005 / 255 of full scale is left
    off = read_image(tmp_path / "palette.tif").pixels.astype(int) - np.asarray(few.convert("RGB"))
    assert np.abs(off).max() <= 1
    picture.save(tmp_path / "jpeg.tif", compression="jpeg", quality=98)
    pixels = read_image(tmp_path / "jpeg.tif").pixels
    assert pixels.shape == smooth.shape and np.abs(pixels.astype(int) - smooth).max() <= 4  # some codes


def test_bigtiff(tmp_path, files):
    written = codes(3, "uint16")
    Image.fromarray(np.ascontiguousarray(written[..., 0])).save(tmp_path / "a.tif", big_tiff=True)
    assert same(tmp_path / "a.tif", written[..., :1])


def test_every_truncation_is_refused_or_whole(tmp_path):
    written = codes(3, "uint16")
    whole = tiff(tmp_path / "a.tif", written, planar=True).read_bytes()
    for length in range(0, len(whole), 41):
        (tmp_path / "b.tif").write_bytes(whole[:length])
        with pytest.raises(InputError):
            read_image(tmp_path / "b.tif")


@pytest.mark.parametrize("kind", ["uint8", "uint16", "float32"])
def test_a_fourth_sample_that_nobody_names_is_light_unless_it_is_opaque(tmp_path, kind):
    written = codes(4, kind)
    assert same(tiff(tmp_path / "a.tif", written), written)
    written[..., 3] = 1 if kind == "float32" else np.iinfo(kind).max
    assert same(tiff(tmp_path / "b.tif", written), written[..., :3])


def test_gray_of_three_samples(tmp_path):
    written = codes(3, "uint16")
    assert same(tiff(tmp_path / "a.tif", written, photometric=1, entries=[(338, 3, [0, 0])]), written)


def test_a_palette_with_more_samples_is_refused(tmp_path):
    colours = [(320, 3, [k % 65536 for k in range(0, 768 * 85, 85)])]
    path = tiff(tmp_path / "a.tif", codes(2, "uint8"), photometric=3, entries=colours)
    with pytest.raises(InputError, match=r"a\.tif: holds a palette of 2 samples"):
        read_header(path)
