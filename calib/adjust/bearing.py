"""A place as it is seen from another: its direction, and one over its distance.

What light and shadows tell of a lamp is a straight line in these, however far it stands; of its place only near by.
(Montiel, Civera and Davison, "Unified inverse depth parametrization for monocular SLAM", 2006.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_BESIDE = 0.1  # of its distance: a place that is no farther toward where it was stands at a right angle to it
_FARTHEST = 1e3  # of its distance: as good as infinitely far


@dataclass(frozen=True, slots=True)
class Bearing:
    """Places (3,) seen from ``middle`` (3,), in lengths at ``at`` (3,), near which they are the places themselves."""

    middle: np.ndarray
    at: np.ndarray

    def seen(self, place: np.ndarray) -> np.ndarray:
        far, toward, ahead, across = self._taken_apart(place)
        return self.at + far / ahead * across + far * (1 - far / ahead) * toward

    def by_place(self, place: np.ndarray) -> np.ndarray:
        """Derivative (3, 3) of :meth:`seen`."""
        far, toward, ahead, across = self._taken_apart(place)
        return far / ahead * (np.eye(3) + np.outer((far / ahead - 1) * toward - across / ahead, toward))

    def place(self, seen: np.ndarray) -> np.ndarray:
        """Inverse of :meth:`seen`; what is seen beyond infinity is as good as infinitely far."""
        far, toward = self._axis()
        moved = seen - self.at
        along = float(moved @ toward)
        return self.middle + self._reach(along) * (toward + (moved - along * toward) / far)

    def by_seen(self, seen: np.ndarray) -> np.ndarray:
        """Derivative (3, 3) of :meth:`place`."""
        far, toward = self._axis()
        moved = seen - self.at
        along = float(moved @ toward)
        ahead = self._reach(along)
        way = toward + (moved - along * toward) / far
        across = np.eye(3) - np.outer(toward, toward)
        return ahead / far * across + (ahead / far) ** 2 * np.outer(way, toward)

    def _reach(self, along: float) -> float:
        far = self._axis()[0]
        return far / max(1 - along / far, 1 / _FARTHEST)

    def _axis(self) -> tuple[float, np.ndarray]:
        offset = self.at - self.middle
        far = float(np.linalg.norm(offset))
        return far, offset / far

    def _taken_apart(self, place: np.ndarray) -> tuple[float, np.ndarray, float, np.ndarray]:
        far, toward = self._axis()
        seen = place - self.middle
        along = float(seen @ toward)
        return far, toward, max(along, _BESIDE * far), seen - along * toward
