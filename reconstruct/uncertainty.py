"""How sure a fit is: covariance of all its parameters, standard error of f anywhere, and where it may be trusted.

The covariance is the sandwich H^-1 (M + P) H^-1, with H the penalised normal matrix, P the prior's precision and M
the outer products of the score summed over clusters of cells. Residuals of one view hang together (its scale, its
stray light, its geometry), so views are the clusters where there are enough; counting cells as independent would
claim errors many times too small. Source: Liang and Zeger (1986); the small-sample factor of MacKinnon and White
(1985).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reconstruct.cells import Cells
from reconstruct.microfacet import F0_BOUNDS
from reconstruct.model import Model
from reconstruct.represent import Represented, represent
from reconstruct.robust import level
from reconstruct.search import Fitted
from reconstruct.select import Prior, folds_of

LEAST_CLUSTERS = 8
STEP = 0.02  # of a shape's logarithm, in finite differences
TRUSTED = 0.1  # relative standard error of f, on the mean, within the valid region


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Covariance of the parameters of a model: modes, then lobe coefficients, then logarithms of lobe shapes."""

    covariance: np.ndarray  # (c, p, p)
    modes: int
    coefficients: int

    def standard_error(self, model: Model, cells: Cells) -> np.ndarray:
        """Of f (n, c) at the directions of ``cells``, 1/sr."""
        common = np.hstack([model.basis.design(cells), model.lobes.columns(cells)[1]])
        shapes = _shape_derivatives(model, cells)
        return np.stack(
            [_spread(np.hstack([common, shapes[:, :, c]]), cov) for c, cov in enumerate(self.covariance)],
            axis=1,
        )

    def file_errors(self, model: Model, said: Represented) -> np.ndarray:
        """Standard errors (m, c) of the coefficients in the file's terms."""
        rows = len(said.coefficients)
        parameters = self.covariance.shape[1]
        derivative = np.zeros((said.coefficients.shape[1], rows, parameters))
        derivative[:, np.arange(self.modes), np.arange(self.modes)] = 1.0
        for p in range(self.modes, parameters):
            derivative[:, :, p] = _represented_change(model, said, p - self.modes, self.coefficients).T
        return np.stack([_spread(d, cov) for d, cov in zip(derivative, self.covariance, strict=True)], axis=1)


def uncertainty_of(fitted: Fitted, cells: Cells, deviation: np.ndarray, prior: Prior) -> Uncertainty:
    """Covariance of the fit's parameters from its residuals on ``cells``, whose error model is ``deviation``."""
    model = fitted.model
    common = np.hstack([model.basis.design(cells), model.lobes.columns(cells)[1]])
    shapes = _shape_derivatives(model, cells)
    penalty = prior.precision(model.basis.degree(), level(cells))
    weight = fitted.weight / (deviation * fitted.scale) ** 2
    cluster = _clusters(cells)
    covariance = []
    for c in range(cells.value.shape[1]):
        design = np.hstack([common, shapes[:, :, c]])
        precision = np.zeros(design.shape[1])
        precision[: penalty.shape[1]] = penalty[c]
        covariance.append(_sandwich(design, weight[:, c], fitted.residual[:, c], precision, cluster))
    return Uncertainty(np.stack(covariance), model.coefficients.shape[0], model.lobe_coefficients.shape[0])


