"""A decoded photo as linear signal: 0 at black level, 1 at white level, exposure not yet divided out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from photogonio.capture.files.images import Image
from photogonio.capture.linear import kernel as pointwise
from photogonio.capture.linear.encoding import Encoding
from photogonio.capture.linear.noise import NoiseModel

Region = tuple[int, int, int, int]  # columns and rows [x0, x1) x [y0, y1)
WINDOW, MIDDLE = (
    7,
    3,
)  # pixels of a window's side, and its middle: a pixel's validity hangs on so many neighbours
HALF_STEP = 2.0**-11  # relative spacing of half floats, taken for all float files
ROWS = 128  # of half floats, widened together: they stay in the cache
FLOAT_FLOOR = 1e-14  # variance of a float's zero
HALF_VALUES = np.arange(1 << 16, dtype=np.uint16).view(np.float16).astype(np.float32)  # by their bits


@dataclass(frozen=True, slots=True)
class Signal:
    value: np.ndarray  # (h, w, c) float32
    variance: np.ndarray  # (h, w, c) float32, noise and quantisation
    saturated: np.ndarray  # (h, w) bool


@dataclass(frozen=True, slots=True)
class Windows:
    """Small windows about single pixels, laid under one another as one narrow picture (n * size, size).

    With the sizes as they are by default, ``picture[MIDDLE::WINDOW, MIDDLE]`` are the pixels themselves. All of a
    window must lie within the photo.
    """

    pixels: np.ndarray  # (n, 2) int columns and rows
    before: int = MIDDLE  # pixels of a window to the left and above
    after: int = MIDDLE  # and to the right and below

    def of(self, array: np.ndarray) -> np.ndarray:
        """The windows of an image (h, w, ...), a copy."""
        step = np.arange(-self.before, self.after + 1)
        rows = (self.pixels[:, 1, None] + step).reshape(-1, 1)
        return array[rows, np.repeat(self.pixels[:, 0, None] + step, len(step), axis=0)]


@dataclass(frozen=True, slots=True)
class Sensor:
    """How the camera's files stand for light."""

    encoding: Encoding
    noise: NoiseModel
    clip: float  # code, in file units, at and above which a pixel is full; infinite: never
    own_levels: bool = False  # the manifest gives black or white, also for RAW files
    full_scale: float = 0.0  # of the files that ``clip`` is of; 0: of all


def encoding_of(image: Image, sensor: Sensor) -> Encoding:
    """The set's, or the photo's own."""
    return sensor.encoding.own_of(image.tone)


def clip_of(image: Image, sensor: Sensor) -> float:
    """The code at and above which the photo is full, also where it has other bits than those that told."""
    if sensor.full_scale in (0.0, image.full_scale):
        return sensor.clip
    if image.pixels.dtype.kind != "u":
        return np.inf
    return min(sensor.clip * image.full_scale / sensor.full_scale, image.full_scale)


def cut(array: np.ndarray, region: Region | Windows | None) -> np.ndarray:
    """The region's part of an image, a view (of windows a copy); all of it without a region."""
    if region is None:
        return array
    if isinstance(region, Windows):
        return region.of(array)
    x0, y0, x1, y1 = region
    return array[y0:y1, x0:x1]


def part_of(signal: Signal, region: Region | Windows | None, step: int = 1) -> Signal:
    """The region's part of a signal, every ``step``-th row of it."""
    return Signal(*(cut(a, region)[::step] for a in (signal.value, signal.variance, signal.saturated)))


