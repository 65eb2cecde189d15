"""A BRDF known everywhere, or at single pairs of directions, whatever file it came from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from photogonio.compare.metrics import Directions

Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True, slots=True)
class Known:
    """A BRDF known everywhere (``evaluate``), or at given pairs of directions (``at`` and ``value``); of a whole grid
    of pairs also what lies between them."""

    name: str
    channels: tuple[str, ...]
    isotropic: bool
    evaluate: Evaluate | None = None  # incident, exit (n, 3) -> (n, c), 1/sr
    at: Directions | None = None
    value: np.ndarray | None = None  # (n, c) 1/sr
    warnings: tuple[str, ...] = ()
    luminance: bool = False  # the file says that its channel Y is CIE Y

    def values(self, at: Directions) -> np.ndarray:
        """(n, c) 1/sr at pairs of directions, which are its own where it has such."""
        if self.value is not None:
            return self.value
        if self.evaluate is None:
            raise ValueError(f"{self.name} is known nowhere")
        return self.evaluate(at.incident, at.exit)
