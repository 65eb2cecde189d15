"""Which directions were seen, in words."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.modes.angles import half_difference, pair_angles
from photogonio.reconstruct.table.facet_table import FacetTable

BANDS = ((0.0, 30.0), (30.0, 60.0), (60.0, 80.0))  # degrees of incidence
STEPS = (8, 6)  # parts of the exit hemisphere, of equal solid angle: by polar angle, by azimuth on one side
NEAR = np.radians(10.0)  # of a direction that is looked for
STEEP, FLAT = 75.0, 20.0  # degrees: a table that ends before, or begins behind, misses something
LEAST = 0.5  # of the exit directions in a band
STEP = 5.0  # degrees of incidence, in which mirror and lamp directions are looked for


@dataclass(frozen=True, slots=True)
class Coverage:
    """Sentences, and what is missing, in a few words each."""

    said: tuple[str, ...]
    missing: tuple[str, ...]


def coverage_of(table: FacetTable) -> Coverage:
    """Of the pairs of directions in a table."""
    theta_i, theta_r, dphi = pair_angles(table.incident, table.exit)
    low, high = (np.degrees([theta_i.min(), theta_r.min()]), np.degrees([theta_i.max(), theta_r.max()]))
    said = [
        f"Light came from {low[0]:.0f} to {high[0]:.0f} degrees from the normal, and was seen from {low[1]:.0f} to "
        f"{high[1]:.0f} degrees."
    ]
    missing = [
        f"{name} beyond {top:.0f} degrees"
        for name, top in zip(("light from", "a look from"), high, strict=True)
        if top < STEEP
    ]
    seen = [(band, _share(theta_i, theta_r, np.abs(dphi), band)) for band in BANDS]
    said += [
        "Of the exit directions were seen: "
        + ", ".join(
            f"{100 * share:.0f} % at {a:.0f} to {b:.0f} degrees of incidence" for (a, b), share in seen
        )
        + "."
    ]
    missing += [
        f"{100 * (1 - share):.0f} % of the exit directions at {a:.0f} to {b:.0f} degrees of incidence"
        for (a, b), share in seen
        if share < LEAST
    ]
    theta_h, theta_d, _ = half_difference(table.incident, table.exit)
    for name, near, at in (
        ("the mirror direction", theta_h < 0.5 * NEAR, theta_d),
        ("the lamp's own direction", 2.0 * theta_d < NEAR, theta_i),
    ):
        words = _ranges(np.degrees(at[near]))
        said.append(f"{name[0].upper()}{name[1:]} was seen, to {np.degrees(NEAR):.0f} degrees, {words}.")
        if not near.any():
            missing.append(name)
    return Coverage(tuple(said), tuple(missing))


def _share(theta_i: np.ndarray, theta_r: np.ndarray, dphi: np.ndarray, band: tuple[float, float]) -> float:
    """Of the exit hemisphere, a surface's mirror image about the plane of incidence being the same."""
    inside = (theta_i >= np.radians(band[0])) & (theta_i < np.radians(band[1]))
    rows = np.minimum((1.0 - np.cos(theta_r[inside])) * STEPS[0], STEPS[0] - 1).astype(int)
    columns = np.minimum(dphi[inside] / np.pi * STEPS[1], STEPS[1] - 1).astype(int)
    return len(np.unique(rows * STEPS[1] + columns)) / (STEPS[0] * STEPS[1])


def _ranges(degrees: np.ndarray) -> str:
    """As "at 10 to 55 and 65 to 70 degrees of incidence"."""
    steps = np.unique(np.floor(degrees / STEP).astype(int))
    if not len(steps):
        return "nowhere"
    starts = np.flatnonzero(np.diff(steps, prepend=steps[0] - 2) > 1)
    ends = np.r_[starts[1:] - 1, len(steps) - 1]
    words = [
        f"{STEP * steps[a]:.0f} to {STEP * (steps[b] + 1):.0f}" for a, b in zip(starts, ends, strict=True)
    ]
    return f"at {' and '.join(words)} degrees of incidence"
