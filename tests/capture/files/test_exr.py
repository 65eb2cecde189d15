"""Of an OpenEXR file with many channels the photo is taken: not its depth, normals and masks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from photogonio.capture.containers.tone import LINEAR, SRGB, Curve
from photogonio.capture.errors import InputError
from photogonio.capture.files.exr import tone_of
from photogonio.capture.files.images import read_header, read_image

RNG = np.random.default_rng(0)


def exr(path: Path, *parts: tuple[str, tuple[str, ...]], kinds: tuple[str, ...] = ()) -> list[np.ndarray]:
    """A file of named parts, each of named channels; the pixels of each."""
    specs, pictures = [], []
    for name, channels in parts:
        spec = oiio.ImageSpec(13, 9, len(channels), kinds[0] if len(set(kinds)) == 1 else "float")
        spec.channelnames = channels
        spec.attribute("oiio:subimagename", name)
        if len(set(kinds)) > 1:
            spec.channelformats = tuple(oiio.TypeDesc(kind) for kind in kinds)
        specs.append(spec)
        pictures.append(RNG.uniform(0, 2, (9, 13, len(channels))).astype(np.float32))
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), tuple(specs) if len(specs) > 1 else specs[0])
    for k, picture in enumerate(pictures):
        assert k == 0 or file.open(str(path), specs[k], "AppendSubimage")
        assert file.write_image(picture)
    file.close()
    return pictures


@pytest.mark.parametrize(
    ("channels", "taken"),
    [
        (("R", "G", "B", "N.X", "N.Y", "N.Z"), (0, 1, 2)),
        (("N.X", "N.Y", "N.Z", "R", "G", "B", "A", "Z"), (3, 4, 5)),
        (("B", "G", "R", "Z", "depth.Z", "albedo.R", "albedo.G", "albedo.B"), (2, 1, 0)),
        (("beauty.B", "beauty.G", "beauty.R"), (2, 1, 0)),
        (("beauty.R", "beauty.G", "beauty.B", "beauty.A", "N.X", "N.Y", "N.Z", "depth.Z"), (0, 1, 2)),
        (
            ("View.Combined.R", "View.Combined.G", "View.Combined.B", "View.Depth.Z", "View.Normal.X"),
            (0, 1, 2),
        ),
        (("Y",), (0,)),
        (("Y", "A"), (0,)),
        (("X", "Y", "Z"), (0, 1, 2)),
        (("S0.400nm", "S0.500nm", "S0.600nm", "S0.700nm"), (0, 1, 2, 3)),
        (("band0", "band1", "band2", "band3", "band4"), (0, 1, 2, 3, 4)),
        (("R", "G", "B", "NIR"), (0, 1, 2, 3)),
        (("b", "g", "r", "a"), (2, 1, 0)),
        (("Blue", "Green", "Red", "Alpha"), (2, 1, 0)),
        (("R", "G", "B", "Depth", "objectId", "u", "v"), (0, 1, 2)),
        (("R", "G", "B", "Nx", "Ny", "Nz"), (0, 1, 2)),
        (("beauty.R", "beauty.G", "beauty.B", "CryptoObject00.R", "CryptoObject00.G"), (0, 1, 2)),
        (("V.Combined.R", "V.Combined.G", "V.Combined.B", "V.Mist.Z", "V.IndexOB.X"), (0, 1, 2)),
    ],
)
def test_the_picture_is_found_among_the_channels(tmp_path, channels, taken):
    (pixels,) = exr(tmp_path / "a.exr", ("", channels))
    image = read_image(tmp_path / "a.exr")
    assert image.channels == tuple(channels[k] for k in taken) == read_header(tmp_path / "a.exr").channels
    assert np.array_equal(image.pixels, pixels[..., list(taken)])


def test_the_part_with_the_picture_is_found(tmp_path):
    rgb = ("R", "G", "B")
    parts = exr(tmp_path / "a.exr", ("depth", ("Z",)), ("picture", rgb), ("normals", ("N.X", "N.Y", "N.Z")))
    assert np.array_equal(read_image(tmp_path / "a.exr").pixels, parts[1])
    assert read_header(tmp_path / "a.exr").channels == rgb


@pytest.mark.parametrize(
    ("parts", "words"),
    [
        ([("left", ("R", "G", "B")), ("right", ("R", "G", "B"))], "several pictures .left, right."),
        (
            [("", ("diffuse.R", "diffuse.G", "diffuse.B", "glossy.R", "glossy.G", "glossy.B"))],
            "diffuse, glossy",
        ),
        ([("", ("Z",))], "no channel of light"),
        ([("", ("N.X", "N.Y", "N.Z", "A"))], "no channel of light"),
    ],
)
def test_what_is_not_one_picture_is_refused(tmp_path, parts, words):
    exr(tmp_path / "a.exr", *parts)
    for read in (read_header, read_image):
        with pytest.raises(InputError, match=rf"a\.exr: .*{words}"):
            read(tmp_path / "a.exr")


def test_channels_of_several_types(tmp_path):
    """A mask of whole numbers beside the colours does not matter; colours of whole numbers are refused."""
    (pixels,) = exr(tmp_path / "a.exr", ("", ("R", "G", "B", "id")), kinds=("half", "half", "half", "uint"))
    image = read_image(tmp_path / "a.exr")
    assert image.pixels.dtype == np.float16
    assert np.abs(image.pixels - pixels[..., :3]).max() <= 2.0**-11 * 2
    exr(tmp_path / "b.exr", ("", ("R", "G", "B")), kinds=("uint", "uint", "uint"))
    with pytest.raises(InputError, match="pixels of type uint"):
        read_image(tmp_path / "b.exr")


def test_attributes_that_are_no_text_are_left_out(tmp_path, files):
    files["oiio"](
        tmp_path / "a.exr", np.ones((9, 13, 3), np.float32), "half", comment="0123456789", ExposureTime=0.25
    )
    data = (tmp_path / "a.exr").read_bytes()
    assert data.count(b"0123456789") == 1
    (tmp_path / "a.exr").write_bytes(data.replace(b"0123456789", b"\xff\xfe\x80\x81\xc3(\xa0\xa1\xe2\x28"))
    assert read_header(tmp_path / "a.exr").exposure.exposure_time == 0.25
    assert np.all(read_image(tmp_path / "a.exr").pixels == 1)


def test_damaged_headers_are_one_line_each(tmp_path):
    exr(tmp_path / "a.exr", ("", ("R", "G", "B")))
    whole = (tmp_path / "a.exr").read_bytes()
    for k in range(8, 330, 7):
        damaged = bytearray(whole)
        damaged[k] ^= 0xFF
        (tmp_path / "b.exr").write_bytes(damaged)
        try:
            read_image(tmp_path / "b.exr")
        except InputError as error:
            assert "\n" not in str(error)


@pytest.mark.parametrize(
    "window", [(2, 1, 20, 15), (-3, -2, 8, 6), (0, 0, 13, 9), (0, 0, 20, 4), (30, 30, 40, 40)]
)
def test_the_display_window_is_the_picture(tmp_path, window):
    """x and y of the pixels in it, its width and height. Outside of the pixels it is black, as OpenEXR has it."""
    x, y, width, height = window
    spec = oiio.ImageSpec(13, 9, 3, "float")
    spec.x, spec.y, spec.full_width, spec.full_height = x, y, width, height
    pixels = RNG.uniform(1, 2, (9, 13, 3)).astype(np.float32)
    file = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    assert file.open(str(tmp_path / "a.exr"), spec) and file.write_image(pixels)
    file.close()
    expected = np.zeros((height, width, 3), np.float32)
    for row, column in np.ndindex(height, width):
        if 0 <= row - y < 9 and 0 <= column - x < 13:
            expected[row, column] = pixels[row - y, column - x]
    assert read_header(tmp_path / "a.exr").size == (width, height)
    assert np.array_equal(read_image(tmp_path / "a.exr").pixels, expected)


@pytest.mark.parametrize("place", [(100, 0), (0, -40), (-13, 0)])
def test_pixels_outside_the_display_window_are_refused(tmp_path, place):
    spec = oiio.ImageSpec(13, 9, 3, "float")
    spec.x, spec.y = place
    spec.full_x, spec.full_y, spec.full_width, spec.full_height = 0, 0, 20, 15
    file = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    assert file.open(str(tmp_path / "a.exr"), spec) and file.write_image(np.ones((9, 13, 3), np.float32))
    file.close()
    with pytest.raises(InputError, match=r"a\.exr: .*outside its display window"):
        read_image(tmp_path / "a.exr")


@pytest.mark.parametrize(
    ("name", "curve"),
    [
        ("lin_rec709_scene", LINEAR),
        ("data", LINEAR),
        ("srgb_rec709_scene", SRGB),
        ("g22_adobergb_scene", Curve("gamma", (2.2,))),
        ("pq_rec2020_display", Curve("pq")),
    ],
)
def test_a_named_colour_space_is_undone(tmp_path, name, curve):
    """OpenEXR 3.4's colorInteropID: codes of a display that somebody put into an EXR are no light."""
    spec = oiio.ImageSpec(13, 9, 3, "float")
    spec.attribute("colorInteropID", name)
    file = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    assert file.open(str(tmp_path / "a.exr"), spec)
    assert file.write_image(RNG.uniform(0, 1, (9, 13, 3)).astype(np.float32))
    file.close()
    assert read_header(tmp_path / "a.exr").tone.curves == (curve,)


def test_a_colour_space_of_no_known_name_is_told():
    spec = oiio.ImageSpec(13, 9, 3, "float")
    spec.attribute("colorInteropID", "ocean_blue")
    with pytest.raises(ValueError, match="ocean_blue"):
        tone_of(spec)
