"""Linear pixels from an opened camera RAW: superpixels of the mosaic, or a demosaic method that LibRaw names.

No curve, no white balance, no colour matrix, no automatic brightness: black and white level are the file's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import rawpy

METHODS = {
    "linear": rawpy.DemosaicAlgorithm.LINEAR,
    "vng": rawpy.DemosaicAlgorithm.VNG,
    "ppg": rawpy.DemosaicAlgorithm.PPG,
    "ahd": rawpy.DemosaicAlgorithm.AHD,
    "dht": rawpy.DemosaicAlgorithm.DHT,
}


@dataclass(frozen=True, slots=True)
class RawPixels:
    pixels: np.ndarray  # (h, w, c) float32, sensor units above black
    white: float  # sensor units above black at which a site is full
    black: float  # the file's black level, in the same units
    saturated: np.ndarray  # (h, w) bool
    channels: tuple[str, ...]
    sites: tuple[int, ...]  # sensor sites averaged in each channel


def mosaic_colours(raw: rawpy.RawPy) -> np.ndarray:
    """The 2 x 2 colour indices at the visible corner. Raises ValueError for another mosaic."""
    if raw.raw_type != rawpy.RawType.Flat or raw.raw_pattern is None or raw.raw_pattern.shape != (2, 2):
        raise ValueError('has no 2 x 2 mosaic; set [radiometry] demosaic = "linear"')
    return np.array(raw.raw_colors_visible[:2, :2])


def superpixels(raw: rawpy.RawPy) -> RawPixels:
    """Each 2 x 2 cell of the mosaic as one pixel, the two greens averaged: half the size, no interpolation.

    Red and blue sites lie a quarter of a superpixel on either side of the pixel's centre.
    """
    colours = mosaic_colours(raw)
    letters = np.array(list(raw.color_desc.decode()))[colours]
    channels = tuple(name for name in "RGBCMYE" if name in letters)
    mosaic = raw.raw_image_visible
    height, width = mosaic.shape[0] // 2, mosaic.shape[1] // 2
    pixels = np.zeros((height, width, len(channels)), np.float32)
    saturated = np.zeros((height, width), bool)
    white = white_level(raw)
    sites = [int((letters == name).sum()) for name in channels]
    for y, x in np.ndindex(2, 2):
        plane = mosaic[y : 2 * height : 2, x : 2 * width : 2]
        c = channels.index(letters[y, x])
        black = raw.black_level_per_channel[colours[y, x]]
        pixels[..., c] += (plane.astype(np.float32) - np.float32(black)) / sites[c]
        saturated |= plane >= white
    mean = float(np.mean(raw.black_level_per_channel))
    return RawPixels(pixels, white - mean, mean, saturated, channels, tuple(sites))


def demosaiced(raw: rawpy.RawPy, method: str) -> RawPixels:
    """Full size, by LibRaw's ``method``; below black is cut to 0, as LibRaw has it."""
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
    )
    mosaic = raw.raw_image_visible
    full = mosaic >= white_level(raw)
    saturated = full if full.ndim == 2 else full.any(axis=2)
    channels = tuple("RGB"[: pixels.shape[2]])
    black = float(np.mean(raw.black_level_per_channel))
    black *= 65535.0 / (white_level(raw) - black)
    return RawPixels(pixels.astype(np.float32), 65535.0, black, saturated, channels, (1,) * len(channels))


def white_level(raw: rawpy.RawPy) -> float:
    """The level, in file units, at which the first channel is full."""
    levels = [level for level in raw.camera_white_level_per_channel or [] if level > 0]
    return float(min([raw.white_level, *levels]))


def size(raw: rawpy.RawPy, demosaic: str) -> tuple[int, int]:
    """Width and height of the pixels that will be decoded."""
    width, height = raw.sizes.width, raw.sizes.height
    return (width // 2, height // 2) if demosaic == "superpixel" else (width, height)


def exif(raw: rawpy.RawPy) -> dict[str, float]:
    """Exposure in EXIF's words; LibRaw gives 1 s at f/1 where it knows nothing: the ISO is then 0."""
    other = raw.other
    if not other.iso_speed > 0:
        return {}
    return {
        "ExposureTime": other.shutter_speed,
        "FNumber": other.aperture,
        "Exif:PhotographicSensitivity": other.iso_speed,
    }
