"""Directions as people give them to a BRDF: broadcast and checked, or refused in one line."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from photogonio.capture.errors import InputError

_SQUARES = 1e-200, 1e200  # of lengths: between them products of two vectors are as they should be


def checked_directions(incident: ArrayLike, exit: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Vectors (..., 3) of any length, which need not broadcast but in their leading axes; NaN for those that are no
    direction: not finite, or of no length.

    Raises:
        InputError: they are no such vectors, or do not broadcast together.
    """
    given = {"incident": _numbers("incident", incident), "exit": _numbers("exit", exit)}
    for name, vectors in given.items():
        if vectors.ndim == 0 or vectors.shape[-1] != 3:
            raise InputError(name, f"vectors (..., 3) are needed, not an array of shape {vectors.shape}")
    _broadcast({name: vectors.shape[:-1] for name, vectors in given.items()})
    return _told(given["incident"]), _told(given["exit"])


def checked_angles(**given: ArrayLike) -> list[np.ndarray]:
    """Angles as arrays that broadcast together.

    Raises:
        InputError: they are no numbers, or do not broadcast together.
    """
    angles = {name: _numbers(name, one) for name, one in given.items()}
    _broadcast({name: one.shape for name, one in angles.items()})
    return list(angles.values())


def _numbers(name: str, given: ArrayLike) -> np.ndarray:
    try:
        if np.iscomplexobj(given):  # whose imaginary part would be dropped
            raise TypeError
        return np.asarray(given, float)
    except (TypeError, ValueError):
        raise InputError(name, f"numbers are needed, not {given!r:.60}".replace("\n", " ")) from None


def _broadcast(shapes: dict[str, tuple[int, ...]]) -> None:
    try:
        np.broadcast_shapes(*shapes.values())
    except ValueError:
        said = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise InputError(" and ".join(shapes), f"shapes that go together are needed, not {said}") from None


def _told(vectors: np.ndarray) -> np.ndarray:
    square = np.einsum("...k,...k->...", vectors, vectors)
    if not ((square <= _SQUARES[0]) | (square >= _SQUARES[1]) | np.isnan(square)).any():
        return vectors
    largest = np.abs(vectors).max(axis=-1, keepdims=True)  # over it, squares neither vanish nor overflow
    wrong = ~((largest > 0.0) & (largest < np.inf))
    scaled = vectors / np.where(wrong, 1.0, largest)
    return np.where(wrong, np.nan, scaled)
