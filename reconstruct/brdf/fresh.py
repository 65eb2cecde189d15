"""How far a fresh reading may lie from f, as the coefficient file's ``fit`` tells it of measured rows."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

KEY = "fresh reading"
STEEPEST = np.radians(85.0)  # beyond, errors of angles and areas grow no more
_NAMES = ("constant", "relative", "grazing")


def fresh_deviation(
    fit: dict[str, Any], value: np.ndarray, error: np.ndarray, theta_i: ArrayLike, theta_r: ArrayLike
) -> np.ndarray:
    """Standard deviation (..., c) of a reading where f is ``value`` and its standard error ``error`` (..., c), 1/sr;
    NaN where ``fit`` does not tell. Angles in radians."""
    known = fit.get(KEY)
    if not isinstance(known, dict):
        return np.full_like(value, np.nan)
    constant, relative, grazing = (np.array(known["noise"][name], float) for name in _NAMES)
    far = steepness(np.maximum(theta_i, theta_r))[..., None]
    noise = constant**2 + (relative * value) ** 2 + (grazing * far * value) ** 2
    return np.array(known["widened"], float) * np.sqrt(error**2 + noise)


def fresh_fault(fit: dict[str, Any], channels: int) -> str | None:
    """What is wrong with what ``fit`` tells of readings; None if nothing is, or it tells nothing."""
    known = fit.get(KEY)
    if known is None:
        return None
    try:
        rows = [*(known["noise"][name] for name in _NAMES), known["widened"]]
        right = np.shape(rows) == (4, channels) and bool((np.array(rows, float) >= 0).all())
    except (KeyError, TypeError, ValueError):
        right = False
    return (
        None if right else f"needs noise ({', '.join(_NAMES)}) and widened, a number of 0 or more a channel"
    )


def steepness(theta: ArrayLike) -> np.ndarray:
    """How far a direction is from the normal: 1 / cos - 1, up to :data:`STEEPEST`; angles in radians."""
    return 1.0 / np.cos(np.minimum(theta, STEEPEST)) - 1.0


def fresh_only(fit: dict[str, Any], channels: list[int]) -> dict[str, Any]:
    """What ``fit`` tells of readings, of some channels alone."""
    known = fit.get(KEY)
    if not isinstance(known, dict):
        return {}
    noise = {name: [known["noise"][name][k] for k in channels] for name in _NAMES}
    return {KEY: {"noise": noise, "widened": [known["widened"][k] for k in channels]}}
