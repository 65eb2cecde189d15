"""A fitted model in the coefficient file's terms: height-correlated Schlick lobes with a weight, and modes.

What a lobe of another family has beyond the file's lobe of nearest shape goes into the modes, by least squares over
the whole hemisphere of pairs. There is no noise in this, so its order may be higher than the order of the fit; what
still remains is the representation error, and it is reported.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from reconstruct.basis import Basis
from reconstruct.brdf import Lobe
from reconstruct.cells import Cells
from reconstruct.microfacet import Family
from reconstruct.model import LobeSet, Model
from reconstruct.search import FINE, Profile, descend

FILE_FAMILY = Family("file", "schlick", "correlated", absolute=False)
JUDGED = np.radians(70.0)  # the error is stated below it
FADE = np.radians(76.0)  # beyond it the lobe counts less: few photos see it and few pictures show it
FADE_WIDTH = np.radians(2.5)
BEYOND = 0.02  # weight of what lies beyond, against 1
PENALTY = 1e-8  # of the weight's sum: keeps fine modes from trading places
NODES = (28, 40)  # Gauss nodes in cos theta, midpoints in dphi


@dataclass(frozen=True, slots=True)
class Represented:
    """The model as the file says it."""

    order: int
    coefficients: np.ndarray  # (m, c) of the isotropic basis up to ``order``
    lobes: tuple[Lobe, ...]
    error: np.ndarray  # (c,) rms of what is missing, cosine weighted, both angles below 70 degrees, 1/sr


def represent(model: Model, order: int) -> Represented:
    """An isotropic ``model`` in the file's terms with modes up to ``order``, no less than the model's own."""
    channels = model.coefficients.shape[1]
    coefficients = np.zeros((len(Basis("isotropic", order).modes), channels))
    coefficients[: len(model.coefficients)] = model.coefficients
    lobes, missing, first = [], np.zeros(channels), 0
    for family, shape in zip(model.lobes.families, model.lobes.shapes, strict=True):
        own = model.lobe_coefficients[first : first + len(family.coefficient_names)]
        first += len(own)
        if (family.fresnel, family.masking) == ("schlick", "correlated"):
            lobes.append(_as_it_is(family, shape, own))
            continue
        nearest, error = _nearest(LobeSet((family,), (shape,)), own, order)
        coefficients += nearest.coefficients
        lobes.append(_weighted(nearest.lobes.shapes[0], nearest.lobe_coefficients, channels))
        missing += error**2
    return Represented(order, coefficients, tuple(lobes), np.sqrt(missing))


def _as_it_is(family: Family, shape: np.ndarray, own: np.ndarray) -> Lobe:
    if family.absolute:
        return Lobe(roughness=float(shape[0]), f0=own[0], weight=np.ones_like(own[0]))
    return _weighted(shape, own, own.shape[1])


def _weighted(shape: np.ndarray, own: np.ndarray, channels: int) -> Lobe:
    """The lobe whose constant and grazing parts are ``own`` (2, c or 1): weight f0 and weight (1 - f0)."""
    weight = own.sum(0)
    f0 = np.divide(own[0], weight, out=np.zeros_like(weight), where=weight > 0.0)
    return Lobe(
        roughness=float(shape[0]),
        f0=np.broadcast_to(f0, channels).copy(),
        weight=np.broadcast_to(weight, channels).copy(),
    )


def _nearest(lobe: LobeSet, own: np.ndarray, order: int) -> tuple[Model, np.ndarray]:
    """The file's lobe and modes nearest to ``lobe`` with coefficients ``own`` (q, c), and the rms miss (c,) or (1,)."""
    grid, weight = _grid()
    fixed, columns = lobe.columns(grid)
    wanted = fixed[:, None] + columns @ own if len(own) else fixed[:, None]
    basis = Basis("isotropic", order)
    emphasis = weight * (BEYOND + _fade(grid.theta_i) * _fade(grid.theta_r))
    penalty = np.tile(PENALTY * emphasis.sum() * basis.degree() ** 2, (wanted.shape[1], 1))
    weights = np.repeat(emphasis[:, None], wanted.shape[1], 1)
    profile = Profile(grid.with_value(wanted), basis.design(grid), weights, penalty)
    start = LobeSet((FILE_FAMILY,), (lobe.shapes[0][:1],))
    found = Model(basis, *profile.model_parts(descend(profile, start, FINE)))
    inside = (grid.theta_i < JUDGED) & (grid.theta_r < JUDGED)
    miss = (found.evaluate(grid) - wanted)[inside]
    return found, np.sqrt(np.average(miss**2, axis=0, weights=weight[inside]))


def _fade(theta: np.ndarray) -> np.ndarray:
    return 1.0 / (1.0 + np.exp((theta - FADE) / FADE_WIDTH))


@lru_cache(maxsize=1)
def _grid() -> tuple[Cells, np.ndarray]:
    """Pairs of directions and their weights cos_i cos_r dOmega_i dOmega_r, half of the symmetric pairs twice."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES[0])
    theta = np.arccos(0.5 * (nodes + 1.0))
    dphi = np.pi * (np.arange(NODES[1]) + 0.5) / NODES[1]
    i, r, k = (
        a.ravel() for a in np.meshgrid(np.arange(len(theta)), np.arange(len(theta)), np.arange(len(dphi)))
    )
    half = i >= r
    i, r, k = i[half], r[half], k[half]
    weight = weights[i] * weights[r] * np.cos(theta[i]) * np.cos(theta[r]) * np.where(i == r, 1.0, 2.0)
    return Cells.of_angles(theta[i], theta[r], dphi[k]), weight
