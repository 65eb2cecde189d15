"""The angles at which tables of values are written, and what is said of a BRDF in remarks."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf

STEP, TURN = 5.0, 15.0  # degrees, of the polar angles and of the azimuths
LAST = 85.0  # degrees: at 90 many BRDFs have no finite value


def polar_nodes() -> np.ndarray:
    """Polar angles, degrees."""
    return np.arange(0.0, LAST + 1.0, STEP)


def turns(step: float = TURN) -> np.ndarray:
    """Azimuths of a whole turn, degrees."""
    return np.arange(0.0, 360.0, step)


def scale_in_words(brdf: Brdf) -> str:
    """What the values are up to."""
    return "absolute scale" if brdf.scale == "absolute" else "relative scale: up to one factor a channel"


def title(brdf: Brdf) -> str:
    """What the BRDF is called: by the set or table that it came from."""
    return str(brdf.source.get("name") or "photogonio")
