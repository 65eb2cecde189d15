"""Opcodes of DNG files: gains are taken, what is not done is told."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.capture.files.images import read_header, read_image
from tests.capture.dng_files import (
    EXPOSURE,
    HEIGHT,
    LIST1,
    LIST2,
    LIST3,
    WIDTH,
    dng,
    gain_map,
    mosaic,
    opcode,
    opcode_list,
    points,
    shading,
)


@pytest.mark.parametrize("demosaic", ["superpixel", "linear"])
@pytest.mark.parametrize("tag", [LIST2, LIST3])
def test_gain_maps_take_the_lens_shading_out(tmp_path, demosaic, tag):
    """A field that fell off like the map's inverse comes out even. Points are float32; the demosaic rounds to 65535."""
    gain = shading(np.arange(HEIGHT), np.arange(WIDTH))
    written = np.round(40000 / gain)[..., None].astype(np.uint16)
    opcodes = {tag: opcode_list(gain_map(points((5, 7)), (HEIGHT, WIDTH), planes=3))}
    path = dng(tmp_path / "a.dng", written, white=60000, opcodes=opcodes)
    image, header = read_image(path, demosaic=demosaic), read_header(path, demosaic=demosaic)
    light = image.pixels / image.full_scale
    # rounding of the file, and half a pixel of the shading's slope where LibRaw has interpolated
    tolerance = 1e-4 if demosaic == "superpixel" else 0.02
    assert np.abs(light * 1.5 - 1).max() <= tolerance
    assert any("lens shading" in note for note in header.notes) and header.doubts == ()


def test_a_gain_map_for_each_colour_of_the_mosaic(tmp_path):
    """As Android writes it: four maps, each on every second row and column."""
    scales = {(0, 0): 1.0, (0, 1): 1.1, (1, 0): 0.9, (1, 1): 1.3}
    gain = np.empty((HEIGHT, WIDTH))
    for (y, x), scale in scales.items():
        gain[y::2, x::2] = scale * shading(np.arange(y, HEIGHT, 2), np.arange(x, WIDTH, 2))
    written = np.round(30000 / gain)[..., None].astype(np.uint16)
    maps = [gain_map(points((4, 6), s), (HEIGHT, WIDTH), first=place, pitch=2) for place, s in scales.items()]
    path = dng(tmp_path / "a.dng", written, white=60000, opcodes={LIST2: opcode_list(*maps)})
    image = read_image(path)
    assert np.abs(image.pixels / image.full_scale * 2 - 1).max() <= 2e-4
    assert np.abs(read_image(path, demosaic="linear").pixels / 65535 * 2 - 1).max() <= 0.02


def test_radial_vignetting_is_taken_out(tmp_path):
    rows, columns = np.arange(HEIGHT) + 0.5 - HEIGHT / 2, np.arange(WIDTH) + 0.5 - WIDTH / 2
    square = (rows[:, None] ** 2 + columns**2) / (HEIGHT**2 / 4 + WIDTH**2 / 4)
    gain = 1 + 0.5 * square + 0.3 * square**2
    written = np.round(np.repeat((30000 / gain)[..., None], 3, axis=2)).astype(np.uint16)
    content = struct.pack(">7d", 0.5, 0.3, 0, 0, 0, 0.5, 0.5)
    path = dng(tmp_path / "a.dng", written, white=60000, opcodes={LIST3: opcode_list(opcode(3, content))})
    image = read_image(path)
    assert np.abs(image.pixels / image.full_scale * 2 - 1).max() <= 1e-4


@pytest.mark.parametrize(
    ("code", "content", "place", "words"),
    [
        (1, bytes(60), "notes", "WarpRectilinear"),
        (7, bytes(40), "doubts", "MapTable"),
        (8, bytes(40), "doubts", "MapPolynomial"),
        (99, b"", "doubts", "opcode 99"),
        (9, bytes(20), "doubts", "damaged gain map"),
        (9, bytes(76), "doubts", "damaged gain map"),
        (4, bytes(8), "doubts", None),
    ],
)
def test_opcodes_that_are_not_applied_are_told(tmp_path, code, content, place, words):
    for tag in (LIST1, LIST2, LIST3):
        path = dng(
            tmp_path / "a.dng", mosaic(), white=60000, opcodes={tag: opcode_list(opcode(code, content))}
        )
        told = getattr(read_header(path), place)
        assert (told == ()) if words is None else (words in told[0])
        assert read_image(path).pixels.shape == (HEIGHT // 2, WIDTH // 2, 3)


@pytest.mark.parametrize("suffix", ["dng", "tif"])
def test_a_picture_below_a_thumbnail(tmp_path, suffix):
    gain = shading(np.arange(HEIGHT), np.arange(WIDTH))
    written = np.round(40000 / gain)[..., None].astype(np.uint16)
    opcodes = {LIST2: opcode_list(gain_map(points((5, 7)), (HEIGHT, WIDTH)))}
    path = dng(tmp_path / f"a.{suffix}", written, white=60000, opcodes=opcodes, exif=EXPOSURE, nested=True)
    image, header = read_image(path), read_header(path)
    assert np.abs(image.pixels / image.full_scale * 1.5 - 1).max() <= 1e-4
    assert header.exposure.exposure_time == pytest.approx(1 / 121, rel=1e-6) and header.size == (
        WIDTH // 2,
        HEIGHT // 2,
    )


BLACK = (50714, 4, [0])


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ([BLACK, (50711, 3, [2])], "CFALayout 2"),
        ([BLACK, (50710, 1, [2, 1, 0])], "a mosaic of the colours 2 1 0"),
        ([BLACK, (50710, 1, [0, 1, 2, 3])], "a mosaic of the colours 0 1 2 3"),
        ([(50714, 5, [512, 0])], "a black level that is no number"),
        ([(50713, 3, [2, 2]), (50714, 3, [512, 512])], "2 black levels for cells of 2 x 2"),
    ],
)
def test_what_libraw_takes_for_something_else_is_refused(tmp_path, entries, words):
    """Colours in another order, another grid and no black level: pixels came out, of other colours or sizes."""
    path = dng(tmp_path / "a.dng", mosaic(), white=60000, black=entries)
    with pytest.raises(InputError, match=words):
        read_image(path)


def test_colours_in_planes_are_refused_and_a_plain_mosaic_may_say_so(tmp_path):
    """LibRaw reads such planes as if they were pixel by pixel."""
    sites = np.repeat(mosaic(), 3, axis=2)
    path = dng(tmp_path / "a.dng", sites, white=60000)
    data = path.read_bytes()
    read_image(path)
    interleaved, planes = struct.pack("<HHI", 284, 3, 1) + b"\1\0", struct.pack("<HHI", 284, 3, 1) + b"\2\0"
    assert data.count(interleaved) == 1
    path.write_bytes(data.replace(interleaved, planes))
    with pytest.raises(InputError, match="planes of their own"):
        read_image(path)
    plain = dng(
        tmp_path / "b.dng", mosaic(), white=60000, black=[BLACK, (50710, 1, [0, 1, 2]), (50711, 3, [1])]
    )
    assert read_image(plain).channels == ("R", "G", "B")
