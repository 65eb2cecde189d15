"""A BRDF in the terms of the file's first version: height-correlated Schlick lobes of GGX with a weight, and modes.

What another lobe has beyond such a lobe of the same roughness goes into the modes, by least squares over the whole
hemisphere of pairs. There is no noise in this, so its order may be higher than the order of the fit; what still
remains is the representation error, and it is stated.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from photogonio.reconstruct.estimate.folded_design import FoldedDesign
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.normal_equations import Factors, solve
from photogonio.reconstruct.lobes.families import Family
from photogonio.reconstruct.lobes.lobe import Lobe
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
    """What is said of some lobes."""

    order: int
    coefficients: np.ndarray  # (m, c) of the basis up to ``order``
    lobes: tuple[Lobe, ...]  # of the first version
    missing: np.ndarray  # (c,) rms of what is not said, cosine weighted, both angles below 70 degrees, 1/sr


def represent(lobes: Sequence[Lobe], channels: int, order: int, *, alone: bool = False) -> Represented:
    """Isotropic ``lobes`` by modes up to ``order`` and lobes of the first version; by modes ``alone`` if asked."""
    peak = _narrowest(lobes)
    grid, _ = _grid(peak)
    total = np.zeros((len(Basis("isotropic", order).modes), channels))
    kept, missing = [], np.zeros((len(grid), channels))
    for lobe in lobes:
        for part, factors, is_ground in parts_of(lobe):
            wanted = part.evaluate(grid.theta_i, grid.theta_r, grid.dphi)
            shapes = () if alone or is_ground else standing_for(lobe)
            found = _closest(wanted, LobeSet((FILE_FAMILY,) * len(shapes), shapes), order, peak)
            total += found.coefficients @ factors
            missing += (found.evaluate(grid) - wanted) @ factors
            kept += all_weighted(shapes, found.lobe_coefficients, factors)
    judged = _judged(peak)
    return Represented(order, total, tuple(kept), np.sqrt(np.average(missing**2, axis=0, weights=judged)))


def parts_of(lobe: Lobe) -> Iterator[tuple[Lobe, np.ndarray, bool]]:
    """Parts of a lobe, each a lobe of k channels with factors (k, c) to its own, and whether it is a ground alone: what
    all channels share is said alike in all."""
    if lobe.fresnel != "dielectric" and not lobe.peak:
        yield lobe, np.eye(len(lobe.weight)), False
        return
    one, nothing = np.ones(1), np.zeros(1)
    ground = None if lobe.ground is None else nothing
    yield replace(lobe, f0=lobe.f0[:1], weight=one, ground=ground), lobe.weight[None], False
    if lobe.ground is not None:
        yield replace(lobe, f0=lobe.f0[:1], weight=nothing, ground=one), lobe.ground[None], True


def all_weighted(shapes: tuple[np.ndarray, ...], coefficients: np.ndarray, factors: np.ndarray) -> list[Lobe]:
    """Lobes of roughnesses ``shapes`` with ``coefficients`` (2 lobes, k), times ``factors`` (k, c); none that is
    nothing."""
    pairs = np.split(coefficients @ factors, len(shapes)) if shapes else []
    return [_weighted(shape, own) for shape, own in zip(shapes, pairs, strict=True) if own.any()]


def _weighted(shape: np.ndarray, own: np.ndarray) -> Lobe:
    """The lobe whose constant and grazing parts are ``own`` (2, c): weight f0 and weight (1 - f0)."""
    weight = own.sum(0)
    f0 = np.divide(own[0], weight, out=np.zeros_like(weight), where=weight > 0.0)
    return Lobe(roughness=float(shape[0]), f0=f0, weight=weight)


def _narrowest(lobes: Sequence[Lobe]) -> float | None:
    """The least roughness; None if the usual nodes resolve them all."""
    least = min((lobe.mean_roughness for lobe in lobes), default=WIDE)
    return least if least < WIDE else None


def standing_for(lobe: Lobe) -> tuple[np.ndarray, ...]:
    """Roughnesses (1,) of the first version's lobes that another is said by, beside modes; none of a peak about the
    light itself."""
    if lobe.model == "retro":
        return ()
    ratios = (1.0,) if lobe.turning else RATIOS[lobe.distribution]
    return tuple(np.array([min(lobe.mean_roughness * ratio, 1.0)]) for ratio in ratios)


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
