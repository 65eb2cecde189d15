"""MERL's binary table, which many renderers and tools open."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.merl import write_merl
from photogonio.reconstruct.export.rgb import rgb_order


def write_merl_table(brdf: Brdf, path: Path) -> None:
    """Isotropic BRDFs of the channels R, G, B (any three, in order) or of one channel, which is repeated.

    Raises:
        InputError: the format cannot hold this BRDF.
    """
    if brdf.turning:
        raise InputError("--format merl", "holds isotropic BRDFs only; this one changes as the sample turns")
    count = len(brdf.channels)
    if count not in (1, 3):
        raise InputError("--format merl", f"holds three channels; this BRDF has {', '.join(brdf.channels)}")
    order = rgb_order(brdf.channels)

    def evaluate(incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        f = brdf(incident, exit)
        return f[:, order] if order else np.broadcast_to(f, (len(f), 3))

    write_merl(path, evaluate)
