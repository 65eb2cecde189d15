"""Linear pixels from an opened camera RAW: superpixels of the mosaic, or a demosaic method that LibRaw names.

No curve, no white balance, no colour matrix, no automatic brightness: black and white level are the file's.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import rawpy

from photogonio.capture.containers import exif as blocks
from photogonio.capture.containers import float_tiles
from photogonio.capture.containers.dng import Dng

METHODS = {
    "linear": rawpy.DemosaicAlgorithm.LINEAR,
    "vng": rawpy.DemosaicAlgorithm.VNG,
    "ppg": rawpy.DemosaicAlgorithm.PPG,
    "ahd": rawpy.DemosaicAlgorithm.AHD,
    "dht": rawpy.DemosaicAlgorithm.DHT,
}
FULL = 65535
FLOAT_WHITE = 16383  # to which LibRaw scales the brightest float, or the white level if that is above it


@dataclass(frozen=True, slots=True)
class RawPixels:
    pixels: np.ndarray  # (h, w, c) float32, sensor units above black
    white: float  # sensor units above black at which a site is full
    black: float  # the file's black level, in the same units
    saturated: np.ndarray  # (h, w) bool
    channels: tuple[str, ...]
    sites: tuple[int, ...]  # sensor sites averaged in each channel


def pixels_of(raw: rawpy.RawPy, method: str, dng: Dng) -> RawPixels:
    """By the method asked for, where the picture allows it: one that is no mosaic any more is taken as it is, and of
    mosaics other than 2 x 2 there are no superpixels, but LibRaw's own.

    Raises ValueError, saying why, if the picture cannot be had.
    """
    if raw.raw_type == rawpy.RawType.Stack or raw.num_colors == 1:
        return stacked(raw, dng)
    if method == "superpixel" and has_cells(raw):
        return superpixels(raw, dng)
    return demosaiced(raw, "linear" if method == "superpixel" else method, dng)


def has_cells(raw: rawpy.RawPy) -> bool:
    """Whether the mosaic is one of 2 x 2."""
    pattern = raw.raw_pattern if raw.raw_type == rawpy.RawType.Flat else None
    return pattern is not None and pattern.shape == (2, 2)


def white_of_floats(raw: rawpy.RawPy, dng: Dng) -> float:
    """LibRaw makes integers of a DNG's floats, and takes the brightest of them for the white level where that is above
    the file's own. Raises ValueError if that cannot be undone."""
    white = white_level(raw)
    if dng.picture is not None and float_tiles.misread(dng.picture[1]):
        raise ValueError(
            "is a DNG of floats deflated without a predictor, which LibRaw takes for one with; write it as OpenEXR"
        )
    if dng.white is None or white == dng.white or int(raw.raw_image.max()) < FLOAT_WHITE - 1:
        return white
    brightest = float_tiles.brightest(*dng.picture) if dng.picture else None
    if brightest is None:
        raise ValueError(
            "is a DNG of floats that reach its WhiteLevel or pass it, which LibRaw scales by the brightest of them; "
            "write it as OpenEXR, or as integers"
        )
    return white * min(1.0, dng.white / brightest)


def superpixels(raw: rawpy.RawPy, dng: Dng) -> RawPixels:
    """Each 2 x 2 cell of the mosaic as one pixel, the two greens averaged: half the size, no interpolation.

    Red and blue sites lie a quarter of a superpixel on either side of the pixel's centre.
    """
    colours = np.array(raw.raw_colors_visible[:2, :2])
    letters = np.array(list(raw.color_desc.decode()))[colours]
    channels = tuple(name for name in "RGBCMYE" if name in letters)
    mosaic = raw.raw_image_visible
    height, width = mosaic.shape[0] // 2, mosaic.shape[1] // 2
    pixels = np.zeros((height, width, len(channels)), np.float32)
    saturated = np.zeros((height, width), bool)
    white = white_of_floats(raw, dng)
    sites = [int((letters == name).sum()) for name in channels]
    for y, x in np.ndindex(2, 2):
        plane = mosaic[y : 2 * height : 2, x : 2 * width : 2]
        c = channels.index(letters[y, x])
        rows, columns = np.arange(y, 2 * height, 2), np.arange(x, 2 * width, 2)
        gain = dng.gain(rows, columns, mosaic.shape[:2])
        light = (plane.astype(np.float32) - black_at(raw, dng, rows, columns, int(colours[y, x]))) / sites[c]
        pixels[..., c] += light if isinstance(gain, float) else light * gain.astype(np.float32)
        saturated |= plane >= white
    mean = mean_black(raw, dng)
    return RawPixels(pixels, white - mean, mean, saturated, channels, tuple(sites))


def black_at(
    raw: rawpy.RawPy, dng: Dng, rows: np.ndarray, columns: np.ndarray, channel: int, plane: int = 0
) -> np.ndarray | np.float32:
    """File units at pixels of the visible picture, (rows, columns), or one number for the whole channel."""
    if dng.black is None:
        return np.float32(raw.black_level_per_channel[channel])
    return dng.black.at(rows + raw.sizes.top_margin, columns + raw.sizes.left_margin, plane)