def signal_of(image: Image, sensor: Sensor, region: Region | Windows | None = None) -> Signal:
    """Signal, variance and saturation of a photo, or of a region of it."""
    if image.pixels.dtype == np.float16:
        image, region = widened_part(image, region), None
    pixels = cut(image.pixels, region)
    line = straight(image, sensor)
    steps: np.ndarray | float
    if line is not None:
        value, variance = line_signal(image, line, sensor.noise, region)
    elif pixels.dtype.kind == "u":
        values, steps = encoding_of(image, sensor).lookup(int(image.full_scale), pixels.shape[2])
        value, variance = look_up(pixels, values, sensor.noise.variance(values) + steps)
    else:
        value, steps = linear_signal(image, pixels, sensor)
        variance = sensor.noise.variance(value) + steps
    full = cut(image.saturated, region) if image.saturated is not None else None
    return Signal(value, variance, saturated(pixels, clip_of(image, sensor), full))


def widened(pixels: np.ndarray) -> np.ndarray:
    """Half floats (h, w, c) as float32; other numbers as they are."""
    if pixels.dtype != np.float16:
        return pixels
    result = np.empty(pixels.shape, np.float32)
    pointwise.widened(np.ascontiguousarray(pixels).view(np.uint16), HALF_VALUES, result)
    return result


def widened_part(image: Image, region: Region | Windows | None) -> Image:
    """The region of a photo of half floats, in float32."""
    full = None if image.saturated is None else cut(image.saturated, region)
    return replace(image, pixels=widened(cut(image.pixels, region)), saturated=full)


@dataclass(frozen=True, slots=True)
class Line:
    """``signal = scale * code + offset``; its quantisation variance ``floor + (step * signal)^2``."""

    scale: float
    offset: float
    floor: float
    step: float = 0.0


def straight(image: Image, sensor: Sensor) -> Line | None:
    """From codes to signal where that is a straight line; None where it is a curve."""
    encoding = encoding_of(image, sensor)
    if image.raw and not sensor.own_levels:
        return Line(1.0 / image.full_scale, 0.0, 1.0 / image.full_scale**2 / 12)
    if not encoding.straight:
        return None
    full, black = image.full_scale + image.black, image.black / (image.full_scale + image.black)
    scale = 1.0 / (encoding.white - encoding.black)
    offset = (black - encoding.black) * scale
    if image.pixels.dtype.kind == "u" or image.raw:
        return Line(scale / full, offset, (scale / full) ** 2 / 12)
    return Line(scale / full, offset, FLOAT_FLOOR, HALF_STEP / np.sqrt(12.0))


def line_signal(
    image: Image, line: Line, noise: NoiseModel, region: Region | Windows | None
) -> tuple[np.ndarray, np.ndarray]:
    """Signal and variance, (h, w, c) float32 each, of a photo or a region of it, in one pass."""
    pixels, channels = image.pixels, image.pixels.shape[2]
    if isinstance(region, Windows):
        pixels, region = region.of(pixels), None
    x0, y0, x1, y1 = region or (0, 0, pixels.shape[1], pixels.shape[0])
    top, left = y0, x0 * channels
    if not pixels.flags.c_contiguous:
        pixels, top, left = np.ascontiguousarray(cut(pixels, region)), 0, 0
    shape = (y1 - y0, (x1 - x0) * channels)
    value, variance = np.empty(shape, np.float32), np.empty(shape, np.float32)
    slope, read = (
        np.tile(part.astype(np.float32), x1 - x0) for part in (noise.slope, noise.read + line.floor)
    )
    scale, offset, step = (np.float32(part) for part in (line.scale, line.offset, line.step))
    codes = pixels.reshape(len(pixels), -1)
    pointwise.scaled(codes, top, left, scale, offset, slope, read, step, value, variance)
    return value.reshape(y1 - y0, x1 - x0, channels), variance.reshape(y1 - y0, x1 - x0, channels)


