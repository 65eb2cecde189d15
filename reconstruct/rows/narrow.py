"""Is there a peak about the mirror direction or the light's own that is narrower than lobes and steps of angles are?

Where rows within two degrees of it are twenty times as bright as those a few degrees off, no lobe of a grid of
roughnesses follows them, and each is alone. Whatever else is asked of such a table by the evidence of lobes, these rows
stir it by chance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.modes.angles import unit_vectors

CORE = np.radians(2.5)  # of a direction: the peak,
RING = (np.radians(4.0), np.radians(12.0))  # and what is around it
TIMES = 20.0  # as bright: GGX of a roughness of 0.02 is, in exit angles; the narrowest of a grid is 0.07
FEWEST = 3  # rows of the peak
AROUND = 6  # rows around it, of which
MOST = 0.9  # are no brighter than what the peak is compared with


@dataclass(frozen=True, slots=True)
class NarrowPeak:
    """A peak, and the rows that it has."""

    about: str  # "mirror" | "light"
    times: float  # as bright as around it
    rows: np.ndarray  # (n,) bool: within RING's larger angle of either direction


def narrow_peak(
    theta_i: np.ndarray, theta_r: np.ndarray, dphi: np.ndarray, value: np.ndarray
) -> NarrowPeak | None:
    """The narrower of the two, of rows of ``value`` (n,), 1/sr; angles (n,) in radians."""
    incident, exit = unit_vectors(theta_i, 0.0 * theta_i), unit_vectors(theta_r, dphi)
    mirror, light = (
        np.arccos(np.clip(np.einsum("ij,ij->i", incident, exit * turned), -1.0, 1.0))
        for turned in ([-1.0, -1.0, 1.0], [1.0, 1.0, 1.0])
    )
    found = []
    for about, angle, other in (("mirror", mirror, light), ("light", light, mirror)):
        apart = other > RING[1]  # near the normal the two are one
        core = np.sort(value[apart & (angle < CORE)])
        ring = value[apart & (angle > RING[0]) & (angle < RING[1])]
        if len(core) < FEWEST or len(ring) < AROUND:
            continue
        around = float(np.quantile(ring, MOST))
        if core[-FEWEST] > TIMES * max(around, 0.0):
            times = float(core[-FEWEST] / max(around, np.finfo(float).tiny))
            found.append(NarrowPeak(about, times, np.minimum(angle, other) < RING[1]))
    return max(found, key=lambda one: one.times) if found else None
