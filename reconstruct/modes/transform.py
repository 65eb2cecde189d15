"""Expansions as matrices, and a general BRDF projected on reciprocal and isotropic ones.

An expansion is one matrix A a channel, f = sum A_jk Z_j(i) Z_k(r) (OSA/ANSI indices). Turning the sample mixes
Z_n^l with Z_n^-l; reciprocity says A is symmetric; isotropy that A commutes with every turn. What a projection
takes away is a number, the test of reciprocity and isotropy that the paper asks for.
Source: Koenderink et al. (1996), section 3.
"""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.modes.basis import (
    general_modes,
    isotropic_modes,
    isotropic_norms,
    pair_indices,
    reciprocal_modes,
)
from photogonio.reconstruct.modes.zernike import zernike_count, zernike_index, zernike_orders


def pair_matrix(symmetry: str, modes: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """(c, j, j) matrices of an expansion of any symmetry. Inverse of :func:`pair_coefficients`."""
    modes, coefficients = np.asarray(modes, int), np.asarray(coefficients, float)
    columns = [0] if symmetry == "isotropic" else [0, 2]
    count = zernike_count(int(modes[:, columns].max(initial=0)))
    matrix = np.zeros((coefficients.shape[1], count, count))
    for share, j, k in _entries(symmetry, modes):
        for each, values in zip(matrix, coefficients.T, strict=True):
            np.add.at(each, (j, k), share * values)
    return matrix


def pair_coefficients(symmetry: str, matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Modes and coefficients (m, c) of matrices (c, j, j): the inner product with every mode.

    Inverse of :func:`pair_matrix` where the matrices have the symmetry, else the orthogonal projection.
    """
    order = int(zernike_orders(matrix.shape[1] - 1)[0])
    modes = _LISTS[symmetry](order)
    coefficients = sum(share[:, None] * matrix[:, j, k].T for share, j, k in _entries(symmetry, modes))
    return modes, coefficients


def breaches(modes: np.ndarray, coefficients: np.ndarray, symmetry: str = "general") -> dict[str, np.ndarray]:
    """What each assumption takes away from an expansion, (c,) each, as shares of its root sum of squares.

    The squares of ``kept``, ``reciprocity``, ``isotropy`` and ``bilateral`` add up to 1: first f(i, r) = f(r, i), then
    invariance under turns, then (isotropic only) under reflection, which leaves the isotropic modes.
    """
    matrix = pair_matrix(symmetry, modes, coefficients)
    symmetric = (matrix + matrix.transpose(0, 2, 1)) / 2
    invariant = _turn_average(symmetric)
    isotropic = pair_matrix("isotropic", *pair_coefficients("isotropic", invariant))
    size = np.maximum(np.sqrt((matrix**2).sum((1, 2))), np.finfo(float).tiny)
    parts = {
        "kept": isotropic,
        "reciprocity": matrix - symmetric,
        "isotropy": symmetric - invariant,
        "bilateral": invariant - isotropic,
    }
    return {name: np.sqrt((part**2).sum((1, 2))) / size for name, part in parts.items()}


def _turn_average(matrix: np.ndarray) -> np.ndarray:
    """Mean over all turns, exactly: their matrix elements are trigonometric, of twice the order at most."""
    steps = 4 * int(zernike_orders(matrix.shape[1] - 1)[0]) + 1
    turns = [_turn_matrix(matrix.shape[1], 2 * np.pi * k / steps) for k in range(steps)]
    return sum(turn.T @ matrix @ turn for turn in turns) / steps


def _turn_matrix(count: int, angle: float) -> np.ndarray:
    """(j, j) matrix T with Z_j(theta, phi - angle) = sum_k T_jk Z_k(theta, phi)."""
    n, l = zernike_orders(np.arange(count))
    turn = np.zeros((count, count))
    turn[np.arange(count), zernike_index(n, -l)] = np.sin(l * angle)
    turn[np.arange(count), np.arange(count)] = np.cos(l * angle)
    return turn


def _entries(symmetry: str, modes: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """(share, j, k) of every Z_j(i) Z_k(r) in each mode; those that coincide add up."""
    if symmetry == "isotropic":
        n, m, l = modes.T
        share = isotropic_norms(modes) / 2
        pairs = [(zernike_index(n, s * l), zernike_index(m, s * l)) for s in (1, -1)]
        return [(share, a, b) for j, k in pairs for a, b in ((j, k), (k, j))]
    j, k = pair_indices(modes)
    if symmetry == "general":
        return [(np.ones(len(modes)), j, k)]
    share = np.where(j == k, 0.5, np.sqrt(0.5))
    return [(share, j, k), (share, k, j)]


_LISTS = {"isotropic": isotropic_modes, "reciprocal": reciprocal_modes, "general": general_modes}