def mean_level(
    image: Image, sensor: Sensor, factor: float, region: Region | None = None
) -> tuple[np.ndarray, np.ndarray] | None:
    """Mean over channels (h, w) of the signal of a photo, or a region of it, over ``factor``, and where it is not
    saturated (h, w) bool, in one pass; None where the codes of floats are a curve."""
    pixels, line = np.ascontiguousarray(cut(image.pixels, region)), straight(image, sensor)
    if line is None and pixels.dtype.kind != "u":
        return None
    level, usable = np.empty(pixels.shape[:2], np.float32), np.empty(pixels.shape[:2], bool)
    rows = ROWS if pixels.dtype == np.float16 else len(pixels)
    for first in range(0, len(pixels), rows):
        band = slice(first, first + rows)
        own = replace(sensor, encoding=encoding_of(image, sensor), clip=clip_of(image, sensor))
        _fill_level(widened(pixels[band]), line, own, image.full_scale, factor, level[band], usable[band])
    if image.saturated is not None:
        usable &= ~cut(image.saturated, region)
    return level, usable


def _fill_level(
    pixels: np.ndarray,
    line: Line | None,
    sensor: Sensor,
    full_scale: float,
    factor: float,
    level: np.ndarray,
    usable: np.ndarray,
) -> None:
    clip: np.integer | np.floating
    if pixels.dtype.kind == "u":
        clip = np.int64(min(np.ceil(sensor.clip), np.iinfo(pixels.dtype).max + 1))
    else:
        clip = np.float32(sensor.clip)
    if line is not None:
        scale, offset = np.float32(line.scale / factor), np.float32(line.offset / factor)
        pointwise.line_level(pixels, scale, offset, clip, level, usable)
    else:
        values = sensor.encoding.lookup(int(full_scale), pixels.shape[2])[0]
        pointwise.table_level(pixels, values / np.float32(factor * pixels.shape[2]), clip, level, usable)


def saturated(pixels: np.ndarray, clip: float, known: np.ndarray | None) -> np.ndarray:
    """Pixels (h, w) some channel of which is at or above ``clip``, or known from the mosaic."""
    result = np.zeros(pixels.shape[:2], bool) if known is None else known.copy()
    if np.isfinite(clip):
        pointwise.full(
            np.ascontiguousarray(pixels), np.float32(clip) if pixels.dtype.kind == "f" else clip, result
        )
    return result


def linear_signal(image: Image, pixels: np.ndarray, sensor: Sensor) -> tuple[np.ndarray, np.ndarray | float]:
    """Signal (h, w, c) float32 of pixels, and the variance that quantisation adds."""
    channels = pixels.shape[2]
    encoding = encoding_of(image, sensor)
    line = straight(image, sensor)
    if line is not None:
        value = pixels.astype(np.float32)
        value *= np.float32(line.scale)
        value += np.float32(line.offset)
        if line.step == 0.0:
            return value, np.asarray(line.floor, np.float32)
        return value, np.float32(line.floor) + np.square(value * np.float32(line.step))
    if pixels.dtype.kind == "u":
        return look_up(pixels, *encoding.lookup(int(image.full_scale), channels))
    value = encoding.linear(pixels, channels).astype(np.float32)
    return value, float_steps(value)


def float_steps(value: np.ndarray) -> np.ndarray:
    """Quantisation variance of half floats."""
    return np.square(value * np.float32(HALF_STEP)) / np.float32(12) + np.float32(FLOAT_FLOOR)


def look_up(pixels: np.ndarray, value: np.ndarray, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both tables (codes, c) at the codes of pixels (h, w, c)."""
    shape = pixels.shape
    if pixels.dtype == np.uint8:
        return cv2.LUT(pixels, value[:, None]).reshape(shape), cv2.LUT(pixels, variance[:, None]).reshape(
            shape
        )
    found = np.empty(shape, np.float32), np.empty(shape, np.float32)
    for c in range(shape[2]):
        found[0][..., c] = value[:, c][pixels[..., c]]
        found[1][..., c] = variance[:, c][pixels[..., c]]
    return found


def grown(mask: np.ndarray) -> np.ndarray:
    """A mask with the eight neighbours of its pixels.

    Beside a saturated pixel, charge spills over; and where noise lifts some of an even area above the
    clipping level, those that stay below are the low ones.
    """
    return cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8)).astype(bool)
