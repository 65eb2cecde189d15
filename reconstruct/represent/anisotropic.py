"""A model that is not isotropic in the coefficient file's terms: isotropic lobes, and modes that turn with the sample.

The file has no lobe of two roughnesses. What such a lobe is on the mean over all turns is nearest to the isotropic
lobe of its mean roughness; the rest, a ridge that points along the sample, can only be said in modes, and its width
decides how many. Over a product of two hemispheres least squares with product weights factorise: with the modes'
matrix Z of one hemisphere, those of f are H f H^T with H = (Z^T w Z + penalty)^-1 Z^T w, a few small products
whatever the order.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.lobes.families import Family, lobe_columns
from photogonio.reconstruct.modes.transform import pair_coefficients, pair_matrix
from photogonio.reconstruct.modes.zernike import zernike_count, zernike_orders, zernike_sequence
from photogonio.reconstruct.represent.isotropic import (
    BEYOND,
    FILE_FAMILY,
    JUDGED,
    Represented,
    all_weighted,
    as_it_is,
    fade,
    represent,
    standing_for,
)
from photogonio.reconstruct.table.cells import Cells
from scipy.optimize import nnls

PENALTY = 1e-7  # of the mean weight: keeps fine modes from trading places beyond the limit
ORDERS = (8, 12, 16, 20, 24)  # tried: a ridge of roughness 0.15 takes the last, up to 26,000 modes
CLOSE = 0.025  # of the rms of f
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


def in_file(model: Model, order: int) -> Represented:
    """``model`` in the file's terms with modes of its own symmetry up to ``order``, no less than its own."""
    return represent(model, order) if model.basis.symmetry == "isotropic" else represent_turning(model, order)


def closely(model: Model) -> Represented:
    """``model`` with the fewest modes that say it to :data:`CLOSE`, or as many as there may be."""
    if all(family.in_file for family in model.lobes.families):
        return in_file(model, model.basis.order)
    size = typical(model)
    for order in (max(order, model.basis.order) for order in ORDERS):
        said = in_file(model, order)
        if (said.error <= CLOSE * size).all():
            break
    return said


def represent_turning(model: Model, order: int) -> Represented:
    """The same where the basis is reciprocal or general."""
    half = _hemisphere(order)
    symmetry = model.basis.symmetry
    matrix = _embedded(pair_matrix(symmetry, model.basis.modes, model.coefficients), order)
    lobes, missing, first = [], np.zeros((matrix.shape[0], 1, 1)), 0
    for family, shape in zip(model.lobes.families, model.lobes.shapes, strict=True):
        own = model.lobe_coefficients[first : first + len(family.coefficient_names)]
        first += len(own)
        if family.in_file:
            lobes.append(as_it_is(family, shape, own))
            continue
        extra, coefficients, left = _nearest(half, family, shape, own)
        matrix = matrix + extra
        lobes += all_weighted(standing_for(family, shape), coefficients, own.shape[1])
        missing = missing + left
    _, coefficients = pair_coefficients(symmetry, matrix)
    return Represented(order, coefficients, tuple(lobes), _rms(half, missing))


def covariance_of_error(symmetry: str, order: int, error: np.ndarray) -> np.ndarray:
    """(c, m, m) of modes up to ``order`` by the representation's own measure, least squares with its emphasis: a change
    of the modes that misses as much again as ``error`` (c,), 1/sr, is one standard error."""
    half = _hemisphere(order)
    modes = Basis(symmetry, order).modes
    whiten = np.linalg.inv(np.linalg.cholesky(half.gram))
    turned = whiten.T @ pair_matrix(symmetry, modes, np.eye(len(modes))) @ whiten
    root = half.emphasis.sum() * pair_coefficients(symmetry, turned)[1]
    return np.square(error)[:, None, None] * (root @ root.T)


def _nearest(half: _Hemisphere, family: Family, shape: np.ndarray, own: np.ndarray):
    """Modes (c, j, j), the file's lobes' coefficients (2 lobes, c) and what is missing (c, k, k).

    As for an isotropic lobe, a ground under the lobe is said by modes alone.
    """
    fixed, columns = _values(family, tuple(shape))
    count = len(own) - family.has_ground
    lobe = fixed + np.einsum("qkl,qc->ckl", columns[:count], own[:count])
    rest = half.rest(lobe)
    stand = [_values(FILE_FAMILY, tuple(one))[1] for one in standing_for(family, shape)]
    file_columns = np.concatenate(stand)
    file_rest = half.rest(file_columns)
    root = np.linalg.cholesky(np.array([[half.inner(a, b) for b in file_rest] for a in file_rest]))
    moments = np.array([[half.inner(a, r) for a in file_rest] for r in rest])
    found = np.stack([nnls(root.T, np.linalg.solve(root, moment))[0] for moment in moments])
    left = lobe - np.einsum("cq,qkl->ckl", found, file_columns)
    missing = rest - np.einsum("cq,qkl->ckl", found, file_rest)
    if family.has_ground:
        ground = own[-1][:, None, None] * columns[-1]
        left, missing = left + ground, missing + half.rest(ground)
    return half.coefficients(left), found.T, missing


@lru_cache(maxsize=3)
def _values(family: Family, shape: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Fixed part (k, k) and columns (q, k, k) of a lobe at all pairs of directions, whatever the modes' order."""
    half = _hemisphere(0)
    i, r = (a.ravel() for a in np.indices((len(half.theta),) * 2))
    dphi = half.phi[r] - half.phi[i]
    fixed, columns = lobe_columns(family, np.array(shape), half.theta[i], half.theta[r], dphi, half.phi[i])
    size = (len(half.theta),) * 2
    return fixed.reshape(size), columns.T.reshape(-1, *size)


def _embedded(matrix: np.ndarray, order: int) -> np.ndarray:
    spare = zernike_count(order) - matrix.shape[1]
    return np.pad(matrix, ((0, 0), (0, spare), (0, spare)))


def _rms(half: _Hemisphere, missing: np.ndarray) -> np.ndarray:
    """(c,) cosine weighted, both angles below the limit."""
    weight = np.where(half.theta < JUDGED, half.weight, 0.0)
    weight = weight / weight.sum()
    squares = np.broadcast_to(missing, (len(missing), len(weight), len(weight))) ** 2
    return np.sqrt(np.einsum("k,ckl,l->c", weight, squares, weight))


def typical(model: Model) -> np.ndarray:
    """(c,) rms of a model by the measure of the representation error, 1/sr."""
    half = _hemisphere(0)
    i, r = (a.ravel() for a in np.indices((len(half.theta),) * 2))
    value = model.evaluate(Cells.of_directions(half.theta[i], half.phi[i], half.theta[r], half.phi[r]))
    return _rms(half, np.moveaxis(value, -1, 0).reshape(-1, len(half.theta), len(half.theta)))


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
