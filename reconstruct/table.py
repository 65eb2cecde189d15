"""The facet-pair table: sums over the samples of each (group, incident facet, exit facet) cell.

A group is one view (photo); keeping them apart lets a fit leave a photo out, or find its scale. Tables add.
Every sample k has one weight omega_k, the same for its value, its directions and its place, so that a cell's means
belong to one another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class FacetTable:
    """Sums over samples; cells in ascending order of (group, incident facet, exit facet), each once."""

    level: int  # of the icosahedral facets
    channels: tuple[str, ...]
    groups: tuple[str, ...]  # name of each group
    isotropic: bool  # samples were turned about the normal to a canonical incident azimuth first
    group: np.ndarray  # (n,) int32 index in groups
    facet_i: np.ndarray  # (n,) int32
    facet_r: np.ndarray  # (n,) int32
    count: np.ndarray  # (n,) float64 number of samples
    weight: np.ndarray  # (n,) sum of omega
    value: np.ndarray  # (n, c) sum of omega f, 1/sr
    value2: np.ndarray  # (n, c) sum of omega f^2
    variance: np.ndarray  # (n, c) sum of omega^2 var(f)
    incident: np.ndarray  # (n, 3) sum of omega times the unit vector, tangent frame
    exit: np.ndarray  # (n, 3) likewise
    place: np.ndarray  # (n, 3) sum of omega times the world point, length units; zeros where there is none
