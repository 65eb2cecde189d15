"""One scene through every format: the same radiance, within the file's own steps, and without a bias."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import OpenImageIO as oiio
import pillow_heif
import pytest
from PIL import Image

from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset
from tests.capture.dng_files import dng, gain_map, opcode_list
from tests.capture.odd_files import (
    app2,
    gamma_tag,
    icc_profile,
    iccp,
    jpeg,
    png,
    tiff,
)

HEIGHT, WIDTH = 96, 128
ADOBE = 563 / 256
BLOCK = 16  # pixels of a side over which steps average out
BIAS = 0.005


def scene() -> np.ndarray:
    """Light from 0.04 to 0.9 of full scale, coloured, with a little noise that dithers the codes."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    light = 0.04 * 20.0 ** (x / WIDTH) * (1 - 0.3 * y / HEIGHT)
    colour = np.stack([light * 1.05, light, light * (0.75 + 0.2 * y / HEIGHT)], axis=-1)
    return colour * np.random.default_rng(0).normal(1.0, 0.02, colour.shape)


def srgb(light: np.ndarray) -> np.ndarray:
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 0) ** (1 / 2.4) - 0.055)


def codes(light: np.ndarray, bits: int) -> np.ndarray:
    return np.round(light * (2**bits - 1)).astype(np.uint8 if bits == 8 else np.uint16)


def heic(path: Path, pixels: np.ndarray, bits: int, chroma: int) -> None:
    mode = "RGB" if bits == 8 else "RGB;16"
    data = pixels if bits == 8 else pixels << (16 - bits)
    pillow_heif.from_bytes(mode, (WIDTH, HEIGHT), data.tobytes()).save(path, quality=95, chroma=chroma)


def avif(path: Path, pixels: np.ndarray, bits: int) -> None:
    cv2.imwrite(str(path), pixels[..., ::-1], [cv2.IMWRITE_AVIF_DEPTH, bits, cv2.IMWRITE_AVIF_QUALITY, 95])


def by_oiio(path: Path, pixels: np.ndarray, profile: bytes, **more: object) -> None:
    spec = oiio.ImageSpec(WIDTH, HEIGHT, 3, str(pixels.dtype))
    spec.attribute(
        "ICCProfile", oiio.TypeDesc(f"uint8[{len(profile)}]"), np.frombuffer(profile, np.uint8).copy()
    )
    for name, value in more.items():
        spec.attribute(name, value)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec) and file.write_image(pixels), file.geterror()
    file.close()


def jxl(path: Path, pixels: np.ndarray, quality: int) -> None:
    by_oiio(path, pixels, ADOBE_PROFILE, compression=f"jpegxl:{quality}")


def shaded_dng(path: Path, light: np.ndarray) -> None:
    """A linear DNG of 14 bits whose lens loses up to two thirds of the light, and says so."""
    y, x = np.linspace(0, 1, 13)[:, None], np.linspace(0, 1, 17)
    gain = 1 + 2 * ((x - 0.5) ** 2 + (y - 0.5) ** 2)
    columns, rows = 16 * (np.arange(WIDTH) + 0.5) / WIDTH, 12 * (np.arange(HEIGHT) + 0.5) / HEIGHT
    places = [part.astype(np.float32) for part in np.meshgrid(columns, rows)]
    full = cv2.remap(gain.astype(np.float32), *places, cv2.INTER_LINEAR)
    shaded = np.round(light / full[..., None] * 16000 + 256).astype(np.uint16)
    maps = opcode_list(gain_map(gain[..., None], (HEIGHT, WIDTH), planes=3))
    dng(path, shaded, white=16256, black=256, opcodes={51022: maps})


ADOBE_PROFILE = icc_profile(gamma_tag(ADOBE), name="Adobe RGB (1998)")
WRITERS: dict[str, Callable[[Path, np.ndarray], object]] = {
    "png-8-srgb.png": lambda path, light: png(path, codes(srgb(light), 8)),
    "png-16-adobe.png": lambda path, light: png(path, codes(light ** (1 / ADOBE), 16), iccp(ADOBE_PROFILE)),
    "png-8-pq.png": lambda path, light: png(path, codes(srgb(light), 8), (b"cICP", bytes([12, 13, 0, 1]))),
    "tiff-8.tif": lambda path, light: tiff(path, codes(srgb(light), 8)),
    "tiff-16-planar.tif": lambda path, light: tiff(path, codes(light, 16), planar=True),
    "jpeg.jpg": lambda path, light: jpeg(path, codes(srgb(light), 8)),
    "jpeg-adobe.jpg": lambda path, light: jpeg(path, codes(light ** (1 / ADOBE), 8), app2(ADOBE_PROFILE)),
    "jpeg-420.jpg": lambda path, light: Image.fromarray(codes(srgb(light), 8)).save(path, quality=95),
    "heic-8.heic": lambda path, light: heic(path, codes(srgb(light), 8), 8, 420),
    "heic-10.heic": lambda path, light: heic(path, codes(srgb(light), 10), 10, 444),
    "avif-8.avif": lambda path, light: avif(path, codes(srgb(light), 8), 8),
    "avif-10.avif": lambda path, light: avif(path, codes(srgb(light), 10), 10),
    "jxl-16.jxl": lambda path, light: jxl(path, codes(light ** (1 / ADOBE), 16), 100),
    "jxl-8-lossy.jxl": lambda path, light: jxl(path, codes(light ** (1 / ADOBE), 8), 95),
    "webp.webp": lambda path, light: Image.fromarray(codes(srgb(light), 8)).save(path, quality=98),
    "webp-lossless.webp": lambda path, light: Image.fromarray(codes(srgb(light), 8)).save(
        path, lossless=True
    ),
    "bmp.bmp": lambda path, light: Image.fromarray(codes(srgb(light), 8)).save(path),
    "exr.exr": lambda path, light: by_oiio(path, light.astype(np.float32), ADOBE_PROFILE),
    "linear.dng": shaded_dng,
}


COMPRESSED = {name for name in WRITERS if name.split(".")[1] in ("jpg", "heic", "avif", "webp")} | {
    "jxl-8-lossy.jxl"
}
COMPRESSED -= {"webp-lossless.webp"}


@pytest.mark.parametrize("name", WRITERS)
def test_one_scene_through_every_format(tmp_path, files, name):
    """Means of blocks of 256 pixels: steps average out, and what stays is a bias. Compression, and the transform to
    luminance and chroma, may leave one and a half codes of 8 bits."""
    light = scene()
    for k in range(2):
        WRITERS[name](tmp_path / f"{k}-{name}", light)
    files["manifest"](tmp_path, [{"file": f"{k}-{name}", "role": "sample"} for k in range(2)])
    photoset = load_photoset(tmp_path)
    found = prepare(photoset).read(photoset.views("sample")[0]).value
    assert found.shape == light.shape
    slope = 2.4 / 1.055 * light ** (1.4 / 2.4) if name in COMPRESSED else 0 * light
    assert (np.abs(blocks(found) - blocks(light)) <= BIAS * blocks(light) + 1.5 / 255 * blocks(slope)).all()


def blocks(picture: np.ndarray) -> np.ndarray:
    parts = picture.reshape(HEIGHT // BLOCK, BLOCK, WIDTH // BLOCK, BLOCK, 3)
    return parts.mean(axis=(1, 3), dtype=float)
