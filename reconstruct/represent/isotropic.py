"""A fitted model in the coefficient file's terms: height-correlated Schlick lobes with a weight, and modes.

What a lobe of another family has beyond the file's lobe of the same roughness goes into the modes, by least squares
over the whole hemisphere of pairs. There is no noise in this, so its order may be higher than the order of the fit;
what still remains is the representation error, and it is reported.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from photogonio.reconstruct.brdf.brdf import Lobe
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.normal_equations import Factors, FoldedDesign, solve
from photogonio.reconstruct.lobes.families import Family, lobe_columns
from photogonio.reconstruct.modes.angles import (
    from_half_difference,
    half_difference,
    pair_angles,
    unit_vectors,
)
from photogonio.reconstruct.table.cells import Cells

FILE_FAMILY = Family("file", "schlick", "correlated", absolute=False)
JUDGED = np.radians(70.0)  # the error is stated below it
FADE = np.radians(76.0)  # beyond it the lobe counts less: few photos see it and few pictures show it
FADE_WIDTH = np.radians(2.5)
NOTHING = 1e-5  # of the largest coefficient
BEYOND = 0.02  # weight of what lies beyond, against 1
PENALTY = 1e-8  # of the weight's sum: keeps fine modes from trading places
# roughness of the file's lobes that stand for one it does not know, over its own; its own first
RATIOS = {"ggx": (1.0, 0.7, 1.25), "beckmann": (0.8, 1.1, 1.4)}
NODES = (28, 40)  # Gauss nodes in cos theta, midpoints in dphi
# about the mirror direction: Gauss nodes from the peak on, in cos theta_difference, and in phi_difference
PEAK_NODES = (24, 20, 8)
WIDE = 0.3  # roughness from which on the nodes of all directions resolve a lobe
REACH = 4.0  # roughnesses from the peak, where nodes about it and those of all directions count alike
LEAST_REACH = 0.2  # of the half vector's slope: what the nodes of all directions resolve


@dataclass(frozen=True, slots=True)
class Represented:
    """The model as the file says it."""

    order: int
    coefficients: np.ndarray  # (m, c) of the isotropic basis up to ``order``
    lobes: tuple[Lobe, ...]
    error: np.ndarray  # (c,) rms of what is missing, cosine weighted, both angles below 70 degrees, 1/sr

    def rows(self, kept: int) -> np.ndarray:
        """(k,) places of the modes that say anything, and of the first ``kept`` whatever they say."""
        size = np.abs(self.coefficients).max(1)
        return np.flatnonzero((size > NOTHING * size.max()) | (np.arange(len(size)) < kept))


def represent(model: Model, order: int) -> Represented:
    """An isotropic ``model`` in the file's terms with modes up to ``order``, no less than the model's own."""
    channels, peak = model.coefficients.shape[1], _narrowest(model.lobes)
    coefficients = np.zeros((len(Basis("isotropic", order).modes), channels))
    coefficients[: len(model.coefficients)] = model.coefficients
    lobes: list[Lobe] = []
    missing: np.ndarray | float = 0.0
    first = 0
    for family, shape in zip(model.lobes.families, model.lobes.shapes, strict=True):
        own = model.lobe_coefficients[first : first + len(family.coefficient_names)]
        first += len(own)
        if family.in_file:
            lobes.append(as_it_is(family, shape, own))
            continue
        nearest = _nearest(family, shape, own, order, peak)
        coefficients += nearest.coefficients
        lobes += all_weighted(nearest.shapes, nearest.lobe_coefficients, channels)
        missing = missing + nearest.missing
    judged = _judged(peak)
    error = np.zeros(channels)
    if np.ndim(missing):
        error[:] = np.sqrt(np.average(missing**2, axis=0, weights=judged[judged > 0.0]))
    return Represented(order, coefficients, tuple(lobes), error)


def as_it_is(family: Family, shape: np.ndarray, own: np.ndarray) -> Lobe:
    if family.retro:
        return Lobe(float(shape[0]), np.ones_like(own[0]), own[0], family.name)
    if family.absolute:
        return Lobe(roughness=float(shape[0]), f0=own[0], weight=np.ones_like(own[0]))
    return _weighted(shape, own, own.shape[1])


def all_weighted(shapes: tuple[np.ndarray, ...], coefficients: np.ndarray, channels: int) -> list[Lobe]:
    """The file's lobes of roughnesses ``shapes`` with ``coefficients`` (2 lobes, c or 1); none that is nothing."""
    pairs = np.split(coefficients, len(shapes))
    return [
        _weighted(shape, own, channels)
        for shape, own in zip(shapes, pairs, strict=True)
        if own.any() or len(pairs) == 1
    ]


