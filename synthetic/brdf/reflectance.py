"""What all reflectance models share: the call on direction pairs, and the angles of the formulas."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

Channels = tuple[float, ...]


class PairAngles:
    """Direction pairs above the horizon, (n, 3) each, and their angles: (n,), cosines unless said."""

    def __init__(self, incident: np.ndarray, exit: np.ndarray):
        self.incident, self.exit = incident, exit
        self.cos_i, self.cos_r = incident[:, 2], exit[:, 2]

    @cached_property
    def cos_phase(self) -> np.ndarray:
        """Cosine of the angle between incident and exit: 1 is retro-reflection."""
        return np.clip(np.einsum("ij,ij->i", self.incident, self.exit), -1.0, 1.0)

    @cached_property
    def half(self) -> np.ndarray:
        """Unit half vectors, (n, 3)."""
        half = self.incident + self.exit
        return half / np.linalg.norm(half, axis=1, keepdims=True)

    @cached_property
    def cos_h(self) -> np.ndarray:
        """Between normal and half vector."""
        return np.clip(self.half[:, 2], 0.0, 1.0)

    @cached_property
    def cos_d(self) -> np.ndarray:
        """Between half vector and incident (and exit): the angle of reflection at a facet."""
        return np.sqrt(0.5 * (1.0 + self.cos_phase))

    @cached_property
    def cos_dphi(self) -> np.ndarray:
        """Of the difference between the azimuths: 1 is toward the light; 1 where an azimuth is undefined."""
        across = np.hypot(self.incident[:, 0], self.incident[:, 1]) * np.hypot(
            self.exit[:, 0], self.exit[:, 1]
        )
        along = self.incident[:, 0] * self.exit[:, 0] + self.incident[:, 1] * self.exit[:, 1]
        return np.clip(np.divide(along, across, out=np.ones_like(along), where=across > 1e-15), -1.0, 1.0)


@dataclass(frozen=True)
class Reflectance:
    """A BRDF. ``above`` says what holds over the horizon; the call adds that nothing is below it."""

    isotropic = True
    reciprocal = True

    def __call__(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        """BRDF in 1/sr, (..., c), for unit vectors (..., 3) in the tangent frame (x, y, n)."""
        incident, exit = np.broadcast_arrays(np.asarray(incident, float), np.asarray(exit, float))
        above = (incident[..., 2] > 0) & (exit[..., 2] > 0)
        value = self.above(PairAngles(incident[above], exit[above]))
        out = np.zeros((*above.shape, value.shape[-1]))
        out[above] = value
        return out

    def above(self, pairs: PairAngles) -> np.ndarray:
        """BRDF (n, c) of pairs that are both above the horizon."""
        raise NotImplementedError


def spread(scalar: np.ndarray, channels: Channels | np.ndarray) -> np.ndarray:
    """(n,) times one factor a channel: (n, c)."""
    return scalar[:, None] * np.asarray(channels, float)
