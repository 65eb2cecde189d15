"""What no surface can do: a negative BRDF, and more light sent out than came in.

A plain fit may do either where data are noisy or absent. The nearest coefficients that do neither are found by
quadratic programming: nearest in the metric of the fit's own covariance, so that what the data determine stays. The
problem is one of least distance, solved as non-negative least squares (Lawson and Hanson 1974, chapter 23); its
constraints, one a pair of directions, are added as they are found violated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import nnls

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.modes.integrals import directional_albedo
from photogonio.reconstruct.table.cells import Cells

STEP = 5.0  # degrees between the pairs that are held
HIGHEST = np.radians(85.0)  # polar angles beyond are not held: nothing is measured there
ROUNDS = 30
BATCH = 40  # constraints added a round
RANK = 1e-10  # of the largest variance: below it rounding
TRIFLE = 3e-3  # of the mean f: less below 0 is no matter
MOST_MOVED = 4.0  # standard errors, a bound: data that must move further contradict physics, and are not bent
WRITTEN = 1e-8  # of the largest coefficient: no finer digits are written
KEPT = 5e-3  # of the albedo, by which raising may change it
SLACK = 1e-9  # of the largest value: rounding
ALBEDO_ANGLES = np.radians(np.arange(0.0, 86.0, 5.0))


@dataclass(frozen=True, slots=True)
class Physical:
    """Coefficients that keep to physics, and what it took."""

    coefficients: np.ndarray  # (m, c)
    least: float  # f of the plain fit at its most negative, 1/sr
    albedo: float  # largest directional albedo of the plain fit
    active: int  # constraints that bind
    distance: float  # how far the coefficients were moved, in their standard errors, a binding constraint


def violated(brdf: Brdf, error: np.ndarray) -> bool:
    """Whether ``brdf`` is negative by more than its standard ``error`` (k, c) at :func:`held_pairs` and more than a
    trifle, or its albedo, on an absolute scale, is above 1 by more than the mean relative error."""
    pairs = held_pairs()
    value = brdf.evaluate(pairs.theta_i, 0.0, pairs.theta_r, pairs.dphi)
    weight = (np.sin(2 * pairs.theta_i) * np.sin(2 * pairs.theta_r))[:, None]
    trifle = TRIFLE * (weight * np.abs(value)).sum(0) / weight.sum()
    if (value < -(error + trifle)).any():
        return True
    relative = (weight * error).sum(0) / np.maximum((weight * np.abs(value)).sum(0), np.finfo(float).tiny)
    albedo = brdf.directional_albedo(ALBEDO_ANGLES)
    return brdf.scale == "absolute" and bool((albedo > 1.0 + relative).any())


def enforced(brdf: Brdf, covariance: np.ndarray) -> Physical | None:
    """The nearest isotropic BRDF without negative values or, on an absolute scale, albedos above 1.

    ``covariance`` (c, m, m) of the modes' coefficients; the lobes stay as they are. None where modes of this order
    cannot make up for what the lobes alone violate.
    """
    pairs = held_pairs()
    value = brdf.evaluate(pairs.theta_i, 0.0, pairs.theta_r, pairs.dphi)
    rows, room = Basis("isotropic", brdf.order).design(pairs), value
    albedo = brdf.directional_albedo(ALBEDO_ANGLES)
    if brdf.scale == "absolute":
        unit = np.eye(len(brdf.modes))
        rows = np.vstack(
            [rows, -directional_albedo(brdf.symmetry, brdf.modes, unit, brdf.quantity, ALBEDO_ANGLES)]
        )
        room = np.vstack([room, 1.0 - albedo])
    changes, active, squared = [], 0, 0.0
    for c, spread in enumerate(covariance):
        found = nearest_change(rows, room[:, c], root_of(spread))
        if found is None:
            return None
        changes.append(found[0])
        active += found[1]
        squared += found[2]
    return Physical(
        coefficients=brdf.coefficients + np.stack(changes, axis=1),
        least=float(value.min()),
        albedo=float(albedo.max()),
        active=active,
        distance=float(np.sqrt(squared / max(active, 1))),
    )


def raised(brdf: Brdf) -> Brdf:
    """The isotropic ``brdf`` without negative values at :func:`held_pairs`, its modes changed as little as can be in
    the mean square over all directions: modes that end at an order have some. As it is, where its modes cannot, or
    where that would add light to speak of, as to a black ground."""
    pairs = held_pairs()
    value = brdf.evaluate(pairs.theta_i, 0.0, pairs.theta_r, pairs.dphi)
    below = np.flatnonzero((value < 0.0).any(0))
    if not len(below):
        return brdf
    of_order = {tuple(mode): k for k, mode in enumerate(Basis("isotropic", brdf.order).modes.tolist())}
    own = [of_order[tuple(mode)] for mode in brdf.modes.tolist()]
    rows, coefficients = Basis("isotropic", brdf.order).design(pairs)[:, own], brdf.coefficients.copy()
    for c in below:
        change = nearest_change(rows, value[:, c], np.eye(len(own)))
        if change is None:
            return brdf
        coefficients[:, c] += change[0]
    quantum = WRITTEN * np.abs(coefficients).max()
    found = replace(brdf, coefficients=np.round(coefficients / quantum) * quantum)
    added = found.bihemispherical_albedo() / brdf.bihemispherical_albedo() - 1.0
    return found if np.abs(added).max() <= KEPT else brdf


def held_pairs() -> Cells:
    """Pairs of directions at which f is held above 0, one of each two reciprocal twins."""
    theta = np.radians(np.arange(0.5 * STEP, np.degrees(HIGHEST), STEP))
    dphi = np.radians(np.arange(0.0, 181.0, 2.0 * STEP))
    i, r, d = (a.ravel() for a in np.meshgrid(theta, theta, dphi, indexing="ij"))
    half = i >= r
    return Cells.of_angles(i[half], r[half], d[half])


def root_of(covariance: np.ndarray) -> np.ndarray:
    """A square root (m, m) of a covariance; what it holds fixed stays fixed."""
    values, vectors = np.linalg.eigh(covariance)
    return vectors * np.sqrt(np.where(values > RANK * values.max(), values, 0.0))


def nearest_change(
    rows: np.ndarray, room: np.ndarray, root: np.ndarray
) -> tuple[np.ndarray, int, float] | None:
    """The least change x = root y with rows @ x + room >= 0, how many bind, and y^2; None if there is none."""
    scaled = rows @ root
    change, held = np.zeros(root.shape[1]), np.zeros(0, int)
    slack = SLACK * np.abs(room).max()
    for _ in range(ROUNDS):
        left = scaled @ change + room
        worst = np.argsort(left)[:BATCH]
        new = np.setdiff1d(worst[left[worst] < -slack], held)
        if not len(new):
            return root @ change, int((left[held] < slack).sum()), float(change @ change)
        held = np.union1d(held, new)
        found = least_distance(scaled[held], -room[held])
        if found is None:
            return None
        change = found
    return None


def least_distance(matrix: np.ndarray, lower: np.ndarray) -> np.ndarray | None:
    """The shortest y with matrix @ y >= lower (Lawson and Hanson 1974, LDP); None where there is none."""
    size = np.linalg.norm(matrix, axis=1)
    size = np.where(size > 0.0, size, 1.0)
    unit = max(float(np.abs(lower / size).max()), np.finfo(float).tiny)
    dual = np.vstack([(matrix / size[:, None]).T, (lower / size / unit)[None]])
    target = np.zeros(len(dual))
    target[-1] = 1.0
    weights, _ = nnls(dual, target, maxiter=50 * dual.shape[1])
    residual = dual @ weights - target
    if abs(residual[-1]) < 1e-9:
        return None
    return -residual[:-1] / residual[-1] * unit