def _weighted(shape: np.ndarray, own: np.ndarray, channels: int) -> Lobe:
    """The lobe whose constant and grazing parts are ``own`` (2, c or 1): weight f0 and weight (1 - f0)."""
    weight = own.sum(0)
    f0 = np.divide(own[0], weight, out=np.zeros_like(weight), where=weight > 0.0)
    return Lobe(
        roughness=float(shape[0]),
        f0=np.broadcast_to(f0, channels).copy(),
        weight=np.broadcast_to(weight, channels).copy(),
    )


@dataclass(frozen=True, slots=True)
class _Nearest:
    coefficients: np.ndarray  # (m, c or 1)
    shapes: tuple[np.ndarray, ...]  # (1,) roughness of each lobe
    lobe_coefficients: np.ndarray  # (2 lobes, c or 1) of the file's family
    missing: np.ndarray  # (k, c or 1) at the nodes below the limit


def _narrowest(lobes: LobeSet) -> float | None:
    """The least roughness of the lobes that the file does not know; None if the usual nodes resolve them all."""
    foreign = [
        float(shape[0])
        for family, shape in zip(lobes.families, lobes.shapes, strict=True)
        if not family.in_file
    ]
    return min(foreign) if min(foreign, default=WIDE) < WIDE else None


def _nearest(family: Family, shape: np.ndarray, own: np.ndarray, order: int, peak: float | None) -> _Nearest:
    """The file's lobes of about the same roughness, and modes, nearest to a lobe with coefficients ``own`` (q, c), on
    nodes that resolve a ``peak`` of that roughness.

    A ground under the lobe is said by modes alone, so that all channels keep the same lobe.
    """
    grid, _ = _grid(peak)
    fixed, columns = lobe_columns(family, shape, grid.theta_i, grid.theta_r, grid.dphi)
    lobes = len(own) - family.has_ground
    wanted = fixed[:, None] + columns[:, :lobes] @ own[:lobes] if lobes else fixed[:, None]
    shapes = standing_for(family, shape)
    found = _closest(wanted, LobeSet((FILE_FAMILY,) * len(shapes), shapes), order, peak)
    missing = found.evaluate(grid) - wanted
    coefficients = found.coefficients
    if family.has_ground:
        ground = _closest(columns[:, lobes:], LobeSet(), order, peak)
        coefficients = coefficients + ground.coefficients @ own[lobes:]
        missing = missing + (ground.evaluate(grid) - columns[:, lobes:]) @ own[lobes:]
    return _Nearest(coefficients, shapes, found.lobe_coefficients, missing[_judged(peak) > 0.0])


def standing_for(family: Family, shape: np.ndarray) -> tuple[np.ndarray, ...]:
    """Roughnesses (1,) of the file's lobes that a lobe of another family is said by, beside modes."""
    ratios = (1.0,) if family.turning else RATIOS[family.distribution]
    return tuple(np.minimum(shape[:1] * ratio, 1.0) for ratio in ratios)


def _closest(wanted: np.ndarray, lobes: LobeSet, order: int, peak: float | None) -> Model:
    """Modes up to ``order`` and ``lobes`` with the coefficients that come closest to ``wanted`` (n, c) on the grid."""
    folded, factors = _grid_fit(order, peak)
    fixed, columns = lobes.columns(_grid(peak)[0])
    statistics = folded.statistics(wanted - fixed[:, None], columns)
    solution = solve(statistics, factors, lobes.upper_bounds())[0]
    modes, own = np.split(solution.T, [statistics.modes])
    return Model(Basis("isotropic", order), modes, lobes, own)


@lru_cache(maxsize=4)
def _grid_fit(order: int, peak: float | None) -> tuple[FoldedDesign, Factors]:
    """What all fits on the grid with modes up to ``order`` share, whatever the lobes and the channel."""
    grid, weight = _grid(peak)
    basis = Basis("isotropic", order)
    emphasis = weight * (BEYOND + fade(grid.theta_i) * fade(grid.theta_r))
    folded = FoldedDesign(basis.design(grid), emphasis[:, None], np.zeros(len(grid), int))
    penalty = PENALTY * emphasis.sum() * basis.degree()[None] ** 2
    return folded, Factors(folded.modes_gram, penalty)


