"""What one view's paper shows, in gray, with its noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.detect.paper import PaperSamples
from photogonio.calib.detect.paper_near_balls import Close
from photogonio.capture import robust

_BRIGHT = (
    0.3  # of the tone's median radiance: what is brighter is lit, and shows more than the sensor's noise
)
_UNKNOWN_NOISE = 0.01  # relative, where too little is seen to tell
DIMMEST = 1e-300  # radiance below which there is none


@dataclass(frozen=True, slots=True)
class PaperReading:
    """One view's paper in gray."""

    samples: PaperSamples
    level: np.ndarray  # (n,) radiance
    noise: np.ndarray  # (n,) its variance
    beside: tuple[float, float] = (
        0.0,
        0.0,
    )  # white paper's radiance without the lamp, where known, and its error
    close: Close | None = None  # paper close to polished balls

    @property
    def span(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest x and y, (2,) each, of the paper that is seen: from -1 to 1 go the tilts of its light."""
        flat = self.samples.points[:, :2]
        return flat.min(0), flat.max(0)

    def thinned(self, count: int) -> PaperReading:
        """About ``count`` of the samples, evenly taken, and as large a share of what is close to balls."""
        step = max(1, len(self.level) // count)
        if step == 1:
            return self
        mask = np.arange(len(self.level)) % step == 0
        close = None if self.close is None else self.close.keep(np.arange(len(self.close.level)) % step == 0)
        samples, level, noise = self.samples.keep(mask), self.level[mask], self.noise[mask]
        return replace(self, samples=samples, level=level, noise=noise, close=close)


def local_noise(samples: PaperSamples, level: np.ndarray) -> np.ndarray:
    """Relative noise (n,) from one sample to the next of the same square and tone: what the stated variance may miss.

    White and black apart: light that spreads over the print's edges is much to black and little to white.
    """
    close = (np.diff(samples.square) == 0) & (np.diff(samples.white.astype(int)) == 0)
    close &= np.abs(np.diff(samples.points[:, 1])) < 1e-9
    pair = np.maximum(level[1:] + level[:-1], DIMMEST) / 2
    relative = np.abs(np.diff(level)) / pair
    noise = np.empty(len(level))
    for white in (True, False):
        here = close & (samples.white[1:] == white)
        middle = float(np.median(pair[here])) if here.any() else 0.0
        bright = here & (pair > _BRIGHT * middle) & (middle > DIMMEST)
        spread = robust.deviation(relative[bright]) / np.sqrt(2) if bright.any() else _UNKNOWN_NOISE
        noise[samples.white == white] = spread
    return noise