def mean_black(raw: rawpy.RawPy, dng: Dng) -> float:
    return float(np.mean(raw.black_level_per_channel)) if dng.black is None else dng.black.mean


def stacked(raw: rawpy.RawPy, dng: Dng) -> RawPixels:
    """A picture that has all its colours at each pixel (linear DNG, a sensor without a mosaic), as it is."""
    planes = raw.raw_image_visible
    planes = planes[..., None] if planes.ndim == 2 else planes
    count = min(raw.num_colors, planes.shape[2])
    letters = raw.color_desc.decode()
    pixels = planes[..., :count].astype(np.float32)
    rows, columns = np.arange(planes.shape[0]), np.arange(planes.shape[1])
    for c in range(count):
        pixels[..., c] -= black_at(raw, dng, rows, columns, c, c)
        if dng.gains:
            pixels[..., c] *= dng.gain(rows, columns, planes.shape[:2], c)
    own = float(np.mean(raw.black_level_per_channel[:count]))
    white, mean = white_of_floats(raw, dng), own if dng.black is None else dng.black.mean
    full = np.asarray((planes[..., :count] >= white).any(axis=2))
    return RawPixels(pixels, white - mean, mean, full, tuple(letters[:count]), (1,) * count)


def demosaiced(raw: rawpy.RawPy, method: str, dng: Dng) -> RawPixels:
    """Full size, by LibRaw's ``method``; below black is cut to 0, as LibRaw has it."""
    white, black = white_of_floats(raw, dng), mean_black(raw, dng)
    full = raw.raw_image_visible >= white
    factor = 65535.0 / (white_level(raw) - black)
    levels: dict[str, Any] = levelled(raw, dng) if dng.gains or dng.black else {}
    most = dng.most if dng.gains else 1.0
    pixels = raw.postprocess(
        demosaic_algorithm=METHODS[method],
        gamma=(1, 1),
        no_auto_bright=True,
        adjust_maximum_thr=0.0,
        output_color=rawpy.ColorSpace.raw,
        output_bps=16,
        user_wb=[1.0, 1.0, 1.0, 1.0],
        user_flip=0,
        highlight_mode=rawpy.HighlightMode.Clip,
        **levels,
    ).astype(np.float32)
    pixels *= np.float32(most)
    channels = tuple("RGB"[: pixels.shape[2]])
    return RawPixels(pixels, (white - black) * factor, black * factor, full, channels, (1,) * len(channels))


def levelled(raw: rawpy.RawPy, dng: Dng) -> dict[str, Any]:
    """Take black from the mosaic and multiply it by its gains, over the greatest of them, in place and over all of 16
    bits; and the levels that LibRaw is to be told."""
    mosaic = raw.raw_image_visible
    height, width = mosaic.shape
    colours = raw.raw_colors_visible
    scale = FULL / (white_level(raw) - mean_black(raw, dng)) / dng.most
    for y, x in np.ndindex(2, 2):
        rows, columns = np.arange(y, height, 2), np.arange(x, width, 2)
        black = black_at(raw, dng, rows, columns, int(colours[y, x]))
        light = (
            (mosaic[y::2, x::2].astype(np.float32) - black) * dng.gain(rows, columns, (height, width)) * scale
        )
        mosaic[y::2, x::2] = np.clip(np.round(light), 0, FULL).astype(np.uint16)
    return {"user_black": 0, "user_sat": FULL}


def white_level(raw: rawpy.RawPy) -> float:
    """The level, in file units, at which the first channel is full."""
    levels = [level for level in raw.camera_white_level_per_channel or [] if level > 0]
    return float(min([raw.white_level, *levels]))


def size(raw: rawpy.RawPy, demosaic: str) -> tuple[int, int]:
    """Width and height of the pixels that will be decoded."""
    width, height = raw.sizes.width, raw.sizes.height
    return (width // 2, height // 2) if demosaic == "superpixel" and has_cells(raw) else (width, height)


def attributes(raw: rawpy.RawPy, path: Path) -> Mapping[str, object]:
    """Exposure in EXIF's words: the file's own where it is laid out as a TIFF, else what LibRaw found.

    LibRaw gives 1 s at f/1 where it knows nothing.
    """
    other = raw.other
    found: dict[str, object] = {}
    if other.iso_speed > 0:
        found["Exif:PhotographicSensitivity"] = other.iso_speed
    if other.iso_speed > 0 or (other.shutter_speed, other.aperture) != (1.0, 1.0):
        found |= {"ExposureTime": other.shutter_speed, "FNumber": other.aperture}
    own = blocks.of_file(path)
    if any(name in own for name in ("ExposureTime", "Exif:ShutterSpeedValue")):
        found.pop("ExposureTime", None)
    if any(name in own for name in ("FNumber", "Exif:ApertureValue")):
        found.pop("FNumber", None)
    return found | own
