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
from photogonio.capture.containers.dng import Dng

METHODS = {
    "linear": rawpy.DemosaicAlgorithm.LINEAR,
    "vng": rawpy.DemosaicAlgorithm.VNG,
    "ppg": rawpy.DemosaicAlgorithm.PPG,
    "ahd": rawpy.DemosaicAlgorithm.AHD,
    "dht": rawpy.DemosaicAlgorithm.DHT,
}
FULL = 65535
# repeats of a mosaic's colours; others it takes for one of these, and mixes colours
BY_LIBRAW = {(2, 2), (6, 6)}


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
    if dng.cells is not None and dng.cells not in BY_LIBRAW:
        raise ValueError(f"has a mosaic that repeats by {' x '.join(map(str, dng.cells))}; expected 2 x 2")
    if dng.unread:
        raise ValueError(dng.unread)
    stack = raw.raw_type == rawpy.RawType.Stack or raw.num_colors == 1
    white, black = level_of_white(raw, dng), mean_black(raw, dng, raw.num_colors if stack else 4)
    if not black < white:
        raise ValueError(
            f"states a black level of {black:.6g}, which is not below its white level of {white:.6g}"
        )
    if stack:
        return stacked(raw, dng)
    if method == "superpixel" and has_cells(raw):
        return superpixels(raw, dng)
    return demosaiced(raw, "linear" if method == "superpixel" else method, dng)


def has_cells(raw: rawpy.RawPy) -> bool:
    """Whether the mosaic is one of 2 x 2."""
    pattern = raw.raw_pattern if raw.raw_type == rawpy.RawType.Flat else None
    return pattern is not None and pattern.shape == (2, 2)


def sites_of(raw: rawpy.RawPy, dng: Dng) -> np.ndarray:
    """What is stored of the visible picture, (h, w) of a mosaic or (h, w, c), in the file's units.

    Raises ValueError if a DNG's floats cannot be had.
    """
    floats = dng.floats()
    if floats is None:
        return raw.raw_image_visible
    top, left = raw.sizes.top_margin, raw.sizes.left_margin
    part = floats[top : top + raw.sizes.height, left : left + raw.sizes.width]
    return part if raw.raw_image.ndim == 3 else part[..., 0]


def level_of_white(raw: rawpy.RawPy, dng: Dng) -> float:
    """In the same units."""
    return white_level(raw) if dng.white is None else dng.white


def superpixels(raw: rawpy.RawPy, dng: Dng) -> RawPixels:
    """Each 2 x 2 cell of the mosaic as one pixel, the two greens averaged: half the size, no interpolation.

    Red and blue sites lie a quarter of a superpixel on either side of the pixel's centre.
    """
    colours = np.array(raw.raw_colors_visible[:2, :2])
    letters = np.array(list(raw.color_desc.decode()))[colours]
    channels = tuple(name for name in "RGBCMYE" if name in letters)
    mosaic = sites_of(raw, dng)
    height, width = mosaic.shape[0] // 2, mosaic.shape[1] // 2
    pixels = np.zeros((height, width, len(channels)), np.float32)
    saturated = np.zeros((height, width), bool)
    white = level_of_white(raw, dng)
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


def mean_black(raw: rawpy.RawPy, dng: Dng, channels: int = 4) -> float:
    """Of the sites of a mosaic's cell, or of so many channels."""
    own = raw.black_level_per_channel[:channels]
    return float(np.mean(own)) if dng.black is None else dng.black.mean


def stacked(raw: rawpy.RawPy, dng: Dng) -> RawPixels:
    """A picture that has all its colours at each pixel (linear DNG, a sensor without a mosaic), as it is."""
    planes = sites_of(raw, dng)
    planes = planes[..., None] if planes.ndim == 2 else planes
    count = min(raw.num_colors, planes.shape[2])
    letters = raw.color_desc.decode()
    pixels = planes[..., :count].astype(np.float32)
    rows, columns = np.arange(planes.shape[0]), np.arange(planes.shape[1])
    for c in range(count):
        pixels[..., c] -= black_at(raw, dng, rows, columns, c, c)
        if dng.gains:
            pixels[..., c] *= dng.gain(rows, columns, planes.shape[:2], c)
    white, mean = level_of_white(raw, dng), mean_black(raw, dng, count)
    full = np.asarray((planes[..., :count] >= white).any(axis=2))
    return RawPixels(pixels, white - mean, mean, full, tuple(letters[:count]), (1,) * count)


def demosaiced(raw: rawpy.RawPy, method: str, dng: Dng) -> RawPixels:
    """Full size, by LibRaw's ``method``; below black is cut to 0, as LibRaw has it."""
    white, black = level_of_white(raw, dng), mean_black(raw, dng)
    stored = sites_of(raw, dng)
    full = stored >= white
    factor = 65535.0 / (white - black)
    levels: dict[str, Any] = levelled(raw, dng, stored) if dng.gains or dng.black else {}
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


def levelled(raw: rawpy.RawPy, dng: Dng, stored: np.ndarray) -> dict[str, Any]:
    """Take black from the mosaic as ``stored`` (h, w), multiply it by its gains, over the greatest of them, and put it
    in LibRaw's place over all of 16 bits; and the levels that LibRaw is to be told."""
    mosaic = raw.raw_image_visible
    height, width = mosaic.shape
    colours = raw.raw_colors_visible
    scale = FULL / (level_of_white(raw, dng) - mean_black(raw, dng)) / dng.most
    for y, x in np.ndindex(2, 2):
        rows, columns = np.arange(y, height, 2), np.arange(x, width, 2)
        black = black_at(raw, dng, rows, columns, int(colours[y, x]))
        light = (
            (stored[y::2, x::2].astype(np.float32) - black) * dng.gain(rows, columns, (height, width)) * scale
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
