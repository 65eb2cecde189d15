"""Every way to store a photo in a TIFF gives its pixels, or one clear line."""

from __future__ import annotations

import struct

import cv2
import numpy as np
import pytest
from PIL import Image

from photogonio.capture.containers.tiff import STRIP_SIZES, directories
from photogonio.capture.containers.tone import LINEAR
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


OPAQUE = {"uint8": 255, "uint16": 65535, "float32": 1.0}


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
    """Colour is never multiplied by, nor divided by, alpha; by one that is seen through it must not have been."""
    written = codes(channels, kind)
    if extra == [1]:
        written[..., 3] = np.where(written[..., 0] > 0.5 * written.max(), OPAQUE[kind], 0)
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


@pytest.mark.parametrize(("kind", "steps"), [("uint8", 256), ("uint16", 65536)])
@pytest.mark.parametrize("channels", [1, 3])
def test_a_table_of_light_is_the_curve(tmp_path, kind, steps, channels):
    """TIFF 6.0, section 20: TransferFunction gives the light of each code, for all channels or one by one."""
    exponents = (1.8, 2.2, 1.0)[:channels]
    light = [np.round(65535 * np.linspace(0.0, 1.0, steps) ** g).astype(int) for g in exponents]
    written = codes(3, kind)
    path = tiff(tmp_path / "a.tif", written, entries=[(301, 3, np.concatenate(light).tolist())])
    image = read_image(path)
    assert image.tone.told and image.tone.source == "TransferFunction"
    assert len(image.tone.curves) == channels and np.array_equal(image.pixels, written)
    for curve, g in zip(image.tone.curves, exponents, strict=True):
        code = np.linspace(0.0, 1.0, 11)
        np.testing.assert_allclose(curve.light(code), code**g, atol=1e-3)
    if channels == 3:
        assert image.tone.curves[2] == LINEAR


def test_a_table_of_light_for_other_codes_is_told(tmp_path):
    path = tiff(tmp_path / "a.tif", codes(3, "uint16"), entries=[(301, 3, list(range(256)))])
    assert "TransferFunction" in read_header(path).doubts[0] and not read_header(path).tone.told


@pytest.mark.parametrize("kind", ["uint8", "uint16"])
@pytest.mark.parametrize("compression", [5, 8])
def test_a_damaged_strip_is_refused(tmp_path, kind, compression):
    """OpenCV fills what is missing of 8 bits with black, and says nothing."""
    path = tmp_path / "a.tif"
    flags = [cv2.IMWRITE_TIFF_COMPRESSION, compression, cv2.IMWRITE_TIFF_ROWSPERSTRIP, 16]
    assert cv2.imwrite(str(path), RNG.integers(0, np.iinfo(kind).max, (64, 48, 3)).astype(kind), flags)
    assert read_image(path).pixels.shape == (64, 48, 3)
    whole = path.read_bytes()
    with path.open("rb") as file:
        sizes = next(iter(directories(file)))[STRIP_SIZES]
    form = next(f for f in (f"<{len(sizes)}I", f"<{len(sizes)}H") if struct.pack(f, *sizes) in whole)
    cut = (*sizes[:1], sizes[1] // 2, *sizes[2:])
    path.write_bytes(whole.replace(struct.pack(form, *sizes), struct.pack(form, *cut)))
    with pytest.raises(InputError, match="truncated or damaged"):
        read_image(path)


def test_plain_strips_that_are_too_short_are_refused(tmp_path):
    """libtiff reads on in what stands behind them."""
    path = tiff(tmp_path / "a.tif", codes(3, "uint16"))
    whole, length = path.read_bytes(), SHAPE[0] * SHAPE[1] * 6
    entry = struct.pack("<HHII", 279, 4, 1, length)
    path.write_bytes(whole.replace(entry, struct.pack("<HHII", 279, 4, 1, length - 6)))
    with pytest.raises(InputError, match=f"hold {length - 6} bytes of {length}"):
        read_image(path)
