"""Statistics that wild values do not sway: what medians tell of errors that are normal but for some."""

from __future__ import annotations

from typing import Any

import numpy as np

OF_SIZE = 1.4826  # standard deviation over the median of the sizes
OF_MEDIAN = 1.2533  # standard error of a median over that of a mean


def deviation(
    misses: np.ndarray, axis: int | tuple[int, ...] | None = None, *, keepdims: bool = False
) -> Any:
    """Standard deviation of ``misses`` about 0, as the middle one has it; of all of them, or along an axis."""
    sizes = np.abs(misses)
    if axis is None and not keepdims:
        return OF_SIZE * median(sizes)
    return OF_SIZE * np.median(sizes, axis=axis, keepdims=keepdims)


def median(values: np.ndarray) -> np.floating:
    """numpy's of all ``values``, NaN if any is: a third of its time where there are some hundreds, as in each step of a
    fit."""
    flat = np.ravel(values)
    flat = flat if flat.dtype.kind == "f" else flat.astype(float)
    if not flat.size or np.isnan(flat.max()):
        return np.float64(np.nan)
    half = flat.size // 2
    if flat.size % 2:
        return np.partition(flat, half)[half]
    low, high = np.partition(flat, (half - 1, half))[half - 1 : half + 1]
    return 0.5 * (low + high)


def scatter(values: np.ndarray, axis: int | None = None) -> Any:
    """Standard deviation of ``values`` about their median."""
    return deviation(values - np.median(values, axis=axis), axis)


def median_error(spread: Any, count: int) -> Any:
    """Standard error of the median of ``count`` values whose standard deviation is ``spread``."""
    return OF_MEDIAN * spread / np.sqrt(count)


def rooted_cauchy(residual: np.ndarray, scale: float) -> np.ndarray:
    """Residuals in standard errors whose squares are Cauchy's loss: beyond ``scale`` they grow like a logarithm."""
    return np.sign(residual) * scale * np.sqrt(np.log1p((residual / scale) ** 2))


def tukey_weight(residual: np.ndarray, bound: np.ndarray | float) -> np.ndarray:
    """Weights, 1 at no residual and 0 from ``bound`` on, whose squares are those of Tukey's loss."""
    share = residual / bound  # the one array of it: each step of a fit asks for many of them
    share *= share
    np.minimum(share, 1.0, out=share)
    return np.subtract(1.0, share, out=share)
