"""What is read is what the file stores, whatever its header asks of a viewer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image, TiffImagePlugin, features

from photogonio.capture.containers.tone import LINEAR, SRGB, Curve, Tone
from photogonio.capture.errors import InputError
from photogonio.capture.files import about
from photogonio.capture.files.images import read_header, read_image
from tests.capture.dng_files import HEIGHT, WIDTH
from tests.capture.odd_files import exif_block, tiff
from tests.capture.phone_files import near, smooth


def test_what_decoders_make_of_an_orientation_is_undone():
    """EXIF 2.32, section 4.6.4.A: what a viewer shows of stored pixels, by where row 0 and column 0 are."""
    stored = np.arange(6).reshape(2, 3)
    shown = {
        1: stored, 2: stored[:, ::-1], 3: stored[::-1, ::-1], 4: stored[::-1],
        5: stored.T, 6: stored.T[:, ::-1], 7: stored[::-1, ::-1].T, 8: stored.T[::-1],
    }  # fmt: skip
    for orientation, pixels in shown.items():
        found = about.About((3, 2), ("Y",), 8, None, turned=orientation).as_stored(pixels)
        assert np.array_equal(found, stored), orientation


@pytest.mark.parametrize(("name", "codes"), [("a.webp", 0), ("lossy.webp", 12), ("a.bmp", 0)])
def test_webp_and_bmp(tmp_path, name, codes):
    picture = Image.fromarray(smooth())
    options = {} if name == "a.bmp" else {"exif": exif_block(6), "lossless": codes == 0, "quality": 98}
    picture.save(tmp_path / name, **options)
    assert near(tmp_path / name, smooth(), codes)
    if options:
        assert read_header(tmp_path / name).exposure.iso == 100


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("name", ["a.jpg", "a.png", "a.webp", "a.avif"])
def test_orientation_leaves_pixels_alone_in_every_format(tmp_path, orientation, name):
    if name == "a.avif":
        if not features.check("avif"):
            pytest.skip("this Pillow writes no AVIF that viewers turn")
    Image.fromarray(smooth()).save(tmp_path / name, exif=exif_block(orientation), quality=98)
    image = read_image(tmp_path / name)
    assert image.pixels.shape == smooth().shape and read_header(tmp_path / name).size == (WIDTH, HEIGHT)
    assert np.abs(image.pixels.astype(int) - smooth()).max() <= 12


@pytest.mark.parametrize(
    ("corner", "size"),
    [((0, 0), (3, 2)), ((1, 2), (6, 5)), ((-1, -1), (2, 1)), ((9, 9), (4, 4)), ((-2, 1), (4, 2))],
)
def test_pixels_are_placed_where_they_belong(corner, size):
    """Each by itself: pixel (x, y) of the file stands at corner + (x, y), if that is in the picture."""
    pixels = np.arange(1, 7).reshape(2, 3, 1)
    expected = np.zeros((size[1], size[0], 1), int)
    for y, x in np.ndindex(2, 3):
        there = corner[1] + y, corner[0] + x
        if 0 <= there[0] < size[1] and 0 <= there[1] < size[0]:
            expected[there] = pixels[y, x]
    assert np.array_equal(about.placed(pixels, corner, size), expected)


def test_codes_whose_least_is_white_are_turned_over_within_their_bits():
    pixels = np.array([[[0], [5], [1023]]], np.uint16)
    found = about.About((3, 1), ("Y",), 10, None, inverted=True).as_stored(pixels)
    assert found.ravel().tolist() == [1023, 1018, 0] and found.dtype == np.uint16


def test_a_curve_of_other_channels_than_the_picture_is_doubted():
    three = Tone((Curve("gamma", (1.8,)), Curve("gamma", (2.0,)), Curve("gamma", (2.2,))), "ICC profile")
    told, doubts = about.tone_or_doubt(lambda: three, 8, 3, lossy=False)
    assert told == three and doubts == ()
    told, doubts = about.tone_or_doubt(lambda: three, 8, 1, lossy=False)
    assert not told.told and "3 channels, the picture has 1" in doubts[0]


@pytest.mark.parametrize(("gamma", "curve"), [((1, 1), LINEAR), ((22, 10), SRGB)])
def test_exifs_gamma_tells_the_curve_where_nothing_else_does(tmp_path, gamma, curve):
    """EXIF 2.32, Gamma: 2.2 is what a screen's pictures have anyway."""
    Image.fromarray(smooth()).save(tmp_path / "a.jpg", exif=with_gamma(65535, gamma))
    tone = read_header(tmp_path / "a.jpg").tone
    assert tone.curves == (curve,) and tone.told == (curve == LINEAR)


def test_exifs_gamma_against_its_colour_space_is_doubted(tmp_path):
    Image.fromarray(smooth()).save(tmp_path / "a.jpg", exif=with_gamma(1, (1, 1)))
    header = read_header(tmp_path / "a.jpg")
    assert header.tone.curves == (SRGB,) and "linear by its EXIF Gamma" in header.doubts[0]


def with_gamma(space: int, gamma: tuple[int, int]) -> bytes:
    block = Image.Exif()
    inner = block.get_ifd(0x8769)
    inner[0xA001], inner[0xA500] = space, TiffImagePlugin.IFDRational(*gamma)
    return block.tobytes()


@pytest.mark.parametrize("kind", ["uint8", "uint16", "float32"])
@pytest.mark.parametrize("planes", [False, True])
def test_colours_multiplied_by_an_alpha_are_refused_where_it_is_seen_through(tmp_path, kind, planes):
    """A fifth of the picture is half as bright as it was; cut out and opaque pictures are as they were."""
    opaque = np.iinfo(kind).max if kind != "float32" else 1.0
    colours = np.random.default_rng(1).uniform(0.1, 0.9, (20, 30, 3))

    def written(alpha: np.ndarray, extra: int) -> Path:
        pixels = (np.concatenate([colours * alpha, alpha], axis=2) * opaque).astype(kind)
        return tiff(tmp_path / "a.tif", pixels, planar=planes, entries=[(338, 3, [extra])])

    whole, cut, veiled = np.ones((20, 30, 1)), np.ones((20, 30, 1)), np.ones((20, 30, 1))
    cut[:, :10], veiled[:4] = 0.0, 0.5
    for alpha in (whole, cut):
        image = read_image(written(alpha, 1))
        np.testing.assert_allclose(image.pixels / image.full_scale, colours * alpha, atol=1.0 / 255.0)
    with pytest.raises(InputError, match="neither 0 nor 1 in 20% of its pixels"):
        read_image(written(veiled, 1))
    assert read_image(written(veiled, 2)).channels == ("R", "G", "B")  # by which nothing is multiplied
