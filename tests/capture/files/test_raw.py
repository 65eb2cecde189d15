"""DNG files in the ways that phones, converters and mergers write them."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from photogonio.capture.containers import float_tiles, tiff
from photogonio.capture.errors import InputError
from photogonio.capture.files.images import read_header, read_image
from tests.capture.odd_files import dng, gain_map, opcode, opcode_list

RNG = np.random.default_rng(0)
HEIGHT, WIDTH = 48, 64
EXPOSURE = [(0x829A, 5, [1, 121]), (0x829D, 5, [28, 10])]
LIST1, LIST2, LIST3 = 51008, 51009, 51022


def mosaic(kind: str = "uint16") -> np.ndarray:
    if kind.startswith("float"):
        return RNG.uniform(0, 0.9, (HEIGHT, WIDTH, 1)).astype(kind)
    return RNG.integers(1000, 50000, (HEIGHT, WIDTH, 1)).astype(kind)


def cells(sites: np.ndarray) -> np.ndarray:
    """(h / 2, w / 2, 3) of a mosaic (h, w) of red, green, green, blue."""
    return np.stack([sites[::2, ::2], (sites[::2, 1::2] + sites[1::2, ::2]) / 2, sites[1::2, 1::2]], axis=-1)


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


@pytest.mark.parametrize("kind", ["float16", "float32"])
@pytest.mark.parametrize("predictor", [3, 34894, 34895])
def test_floats_below_a_thumbnail_and_compressed(tmp_path, kind, predictor):
    """As converters write merged exposures; LibRaw and the search for the brightest must see the same."""
    written = mosaic(kind)
    written[5, 5] = 4.0
    written[7, 7] = -0.01
    path = dng(tmp_path / "a.dng", written, white=1, nested=True, predictor=predictor)
    with path.open("rb") as file:
        tags = list(tiff.with_children(file))[1]
    assert float_tiles.brightest(path, tags) == 4.0
    image = read_image(path)
    light = cells(np.minimum(written[..., 0], 1).astype(float))
    assert (
        np.abs(np.delete(image.pixels / image.full_scale - light, (2, 3), axis=0)).max() <= 4 * 1.01 / 16383
    )
    assert np.argwhere(image.saturated).tolist() == [[2, 2]]


def test_floats_deflated_without_a_predictor_are_refused(tmp_path):
    """LibRaw 0.22 undoes one that is not there."""
    path = dng(tmp_path / "a.dng", mosaic("float32"), white=1, predictor=1)
    with pytest.raises(InputError, match=r"a\.dng: .*without a predictor"):
        read_image(path)


def test_floats_that_only_libraw_reads_are_refused_at_the_white_level(tmp_path, monkeypatch):
    written = mosaic("float32")
    written[5, 5] = 4.0
    path = dng(tmp_path / "a.dng", written, white=1)
    monkeypatch.setattr(float_tiles, "TYPES", {})
    with pytest.raises(InputError, match=r"a\.dng: .*WhiteLevel"):
        read_image(path)


def shading(rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Bilinear in the picture: any grid of points has it exactly."""
    y, x = (rows[:, None] + 0.5) / HEIGHT, (columns[None] + 0.5) / WIDTH
    return 1.2 + 0.8 * x + 0.5 * y + 0.6 * x * y


def points(count: tuple[int, int], scale: float = 1.0) -> np.ndarray:
    y, x = np.linspace(0, 1, count[0])[:, None], np.linspace(0, 1, count[1])
    return scale * (1.2 + 0.8 * x + 0.5 * y + 0.6 * x * y)[..., None]


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


def test_a_dng_by_another_name_is_a_dng(tmp_path):
    written = mosaic()
    path = dng(tmp_path / "a.tif", written, white=60000)
    assert np.array_equal(read_image(path).pixels, cells(written[..., 0].astype(np.float32)))


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
