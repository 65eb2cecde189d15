"""Noise against level: ``variance = read + slope * signal``, as given or estimated from the photos.

Estimation: in each block of 8 x 8 pixels the differences ``(a - b - c + d) / 2`` of interleaved pixels two
apart are free of any gradient and, for white noise, independent: their mean square over the variance is
chi-squared with 16 degrees of freedom over 16. Blocks are sorted by level; a low quantile of each bin,
divided by that of the law, is unmoved by the blocks that hold texture or edges. After Liu et al.,
"Automatic estimation and removal of noise from a single image", IEEE PAMI 2008 (the lower envelope), with
the quantile in place of their likelihood.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from photogonio.capture.photoset import Radiometry

BLOCK = 8
DEGREES = 16  # independent differences in a block
QUANTILE = 0.2
LEAST_BLOCKS = 40  # in a bin of levels
BINS = 24
ROUNDS = 3
AT_ONCE = 2  # photos: numpy releases the interpreter
TOLERATED = 0.1  # relative excess of a bin beyond its error
TINY = 1e-30
HALF = 0.25  # by which half zeros are a half
MAXIMUM_LEVEL = 0.9  # of white: above it clipping narrows the noise


@dataclass(frozen=True, slots=True)
class NoiseModel:
    """Variance of linear signal (1 at white level) before exposure is divided out, without quantisation."""

    read: np.ndarray  # (c,)
    slope: np.ndarray  # (c,)
    source: str = "given"  # "given" | "estimated" | "assumed"
    black: np.ndarray | None = (
        None  # (c,) at least, of black that codes cut off at 0, where that was estimated
    )

    def variance(self, signal: np.ndarray) -> np.ndarray:
        """(..., c), of signals (..., c); a signal below black has read noise alone."""
        result = np.maximum(signal, 0.0)
        # many pixels at once: arithmetic along an axis of three is slow
        lines = result.reshape(-1, result.shape[-1] * (result.shape[-2] if result.ndim > 1 else 1))
        pixels = lines.shape[1] // len(self.slope)
        lines *= np.tile(self.slope.astype(result.dtype), pixels)
        lines += np.tile(self.read.astype(result.dtype), pixels)
        return lines.reshape(signal.shape)


def given_noise(radiometry: Radiometry, channels: int, sites: Sequence[int] = ()) -> NoiseModel | None:
    """From gain and read noise in electrons; None if the manifest does not say.

    A channel averaged over several sensor sites (a RAW superpixel's green) has that much less of both.
    """
    if radiometry.gain_electrons is None:
        return None
    gain, read = radiometry.gain_electrons, radiometry.read_noise_electrons or 0.0
    averaged = np.array(sites if sites else [1] * channels, float)
    return NoiseModel((read / gain) ** 2 / averaged, 1 / gain / averaged, "given")


def block_statistics(signal: np.ndarray, usable: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean level and noise variance, (n,) each, of the 8 x 8 blocks of one channel that are usable
    throughout.

    ``signal`` and ``usable`` are (h, w).
    """
    height, width = (size // BLOCK * BLOCK for size in signal.shape)
    tiles = signal[:height, :width].reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK)
    whole = usable[:height, :width].reshape(tiles.shape).all(axis=(1, 3))
    level = tiles.mean(axis=(1, 3), dtype=np.float64)
    quads = tiles.reshape(height // BLOCK, 2, 2, 2, width // BLOCK, 2, 2, 2)
    first, second = quads[:, :, 0], quads[:, :, 1]  # rows two apart; then columns two apart on axis -2
    difference = 0.5 * (first[..., 0, :] - first[..., 1, :] - second[..., 0, :] + second[..., 1, :])
    variance = np.square(difference, dtype=np.float64).mean(axis=(1, 2, 4, 5))
    return level[whole], variance[whole]


@dataclass(frozen=True, slots=True)
class Blocks:
    """Blocks of 8 x 8 pixels, or bins of them."""

    level: np.ndarray  # (n,) mean signal
    variance: np.ndarray  # (n,) noise and quantisation
    quantisation: np.ndarray  # (n,) the part of it that codes explain
    count: np.ndarray  # (n,) blocks


def envelope(blocks: Blocks, expected: np.ndarray) -> Blocks:
    """Bins of equal numbers of blocks, by level, each with the variance of its calm ones.

    The quantile is taken of the ratio to the ``expected`` variances (n,), so that a bin's spread of levels
    does not widen it.
    """
    from scipy.special import chdtri

    order = np.argsort(blocks.level, kind="stable")
    bins = np.array_split(order, max(1, min(BINS, len(order) // LEAST_BLOCKS)))
    correction = chdtri(DEGREES, 1.0 - QUANTILE) / DEGREES
    ratio = blocks.variance / expected
    variance = [np.quantile(ratio[b], QUANTILE) * expected[b].mean() / correction for b in bins]
    level = [blocks.level[b].mean() for b in bins]
    quantisation = [blocks.quantisation[b].mean() for b in bins]
    return Blocks(*map(np.array, (level, variance, quantisation, [len(b) for b in bins])))


def fit_noise(bins: Blocks) -> tuple[float, float]:
    """Read variance and slope, neither negative, of binned variances less quantisation.

    A variance's own error is proportional to it, so residuals are relative; bins above the line by more than
    three errors (texture everywhere in them) are given up one by one.
    """
    from scipy.optimize import nnls  # only here: it takes half a second to be brought in

    level = np.maximum(bins.level, 0.0)
    total = np.maximum(bins.variance, TINY)
    # relative error of a bin: the low quantile's is about 1.3 times that of the mean square
    error = 1.3 * np.sqrt(2 / DEGREES / bins.count)
    kept = np.ones(len(level), bool)
    while True:
        scale = 1 / (total * error)[kept]
        design = np.column_stack([np.ones(kept.sum()), level[kept]]) * scale[:, None]
        (read, slope), _ = nnls(design, (bins.variance - bins.quantisation)[kept] * scale)
        model = np.maximum(read + slope * level + bins.quantisation, TINY)
        excess = np.where(kept, total / model - 1 - 3 * error, -np.inf)
        worst = int(np.argmax(excess))
        if kept.sum() <= 3 or excess[worst] < TOLERATED:
            return float(read), float(slope)
        kept[worst] = False


def estimate_noise(photos: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> NoiseModel | None:
    """From several photos of one camera: (signal (h, w, c), quantisation variance (h, w, c), usable (h, w)).

    None if too few blocks are usable. What quantisation explains is taken off. Photos are looked at side by side.
    """
    channels = photos[0][0].shape[2]
    reads, slopes = np.zeros(channels), np.zeros(channels)
    with ThreadPoolExecutor(AT_ONCE) as pool:
        found = list(pool.map(lambda photo: photo_blocks(*photo), photos))
    for c in range(channels):
        blocks = joined([one[c] for one in found])
        if len(blocks.level) < LEAST_BLOCKS:
            return None
        expected = np.ones_like(blocks.level)
        for _ in range(ROUNDS):
            reads[c], slopes[c] = fit_noise(envelope(blocks, expected))
            model = reads[c] + slopes[c] * np.maximum(blocks.level, 0.0) + blocks.quantisation
            expected = np.maximum(model, TINY)
    black = np.max([cut_off(signal) for signal, *_ in photos], axis=0)
    return NoiseModel(reads, slopes, "estimated", black if black.any() else None)


def cut_off(signal: np.ndarray) -> np.ndarray:
    """Variance (c,) of black of which codes cut off at 0 all noise below it, by what is left above; 0 of other black.

    Blocks of it are half zeros; what codes leave of their noise is less, and differs less, than the noise.
    """
    found = np.zeros(signal.shape[2])
    height, width = (size // BLOCK * BLOCK for size in signal.shape[:2])
    for c in range(len(found)):
        tiles = signal[:height, :width, c].reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK)
        zeros = (tiles == 0.0).mean(axis=(1, 3))
        half = np.abs(zeros - 0.5) < HALF
        if tiles.min(initial=0.0) >= 0.0 and half.sum() > max(LEAST_BLOCKS, 0.5 * (zeros > 0.0).sum()):
            found[c] = 2.0 * float(np.median(np.square(tiles, dtype=np.float64).mean(axis=(1, 3))[half]))
    return found


def photo_blocks(signal: np.ndarray, quantisation: np.ndarray, usable: np.ndarray) -> list[Blocks]:
    """All usable blocks of a photo, (h, w, c) twice and (h, w), by channel."""
    found = []
    for c in range(signal.shape[2]):
        good = usable & (signal[..., c] < MAXIMUM_LEVEL)
        level, variance = block_statistics(signal[..., c], good)
        codes = block_statistics(quantisation[..., c], good)[0]
        found.append(Blocks(level, variance, codes, np.ones(len(level))))
    return found


def joined(parts: Sequence[Blocks]) -> Blocks:
    """The blocks of several photos, one after another."""
    names = ("level", "variance", "quantisation", "count")
    return Blocks(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))
