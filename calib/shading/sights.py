"""What highlights in mirror balls say of a lamp while its shading is fitted: where the paper tells little, as of a sun
whose small balls throw short shadows, they keep the fit from sliding along what fits as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from photogonio.calib.detect.mirror_rays import MirroredRay

_BALLS = 0.02  # radians: by balls' places, known to a hundredth of their radius
_TUKEY = 5.0  # standard errors beyond which a highlight is something else


@dataclass(frozen=True, slots=True)
class Sights:
    """Rays toward one lamp; each counts for as much as a few samples of paper, and no more."""

    origin: np.ndarray  # (k, 3)
    toward: np.ndarray  # (k, 3) unit
    spread: np.ndarray  # (k,) standard errors, radians

    @classmethod
    def of(cls, rays: Sequence[MirroredRay], scale: float = 1.0) -> Sights | None:
        """Of rays whose highlights' errors are ``scale`` times as large as stated; None of none."""
        if not rays:
            return None
        spread = np.hypot(scale * np.array([ray.spread for ray in rays]), _BALLS)
        return cls(np.array([ray.origin for ray in rays]), np.array([ray.direction for ray in rays]), spread)

    def cost(self, place: np.ndarray) -> float:
        """Half of Tukey's loss of a lamp at ``place`` (3,)."""
        inside = np.maximum(1 - self._off(place)[0] / _TUKEY**2, 0.0)
        return float(np.sum(1 - inside**3)) * _TUKEY**2 / 6

    def normal(self, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Its information (3, 3), and its gradient (3,)."""
        squares, miss, unit, reach = self._off(place)
        weight = (np.maximum(1 - squares / _TUKEY**2, 0.0) / (self.spread * reach)) ** 2
        across = np.eye(3) - unit[:, :, None] * unit[:, None, :]
        slope = np.einsum("k,kij,kj->i", weight * reach, across, miss)
        return np.einsum("k,kij->ij", weight, across), slope

    def _off(self, place: np.ndarray) -> tuple[np.ndarray, ...]:
        """Squared misses in standard errors (k,), as unit vectors (k, 3) with the directions, and distances (k, 1)."""
        offset = place - self.origin
        reach = np.linalg.norm(offset, axis=1)
        unit = offset / reach[:, None]
        miss = unit - self.toward
        return np.sum(miss**2, axis=1) / self.spread**2, miss, unit, reach
