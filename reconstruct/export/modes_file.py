"""Version 1 of the coefficient file: modes and GGX lobes alone, which older readers know."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.export.loss import PLACE
from photogonio.reconstruct.represent.developed import Developed, developed
from photogonio.reconstruct.represent.held_modes import held

TOLD = 1e-6  # of the rms of f: less that is lost is rounding


def write_modes(brdf: Brdf, path: Path, order: int | None = None) -> str | None:
    """Write it with modes up to ``order``; what is lost, in words.

    Raises:
        InputError: the order does not do.
    """
    found = developed(brdf, order)
    kept, loss = without_added_light(brdf, found)
    replace(kept, extra=kept.extra | {"remark": PLACE}).save(path)
    return loss_in_words(loss, brdf.channels, kept.order)


def without_added_light(brdf: Brdf, found: Developed) -> tuple[Brdf, np.ndarray]:
    """What stands for the BRDF, sending out no more light than it does; and its loss (c,)."""
    if not found.loss.any():
        return found.brdf, found.loss
    kept, taken = held(brdf, found.brdf)
    return kept, np.hypot(found.loss, taken / found.size)


def loss_in_words(loss: np.ndarray, channels: tuple[str, ...], order: int) -> str | None:
    """As "modes to order 12 lose 0.1 % of f, rms below 70 degrees (R 0.1, G 0.1, B 0.05 %)"."""
    if not loss.max(initial=0.0) > TOLD:
        return None
    each = ", ".join(f"{name} {100 * one:.2g}" for name, one in zip(channels, loss, strict=True))
    return f"modes to order {order} lose {100 * loss.max():.2g} % of f, rms below 70 degrees ({each} %)"