def valid_region(spread: Uncertainty, model: Model, cells: Cells) -> dict[str, float]:
    """Largest angles, degrees, up to which directions were seen and f is known to about a tenth."""
    seen = np.degrees(min(np.max(np.maximum(cells.theta_i, cells.theta_r)), np.pi / 2))
    theta = np.radians(np.arange(2.5, 90.0, 5.0))
    dphi = np.radians(np.arange(7.5, 180.0, 15.0))
    i, r, d = (a.ravel() for a in np.meshgrid(theta, theta, dphi, indexing="ij"))
    grid = Cells.of_angles(i, r, d)
    relative = spread.standard_error(model, grid) / np.maximum(
        np.abs(model.evaluate(grid)), 1e-3 * level(cells)
    )
    weight = np.sin(i) * np.cos(i) * np.sin(r) * np.cos(r)
    limit = 0.0
    for top in np.arange(5.0, 90.1, 5.0):
        inside = np.maximum(i, r) < np.radians(top)
        if np.average(relative[inside].mean(1), weights=weight[inside]) <= TRUSTED:
            limit = top
    limit = float(round(min(limit, seen), 1))
    return {"theta_i_max": limit, "theta_r_max": limit}


def _clusters(cells: Cells) -> np.ndarray:
    """(n,) cluster of each cell: its view, or a block of neighbouring directions."""
    names, cluster = np.unique(cells.group, return_inverse=True)
    if len(names) >= LEAST_CLUSTERS:
        return cluster
    return np.unique(np.column_stack([cluster, folds_of(cells)]), axis=0, return_inverse=True)[1].ravel()


def _sandwich(design, weight, residual, precision, cluster) -> np.ndarray:
    bread = (design * weight[:, None]).T @ design
    bread[np.diag_indices_from(bread)] += precision + 1e-12 * np.trace(bread) / len(bread)
    score = design * (weight * residual)[:, None]
    clusters = cluster.max() + 1
    sums = np.stack([np.bincount(cluster, column, clusters) for column in score.T], axis=1)
    meat = sums.T @ sums * (clusters / max(clusters - 1, 1)) + np.diag(precision)
    independent = (design * weight[:, None]).T @ design + np.diag(precision)
    inverse = np.linalg.inv(bread)
    clustered, plain = inverse @ meat @ inverse, inverse @ independent @ inverse
    return _larger(clustered, plain)


def _larger(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """``a`` with its variances raised to those of ``b`` where they are smaller."""
    short = np.sqrt(np.maximum(np.diag(b) / np.maximum(np.diag(a), np.finfo(float).tiny), 1.0))
    return a * short[:, None] * short[None, :]


def _spread(rows: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    return np.sqrt(np.maximum(np.einsum("np,pq,nq->n", rows, covariance, rows, optimize=True), 0.0))


def _shape_derivatives(model: Model, cells: Cells) -> np.ndarray:
    """(n, p, c) derivatives of f by the logarithms of the lobes' shapes."""
    logs = model.lobes.flat()
    channels = model.coefficients.shape[1]
    derivative = np.zeros((len(cells), len(logs), channels))
    for p in range(len(logs)):
        ends = []
        for step in (-STEP, STEP):
            fixed, columns = model.lobes.with_flat(_moved(logs, p, step)).columns(cells)
            ends.append(fixed[:, None] + columns @ model.lobe_coefficients)
        derivative[:, p] = (ends[1] - ends[0]) / (2 * STEP)
    return derivative


def _moved(logs: np.ndarray, p: int, step: float) -> np.ndarray:
    moved = logs.copy()
    moved[p] += step
    return moved


def _represented_change(model: Model, said: Represented, p: int, coefficients: int) -> np.ndarray:
    """(m, c) change of the file's coefficients with lobe parameter ``p``: coefficients first, then shapes."""
    if all((f.fresnel, f.masking) == ("schlick", "correlated") for f in model.lobes.families):
        return np.zeros_like(said.coefficients)
    lobes, own = model.lobes, model.lobe_coefficients
    if p < coefficients:
        step = max(STEP * float(np.abs(own[p]).max()), F0_BOUNDS[0] * STEP)
        own = own.copy()
        own[p] += step
    else:
        step = STEP
        lobes = lobes.with_flat(_moved(lobes.flat(), p - coefficients, step))
    moved = represent(Model(model.basis, model.coefficients, lobes, own), said.order)
    return (moved.coefficients - said.coefficients) / step
