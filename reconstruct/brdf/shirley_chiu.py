"""Shirley and Chiu's map between the unit disk and the unit square: equal areas stay equal.

Shirley & Chiu, "A low distortion map between disk and square" (Journal of Graphics Tools 2, 1997).
"""

from __future__ import annotations

import numpy as np


def disk_to_square(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shirley and Chiu's concentric map of the unit disk on the unit square; inverse of :func:`square_to_disk`."""
    radius, phi = np.hypot(x, y), np.arctan2(y, x)
    phi = np.where(phi < -np.pi / 4, phi + 2 * np.pi, phi)
    quarter = np.clip(np.floor((phi + np.pi / 4) / (np.pi / 2)).astype(int), 0, 3)
    across = (phi - quarter * np.pi / 2) * radius / (np.pi / 4)
    a = np.choose(quarter, [radius, -across, -radius, across])
    b = np.choose(quarter, [across, radius, -across, -radius])
    return (a + 1) / 2, (b + 1) / 2


def square_to_disk(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Inverse of :func:`disk_to_square`."""
    a, b = 2 * np.asarray(a, float) - 1, 2 * np.asarray(b, float) - 1
    wide = np.abs(a) >= np.abs(b)
    radius = np.where(wide, a, b)
    safe = np.where(radius == 0, 1.0, radius)
    phi = np.where(wide, b / safe * np.pi / 4, np.pi / 2 - a / safe * np.pi / 4)
    return radius * np.cos(phi), radius * np.sin(phi)
