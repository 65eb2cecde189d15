"""Columns by which a model can leave isotropy and reciprocity: what a test of either adds to a design matrix."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.linalg import null_space

from photogonio.reconstruct.modes.basis import isotropic_modes, pair_design, reciprocal_modes
from photogonio.reconstruct.modes.transform import pair_coefficients, pair_matrix
from photogonio.reconstruct.modes.zernike import zernike_index, zernike_sequence
from photogonio.reconstruct.table.cells import Cells

SWAPPED = (
    (2, 0, 0),
    (3, 1, 1),
    (4, 0, 0),
    (4, 2, 0),
    (4, 2, 2),
)  # n, m, l of the modes that are odd under exchange


@dataclass(frozen=True, slots=True)
class Columns:
    """Further modes, orthonormal to those of the model that they leave."""

    values: np.ndarray  # (n, k) at the cells, 1/sr
    degree: np.ndarray  # (k,) how fine each is, as :meth:`reconstruct.estimate.mode_set.Basis.degree`

    @classmethod
    def none(cls, cells: Cells) -> Columns:
        return cls(np.empty((len(cells), 0)), np.empty(0))


def turning_modes(cells: Cells, order: int) -> Columns:
    """Reciprocal modes that change when the sample is turned, but not by half a turn.

    What half a turn changes is left out: a plane whose normal is not quite where it is thought shows the like.
    """
    weights, degree = _turning(order)
    around = cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r
    design = pair_design("reciprocal", order, around)
    return Columns(design @ weights, degree)


@lru_cache(maxsize=4)
def _turning(order: int) -> tuple[np.ndarray, np.ndarray]:
    """Combinations (m, k) of reciprocal modes orthogonal to all isotropic ones, and their degrees (k,)."""
    rows, isotropic = reciprocal_modes(order), isotropic_modes(order)
    _, held = pair_coefficients("reciprocal", pair_matrix("isotropic", isotropic, np.eye(len(isotropic))))
    even = (rows[:, 1] + rows[:, 3]) % 2 == 0
    blocks, degree = [], []
    for n in range(order + 1):
        for m in range(n % 2, n + 1, 2):
            block = np.flatnonzero(even & (rows[:, 0] == n) & (rows[:, 2] == m))
            free = null_space(held[block].T)
            weights = np.zeros((len(rows), free.shape[1]))
            weights[block] = free
            blocks.append(weights)
            degree += [(n * (n + 2) + m * (m + 2)) / 8.0] * free.shape[1]
    return np.hstack(blocks), np.array(degree)


def swapped_modes(cells: Cells) -> Columns:
    """Isotropic modes that change sign when incidence and exit are exchanged: what reciprocity forbids."""
    order = max(n for n, _, _ in SWAPPED)
    zi, zr = (zernike_sequence(order, theta, 0.0 * theta) for theta in (cells.theta_i, cells.theta_r))
    columns = []
    for n, m, l in SWAPPED:
        first, second = zernike_index(n, l), zernike_index(m, l)
        # Z at azimuth 0 is sqrt(2) times the elevation, but for l = 0
        wave = np.cos(l * cells.dphi) * (0.5 if l else np.sqrt(0.5))
        columns.append((zi[first] * zr[second] - zi[second] * zr[first]) * wave)
    degree = [(n * (n + 2) + m * (m + 2)) / 8.0 for n, m, _ in SWAPPED]
    return Columns(np.stack(columns, axis=1), np.array(degree))
