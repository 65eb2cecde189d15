"""One scene in the files of phones: light as in its 16-bit linear TIFF, within quantisation and half a per cent."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio
import pillow_heif
import pytest

from photogonio.capture.files.images import read_image
from photogonio.capture.linear.encoding import Encoding, linear_to_srgb
from tests.capture.dng_files import LIST3, dng, gain_map, opcode_list

HEIGHT, WIDTH, SIDE = 96, 128, 8
BLACK = 1024
Write = Callable[[Path, np.ndarray], object]


def scene() -> np.ndarray:
    """Light (h, w, 3), full scale 1: a shading over two decades, paler squares, a print's edges."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    shade = 0.9 * 10.0 ** (-2.0 * (x + 0.3 * y) / (WIDTH + 0.3 * HEIGHT))
    paler = 1.0 - 0.4 * ((x // (2 * SIDE) + y // (2 * SIDE)) % 2)
    return (shade * paler)[..., None] * np.array([1.0, 0.8, 0.6])


def codes(light: np.ndarray, bits: int) -> np.ndarray:
    """sRGB's."""
    found = np.round(linear_to_srgb(light) * (2**bits - 1))
    return found.astype(np.uint8 if bits == 8 else np.uint16)


def tiff(path: Path, light: np.ndarray) -> None:
    assert cv2.imwrite(str(path), np.round(light * 65535).astype(np.uint16)[..., ::-1])


def lossless_heic(bits: int) -> Write:
    """Without the turn to luma and chroma, which alone rounds dark colours by 3 %."""

    def write(path: Path, light: np.ndarray) -> None:
        pixels, mode = (codes(light, 8), "RGB") if bits == 8 else (codes(light, bits) << 16 - bits, "RGB;16")
        file = pillow_heif.from_bytes(mode, (WIDTH, HEIGHT), pixels.tobytes())
        file.save(path, quality=-1, chroma=444, matrix_coefficients=0)

    return write


def avif(bits: int) -> Write:
    settings = [cv2.IMWRITE_AVIF_DEPTH, bits, cv2.IMWRITE_AVIF_QUALITY, 100]
    return lambda path, light: cv2.imwrite(str(path), codes(light, bits)[..., ::-1], settings)


def jxl(bits: int) -> Write:
    def write(path: Path, light: np.ndarray) -> None:
        spec = oiio.ImageSpec(WIDTH, HEIGHT, 3, f"uint{bits}")
        spec.attribute("compression", "jpegxl:100")
        spec.attribute("oiio:ColorSpace", "sRGB")
        file = oiio.ImageOutput.create(str(path))
        assert file.open(str(path), spec) and file.write_image(codes(light, bits)), file.geterror()
        file.close()

    return write


def levels(light: np.ndarray) -> np.ndarray:
    return np.round(BLACK + light * (65535 - BLACK)).astype(np.uint16)


def shaded_dng(path: Path, light: np.ndarray) -> None:
    """As a lens dims it, with the map that undoes it; its points are bilinear in the picture."""
    y, x = np.linspace(0, 1, 5)[:, None], np.linspace(0, 1, 7)
    points = (1.0 + 0.8 * x + 0.5 * y + 0.6 * x * y)[..., None]
    rows, columns = (np.arange(HEIGHT)[:, None] + 0.5) / HEIGHT, (np.arange(WIDTH) + 0.5) / WIDTH
    gain = (1.0 + 0.8 * columns + 0.5 * rows + 0.6 * rows * columns)[..., None]
    undone = opcode_list(gain_map(points, (HEIGHT, WIDTH), planes=3))
    dng(path, levels(light / gain), white=65535, black=BLACK, opcodes={LIST3: undone})


FORMATS: dict[str, tuple[int, Write]] = {
    "8.heic": (8, lossless_heic(8)),
    "10.heic": (10, lossless_heic(10)),
    "8.avif": (8, avif(8)),
    "10.avif": (10, avif(10)),
    "12.avif": (12, avif(12)),
    "8.jxl": (8, jxl(8)),
    "16.jxl": (16, jxl(16)),
    "16.dng": (16, lambda path, light: dng(path, levels(light), white=65535, black=BLACK)),
    "16-shaded.dng": (16, shaded_dng),
}


def light_of(path: Path) -> np.ndarray:
    """As the file says that its codes stand for it."""
    image = read_image(path)
    read = Encoding("linear") if image.raw else Encoding("file").own_of(image.tone)
    return read.linear(np.asarray(image.pixels, float) / image.full_scale, 3)


def squares(light: np.ndarray) -> np.ndarray:
    return light.reshape(HEIGHT // SIDE, SIDE, WIDTH // SIDE, SIDE, 3).mean(axis=(1, 3))


@pytest.mark.parametrize("name", FORMATS)
def test_light_is_as_in_the_tiff(tmp_path, name):
    bits, write = FORMATS[name]
    tiff(tmp_path / "scene.tif", scene())
    write(tmp_path / name, scene())
    right, found = light_of(tmp_path / "scene.tif"), light_of(tmp_path / name)
    # half a code of the file, in light; compression wavers by some codes a pixel, which squares average
    step = 0.5 * np.gradient(Encoding("srgb").linear(np.arange(2**bits)[:, None] / (2**bits - 1), 1)[:, 0])
    half = np.interp(linear_to_srgb(right), np.linspace(0, 1, 2**bits), step)
    off = np.abs(squares(found) - squares(right))
    assert (off <= squares(half) + 0.005 * squares(right)).all()
    assert np.abs(found.mean((0, 1)) / right.mean((0, 1)) - 1).max() < 0.002
