"""Dark frames and flat fields, from the photos of those roles."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import cv2
import numpy as np
from scipy.interpolate import RectBivariateSpline

from photogonio.capture import robust
from photogonio.capture.files.exposure import Exposure
from photogonio.capture.linear.signal import Region, Signal, Windows, cut

SAME_TIME = 0.01  # relative difference of exposure times that counts as none
HOT_SCATTERS = 10.0  # robust standard deviations of the dark frame
HOT_LEAST = 0.002  # of white level
BLOCKS, BLOCK = 32, 8  # along the longer side, in which a dark frame is looked over; pixels of one at least
LIT_SPREAD = (
    0.02  # of white level, between a dark frame's dim and bright tenths: glow fills corners, heat is even
)
LIT = 0.15  # of white level; cameras write black at an eighth of it at most
FLAT_NOISE = 1e-3  # relative noise that a flat field may keep
WIDEST_BLUR = 0.02  # of the picture's width
LEAST_FLAT = 0.02  # of the centre; darker is no light
CENTRE = 0.1  # of width and height, the part of a flat field that counts as 1
GRID = 129  # knots of the cos^4 field along each side


class Rays(Protocol):
    """What cos^4 needs of a camera (photogonio.calib.geometry.camera.Camera)."""

    @property
    def size(self) -> tuple[int, int]: ...

    def rays(self, pixels: np.ndarray) -> np.ndarray: ...


class Aside(Protocol):
    """What a falloff needs of one."""

    @property
    def size(self) -> tuple[int, int]: ...

    def aside(self, pixels: np.ndarray) -> np.ndarray: ...


@dataclass(frozen=True, slots=True)
class Dark:
    """Signal without light: ``bias + rate * exposure_time``."""

    bias: np.ndarray  # (h, w, c) float32
    rate: np.ndarray | None  # (h, w, c) float32 per second
    variance: np.ndarray  # (h, w, c) float32
    hot: np.ndarray  # (h, w) bool

    def at(self, time: float | None, region: Region | Windows | None) -> np.ndarray:
        """Dark signal of an exposure time."""
        if self.rate is None or time is None:
            return cut(self.bias, region)
        return cut(self.bias, region) + np.float32(time) * cut(self.rate, region)


class MeasuredLight(Protocol):
    """A signal, or a radiance."""

    @property
    def value(self) -> np.ndarray: ...

    @property
    def variance(self) -> np.ndarray: ...


def mean_signal(signals: Sequence[MeasuredLight]) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance of the mean, (h, w, c) float32 each."""
    value = np.mean([signal.value for signal in signals], axis=0, dtype=np.float32)
    variance = np.sum([signal.variance for signal in signals], axis=0, dtype=np.float32)
    return np.asarray(value), np.asarray(variance) / np.float32(len(signals) ** 2)


def dark_of(signals: Sequence[Signal], exposures: Sequence[Exposure], *, black_known: bool) -> Dark:
    """The dark signal from frames taken with the lens capped.

    Frames of several exposure times give bias and rate by least squares in each pixel. Frames of one time,
    with the black level known, give a rate alone; without it, the dark signal is taken as the same for all
    times.
    """
    value, variance = mean_signal(signals)
    bias, rate = value, None
    times = [exposure.exposure_time for exposure in exposures if exposure.exposure_time is not None]
    if len(times) == len(exposures):
        spread = np.array(times, np.float32) - np.float32(np.mean(times))
        if np.ptp(times) > SAME_TIME * max(times):
            rate = sum(t * signal.value for t, signal in zip(spread, signals, strict=True)) / (
                spread @ spread
            )
            bias = value - np.float32(np.mean(times)) * rate
        elif black_known:
            rate, bias = value / np.float32(np.mean(times)), np.zeros_like(value)
    return Dark(bias, rate, variance, hot_pixels(value))


def is_lit(dark: np.ndarray) -> bool:
    """Whether a signal (h, w, c) that is to be dark holds a picture: its parts differ, or all of it is bright."""
    height, width = dark.shape[:2]
    block = max(BLOCK, -(-max(height, width) // BLOCKS))
    size = (max(1, width // block), max(1, height // block))
    parts = cv2.resize(np.nan_to_num(dark.mean(axis=2)), size, interpolation=cv2.INTER_AREA)
    dim, middle, bright = np.percentile(parts, (10.0, 50.0, 90.0))
    return bool(bright - dim > LIT_SPREAD or middle > LIT)


def hot_pixels(dark: np.ndarray) -> np.ndarray:
    """Pixels (h, w) of a dark frame (h, w, c) far from its median in some channel."""
    off = np.abs(dark - np.median(dark, axis=(0, 1)))
    scatter = robust.deviation(off, axis=(0, 1))
    return (off > np.maximum(HOT_SCATTERS * scatter, HOT_LEAST)).any(axis=2)


def flat_gain(value: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """What to multiply by, (h, w, c) float32, from the mean of flat-field photos; 1 at the picture's centre.

    Blurred by as much as leaves FLAT_NOISE of the photos' noise: a Gaussian of sigma pixels divides white
    noise by ``2 sqrt(pi) sigma``. Raises ValueError if some part of the field is dark.
    """
    height, width, channels = value.shape
    noise = float(np.sqrt(np.median(variance)) / max(float(np.median(value)), 1e-12))
    sigma = min(noise / (2 * np.sqrt(np.pi) * FLAT_NOISE), WIDEST_BLUR * width)
    blurred = cv2.GaussianBlur(value, (0, 0), sigma, borderType=cv2.BORDER_REFLECT) if sigma > 0.3 else value
    blurred = blurred.reshape(height, width, channels)
    dy, dx = max(1, int(CENTRE * height / 2)), max(1, int(CENTRE * width / 2))
    y, x = height // 2, width // 2
    centre = blurred[max(y - dy, 0) : y + dy, max(x - dx, 0) : x + dx].mean(axis=(0, 1))
    relative = blurred / centre
    if not np.all(centre > 0) or not relative.min() > LEAST_FLAT:
        raise ValueError(f"the flat field falls below {LEAST_FLAT:g} of its centre")
    return (1.0 / relative).astype(np.float32)


def falloff_gain(camera: Aside, terms: Iterable[float]) -> np.ndarray:
    """What to multiply by, (h, w, 1) float32, against a lens that leaves exp(terms[0] a + terms[1] a^2 + ...) of the
    light at ``a`` of ``camera.aside``. Rows at a time: no picture of doubles is in memory."""
    width, height = camera.size
    gain = np.empty((height, width, 1), np.float32)
    across = np.arange(width)
    for y in range(height):
        aside = camera.aside(np.column_stack([across, np.full(width, y)]))
        gain[y, :, 0] = np.exp(-sum(term * aside ** (k + 1) for k, term in enumerate(terms)))
    return gain


def cos4_gain(camera: Rays) -> np.ndarray:
    """What to multiply by, (h, w, 1) float32, against the cos^4 law of a thin lens's irradiance off axis.

    Exact on a grid of knots, a cubic spline between (the field is smooth).
    """
    width, height = camera.size
    x, y = np.linspace(0, width - 1, GRID), np.linspace(0, height - 1, GRID)
    pixels = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    cosine = camera.rays(pixels)[:, 2].reshape(GRID, GRID)
    spline = RectBivariateSpline(y, x, cosine**-4.0)
    return spline(np.arange(height), np.arange(width)).astype(np.float32)[..., None]