def _judged(peak: float | None) -> np.ndarray:
    """(n,) weight of the grid's nodes in the stated error: 0 beyond the limit."""
    grid, weight = _grid(peak)
    return np.where(np.maximum(grid.theta_i, grid.theta_r) < JUDGED, weight, 0.0)


def fade(theta: np.ndarray) -> np.ndarray:
    return 1.0 / (1.0 + np.exp((theta - FADE) / FADE_WIDTH))


@lru_cache(maxsize=2)
def _grid(peak: float | None) -> tuple[Cells, np.ndarray]:
    """Pairs of directions and their weights cos_i cos_r dOmega_i dOmega_r / (4 pi): of all directions, and where a lobe
    has a ``peak`` of such roughness, of those about the mirror direction. Both share what lies between."""
    everywhere, weight = _all_directions()
    if peak is None:
        return everywhere, weight
    reach = max(REACH * peak, LEAST_REACH)
    half = half_difference(
        unit_vectors(everywhere.theta_i, 0.0), unit_vectors(everywhere.theta_r, everywhere.dphi)
    )[0]
    about, near = _about_mirror(reach)
    angles = [
        np.concatenate([getattr(one, name) for one in (everywhere, about)])
        for name in ("theta_i", "theta_r", "dphi")
    ]
    return Cells.of_angles(*angles), np.concatenate([weight * (1.0 - _share_of_peak(half, reach)), near])


def _share_of_peak(theta_h: np.ndarray, reach: float) -> np.ndarray:
    """What nodes about the mirror direction count, (n,); those of all directions count the rest."""
    return 1.0 / (1.0 + (np.tan(theta_h) / reach) ** 4)


@lru_cache(maxsize=1)
def _all_directions() -> tuple[Cells, np.ndarray]:
    """Pairs of directions and their weights, half of the symmetric pairs twice."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES[0])
    theta, weights = np.arccos(0.5 * (nodes + 1.0)), 0.5 * weights
    dphi = np.pi * (np.arange(NODES[1]) + 0.5) / NODES[1]
    i, r, k = (
        a.ravel() for a in np.meshgrid(np.arange(len(theta)), np.arange(len(theta)), np.arange(len(dphi)))
    )
    half = i >= r
    i, r, k = i[half], r[half], k[half]
    weight = weights[i] * weights[r] * np.cos(theta[i]) * np.cos(theta[r]) * np.where(i == r, 1.0, 2.0)
    return Cells.of_angles(theta[i], theta[r], dphi[k]), np.pi / NODES[1] * weight


def _about_mirror(reach: float) -> tuple[Cells, np.ndarray]:
    """The same about the mirror direction: Gauss nodes u of the half vector, tan^2 theta_h = reach^2 u / (1 - u), of
    which the inner ones lie within the narrowest peak, by all differences (Rusinkiewicz 1998) that mirror images and
    exchange of the directions leave."""
    (u, wu), (cos_d, wd), (turn, wt) = (np.polynomial.legendre.leggauss(count) for count in PEAK_NODES)
    u, cos_d, turn = (0.5 * (one + 1.0) for one in (u, cos_d, turn))
    tan = reach * np.sqrt(u / (1.0 - u))
    # sin theta_h dtheta_h = tan dtan / (1 + tan^2)^(3/2), and dtan^2 = reach^2 du / (1 - u)^2
    wu = (
        0.5
        * wu
        * 0.5
        * (reach / (1.0 - u)) ** 2
        / (1.0 + tan**2) ** 1.5
        * _share_of_peak(np.arctan(tan), reach)
    )
    grid = np.meshgrid(np.arctan(tan), np.arccos(cos_d), 0.5 * np.pi * turn, indexing="ij")
    theta_h, theta_d, phi_d = (one.ravel() for one in grid)
    # dOmega_r = 4 cos_d dOmega_h; over a fourth of phi_d's turn, and all of the half vector's: 4 (4 2 pi) / (4 pi)
    weight = np.einsum("u,d,t->udt", wu, 0.5 * wd * cos_d, 0.25 * np.pi * wt).ravel() * 8.0
    incident, exit = from_half_difference(theta_h, theta_d, phi_d)
    weight *= incident[:, 2] * exit[:, 2]
    up = (incident[:, 2] > 0.0) & (exit[:, 2] > 0.0)
    theta_i, theta_r, dphi = pair_angles(incident[up], exit[up])
    return Cells.of_angles(theta_i, theta_r, np.abs(dphi)), weight[up]
