"""Lobes of two roughnesses in the terms of the file's first version: isotropic lobes, and modes that turn.

What such a lobe is on the mean over all turns is nearest to the isotropic lobe of its mean roughness; the rest, a
ridge that points along the sample, can only be said in modes, and its width decides how many. Over a product of two
hemispheres least squares with product weights factorise: with the modes' matrix Z of one hemisphere, those of f are
H f H^T with H = (Z^T w Z + penalty)^-1 Z^T w, a few small products whatever the order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.optimize import nnls

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.modes.transform import pair_coefficients
from photogonio.reconstruct.modes.zernike import zernike_orders, zernike_sequence
from photogonio.reconstruct.represent.isotropic import (
    BEYOND,
    JUDGED,
    Represented,
    all_weighted,
    fade,
    parts_of,
    standing_for,
)

PENALTY = 1e-7  # of the mean weight: keeps fine modes from trading places beyond the limit
NODES = (26, 56)  # Gauss nodes in cos theta, midpoints in azimuth


@dataclass(frozen=True, slots=True)
class _Hemisphere:
    """Directions of a rule and the modes there, up to an order."""

    theta: np.ndarray  # (k,) radians
    phi: np.ndarray  # (k,)
    weight: np.ndarray  # (k,) cosine weighted
    emphasis: np.ndarray  # (k,) the same, less where few photos see
    modes: np.ndarray  # (k, j)
    gram: np.ndarray  # (j, j) of the modes, by the emphasis, with the penalty
    analysis: np.ndarray  # (j, k) values to coefficients

    def rest(self, values: np.ndarray) -> np.ndarray:
        """What of values (..., k, k) the modes do not hold."""
        return values - self.modes @ self.coefficients(values) @ self.modes.T

    def coefficients(self, values: np.ndarray) -> np.ndarray:
        """(..., j, j) of values (..., k, k)."""
        return self.analysis @ values @ self.analysis.T

    def inner(self, a: np.ndarray, b: np.ndarray) -> float:
        """Weighted inner product of values (k, k)."""
        return float(self.emphasis @ (a * b) @ self.emphasis)


def represent_turning(
    lobes: Sequence[Lobe], channels: int, order: int, symmetry: str, *, alone: bool = False
) -> Represented:
    """``lobes`` by modes of ``symmetry`` up to ``order`` and lobes of the first version; by modes ``alone`` if so."""
    half = _hemisphere(order)
    matrix = np.zeros((channels, *half.gram.shape))
    missing = np.zeros((channels, len(half.theta), len(half.theta)))
    kept: list[Lobe] = []
    for lobe in lobes:
        for part, factors, is_ground in parts_of(lobe):
            shapes = () if alone or is_ground else standing_for(lobe)
            found, coefficients, left = _nearest(half, _values(part), shapes)
            matrix += np.einsum("kab,kc->cab", found, factors)
            missing += np.einsum("kab,kc->cab", left, factors)
            kept += all_weighted(shapes, coefficients, factors)
    _, coefficients = pair_coefficients(symmetry, matrix)
    return Represented(order, coefficients, tuple(kept), _rms(half, missing))


def _nearest(half: _Hemisphere, lobe: np.ndarray, shapes: tuple[np.ndarray, ...]):
    """Modes (k, j, j), coefficients (2 lobes, k) of the first version's lobes, and what is missing (k, n, n) of a lobe
    (k, n, n)."""
    rest = half.rest(lobe)
    if not shapes:
        return half.coefficients(lobe), np.empty((0, len(lobe))), rest
    one = np.ones(1)
    columns = np.concatenate(
        [_values(Lobe(float(shape[0]), f0, one)) for shape in shapes for f0 in (one, 0.0 * one)]
    )
    file_rest = half.rest(columns)
    root = np.linalg.cholesky(np.array([[half.inner(a, b) for b in file_rest] for a in file_rest]))
    moments = np.array([[half.inner(a, r) for a in file_rest] for r in rest])
    found = np.stack([nnls(root.T, np.linalg.solve(root, moment))[0] for moment in moments])
    left = lobe - np.einsum("cq,qkl->ckl", found, columns)
    missing = rest - np.einsum("cq,qkl->ckl", found, file_rest)
    return half.coefficients(left), found.T, missing


def _values(lobe: Lobe) -> np.ndarray:
    """(c, n, n) of a lobe at all pairs of directions, whatever the modes' order."""
    half = _hemisphere(0)
    phi = half.phi[:, None]
    return np.moveaxis(lobe.evaluate(half.theta[:, None], half.theta, half.phi - phi, phi), -1, 0)


def _rms(half: _Hemisphere, missing: np.ndarray) -> np.ndarray:
    """(c,) cosine weighted, both angles below the limit."""
    weight = np.where(half.theta < JUDGED, half.weight, 0.0)
    weight = weight / weight.sum()
    return np.sqrt(np.einsum("k,ckl,l->c", weight, missing**2, weight))


def typical(brdf: Brdf) -> np.ndarray:
    """(c,) rms of f by the measure of the representation error, 1/sr."""
    half = _hemisphere(0)
    phi = half.phi[:, None]
    value = brdf.evaluate(half.theta[:, None], phi, half.theta, half.phi)
    return _rms(half, np.moveaxis(value, -1, 0))


@lru_cache(maxsize=4)
def _hemisphere(order: int) -> _Hemisphere:
    nodes, weights = np.polynomial.legendre.leggauss(NODES[0])
    cos = 0.5 * (nodes + 1.0)
    azimuth = 2.0 * np.pi * (np.arange(NODES[1]) + 0.5) / NODES[1]
    theta, phi = np.repeat(np.arccos(cos), NODES[1]), np.tile(azimuth, NODES[0])
    weight = np.repeat(weights * cos, NODES[1])
    emphasis = weight * (BEYOND + fade(theta))
    modes = np.ascontiguousarray(zernike_sequence(order, theta, phi).T)
    n = zernike_orders(np.arange(modes.shape[1]))[0]
    gram = modes.T @ (emphasis[:, None] * modes)
    penalty = PENALTY * np.trace(gram) / len(gram) * (n * (n + 2) / 8.0) ** 2
    gram = gram + np.diag(penalty)
    analysis = np.linalg.solve(gram, modes.T * emphasis)
    return _Hemisphere(theta, phi, weight, emphasis, modes, gram, analysis)
