"""Lobes that the coefficient file has no word for, said in modes: round peaks about the mirror direction, and cosine
powers of the half vector.

A round peak is smooth up to the horizon, so its expansion closes in on it as fast as a Gaussian's: to 0.2 % at an order
of three over its roughness. A cosine power is not where both directions graze, and its expansion closes in on it fast
below. The modes' covariance is what the peak's own numbers put into them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.covariance_file import MOST_INSIDE
from photogonio.reconstruct.brdf.errors import Uncertain
from photogonio.reconstruct.brdf.parameters import FULL, mode_names, named_number, rounded
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.lobes.schlick import blinn_phong
from photogonio.reconstruct.modes.basis import isotropic_norms
from photogonio.reconstruct.modes.quadrature import azimuth_rule, elevation_rule
from photogonio.reconstruct.modes.zernike import elevation_sequence, radial_index
from photogonio.reconstruct.table.cells import Cells

ORDERS = tuple(range(8, 49, 4))  # the first that is close is taken
SAID = ("round", "blinn-phong")  # models of lobes
# what may lie beyond the order: of the root of a peak's square over both hemispheres, of a cosine power's below JUDGED
# and cosine weighted
CLOSE = {"round": 0.002, "blinn-phong": 0.005}
JUDGED = np.radians(75.0)
DROPPED = 0.001  # of that of all modes: what those may hold that are not written
STEP = 1e-3  # of a roughness, in finite differences
QUANTUM = 1e-6  # of the largest coefficient: no finer digits are written
GATHERED = 1.5  # at the peak, by which what is left out exceeds waves of the last orders
MORE_NODES = 16  # of a rule than the order
JUDGED_NODES = (32, 48)  # of both polar angles, and of the azimuth


@dataclass(frozen=True, slots=True)
class SaidInModes:
    """A BRDF of lobes that the file has, and what was left out of those that it has not."""

    brdf: Brdf
    peaks: tuple[Lobe, ...] = ()  # that are modes now
    lost: float = 0.0  # of the root of their square over both hemispheres


def said_in_modes(brdf: Brdf) -> SaidInModes:
    """An isotropic ``brdf`` whose round peaks are modes, with their covariance and what they leave out."""
    peaks = tuple(lobe for lobe in brdf.lobes if lobe.model in SAID)
    if not peaks:
        return SaidInModes(brdf)
    order = max(brdf.order, *map(_order, peaks))
    lost = max(_beyond(peak, order) for peak in peaks)
    modes = Basis("isotropic", order).modes
    own = _places(brdf.modes, modes)
    whole = np.zeros((len(modes), len(brdf.channels)))
    for peak in peaks:
        whole += np.outer(_expansion(peak.model, peak.distribution, peak.axes[0], order)[0], peak.weight)
    size = np.linalg.norm(whole, axis=0)
    whole[own] += brdf.coefficients
    quantum = QUANTUM * np.abs(whole).max()
    whole = np.round(whole / quantum) * quantum
    dropped = max(DROPPED, 0.5 * lost)
    kept = _telling(whole, dropped)
    kept[own] = True
    lost = float(np.hypot(lost, dropped))
    found = replace(
        brdf,
        order=order,
        modes=modes[kept],
        coefficients=whole[kept],
        standard_errors=np.full_like(whole[kept], np.nan),
        lobes=tuple(lobe for lobe in brdf.lobes if lobe.model not in SAID),
        uncertainty=None,
    )
    if brdf.uncertainty is not None:
        uncertain = _uncertain(brdf, brdf.uncertainty, found, GATHERED * lost * size)
        errors = uncertain.standard_errors[: len(found.modes)]
        found = replace(found, uncertainty=uncertain, standard_errors=errors)
    return SaidInModes(found, peaks, lost)


def _order(peak: Lobe) -> int:
    """The first that is close."""
    return next((order for order in ORDERS if _beyond(peak, order) <= CLOSE[peak.model]), ORDERS[-1])


def _beyond(peak: Lobe, order: int) -> float:
    """What of the root of a peak's square lies beyond an order."""
    if peak.model == "blinn-phong":
        return _beyond_below(peak.axes[0], order)
    unit, square = _expansion(peak.model, peak.distribution, peak.axes[0], order)
    return float(np.sqrt(max(1.0 - unit @ unit / square, 0.0)))


@lru_cache(maxsize=32)
def _beyond_below(roughness: float, order: int) -> float:
    """The same of a cosine power, below :data:`JUDGED` and cosine weighted."""
    unit = _expansion("blinn-phong", "phong", roughness, order)[0]
    (node, share), (dphi, turn) = (
        np.polynomial.legendre.leggauss(JUDGED_NODES[0]),
        azimuth_rule(JUDGED_NODES[1]),
    )
    theta = 0.5 * JUDGED * (node + 1.0)
    grid = [one.ravel() for one in np.meshgrid(theta, theta, dphi, indexing="ij")]
    weight = share * np.sin(theta) * np.cos(theta)
    whole = np.einsum("i,r,d->ird", weight, weight, turn).ravel()
    f = blinn_phong(grid[0], grid[1], grid[2], roughness)
    missed = Basis("isotropic", order).evaluate(Cells.of_angles(*grid), unit[:, None])[:, 0] - f
    return float(np.sqrt((whole @ missed**2) / (whole @ f**2)))


@lru_cache(maxsize=32)
def _expansion(model: str, distribution: str, roughness: float, order: int) -> tuple[np.ndarray, float]:
    """(m,) coefficients of a peak of weight 1, and the integral of its square over both hemispheres."""
    peak = Lobe(roughness, np.ones(1), np.ones(1), model, distribution=distribution)
    nodes = max(order, ORDERS[-1]) + MORE_NODES
    theta, weight = elevation_rule(nodes)
    dphi, turn = azimuth_rule(2 * nodes)
    f = peak.evaluate(theta[:, None, None], theta[:, None], dphi)[..., 0]
    square = 4.0 * np.pi * np.einsum("i,r,d,ird->", weight, weight, turn, f**2, optimize=True)
    waves = np.einsum("ird,dl->lir", f, 2.0 * turn[:, None] * np.cos(np.outer(dphi, np.arange(order + 1))))
    radial, modes = elevation_sequence(order, theta) * weight, Basis("isotropic", order).modes
    norms, coefficients = isotropic_norms(modes), np.empty(len(modes))
    for l in range(order + 1):
        here = np.flatnonzero(modes[:, 2] == l)
        n = np.arange(l, order + 1, 2)
        part = radial[radial_index(n, np.full_like(n, l))]
        product = part @ waves[l] @ part.T
        first, second = (modes[here, :2].T - l) // 2
        both = product[first, second] + product[second, first]
        coefficients[here] = 2.0 * np.pi * norms[here] * both
    return coefficients, float(square)


def _telling(coefficients: np.ndarray, dropped: float) -> np.ndarray:
    """(m,) modes without the smallest, that hold less than ``dropped`` of the root of any channel's square."""
    squares = coefficients**2 / np.maximum(np.sum(coefficients**2, axis=0), np.finfo(float).tiny)
    largest = squares.max(axis=1)
    order = np.argsort(largest, kind="stable")
    small = np.cumsum(squares[order], axis=0).max(axis=1) <= dropped**2
    kept = np.ones(len(largest), bool)
    kept[order[small]] = False
    return kept


def _places(modes: np.ndarray, among: np.ndarray) -> np.ndarray:
    """(m,) where ``modes`` stand ``among`` others."""
    where = {tuple(row): k for k, row in enumerate(among.tolist())}
    return np.array([where[tuple(row)] for row in modes.tolist()], int)


def _uncertain(brdf: Brdf, known: Uncertain, found: Brdf, lost: np.ndarray) -> Uncertain:
    """How sure ``found`` is, whose modes also say the round peaks of ``brdf``: J C J^T, and what lies beyond them, of
    root mean square ``lost`` (c,)."""
    own, count, channels = _places(brdf.modes, found.modes), len(found.modes), len(brdf.channels)
    rest = [p for p, name in enumerate(known.parameters) if p >= len(own) and not _of_peak(brdf, name)]
    change = np.zeros((channels, count + len(rest), len(known.parameters)))
    change[:, own, np.arange(len(own))] = 1.0
    change[:, count + np.arange(len(rest)), rest] = 1.0
    for p, name in enumerate(known.parameters):
        if p >= len(own) and p not in rest:
            change[:, :count, p] = _slopes(found, *_peak_and_number(brdf, name)).T
    covariance = change @ known.spread() @ np.swapaxes(change, 1, 2)
    covariance[:, :count, :count] += _spread_of_lost(found, lost)
    errors = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0.0)).T
    place = np.cumsum([lobe.model not in SAID for lobe in brdf.lobes]) - 1
    lobes = [(place[named_number(known.parameters[p], brdf.lobes)[0]], known.parameters[p]) for p in rest]
    names = [f"lobe {k} {name.split(maxsplit=2)[2]}" for k, name in lobes]
    parameters = (*mode_names("isotropic", found.modes), *names)
    short = (
        covariance.astype(np.float32).astype(float)
        if len(parameters) > MOST_INSIDE
        else rounded(covariance, FULL)
    )
    return replace(known, parameters=parameters, standard_errors=rounded(errors), covariance=short)


def _spread_of_lost(found: Brdf, lost: np.ndarray) -> np.ndarray:
    """(c, m, m) covariance of modes whose waves are like those which the highest orders leave out, and as large as
    ``lost`` (c,): those of the last two orders and of the two before, each up or down as a whole, as they add up at the
    peak."""
    below = found.order - found.modes[:, 0]
    waves = np.array([found.coefficients * (below // 2 == k)[:, None] for k in range(2)])
    size = np.sqrt(np.sum(waves**2, axis=(0, 1)))
    waves *= lost / np.maximum(size, np.finfo(float).tiny)
    return np.einsum("spc,sqc->cpq", waves, waves)


def _peak_and_number(brdf: Brdf, name: str) -> tuple[Lobe, str]:
    place, what = named_number(name, brdf.lobes)
    return brdf.lobes[place], what


def _of_peak(brdf: Brdf, name: str) -> bool:
    """Whether a number is one of a peak that modes say."""
    return _peak_and_number(brdf, name)[0].model in SAID


def _slopes(found: Brdf, peak: Lobe, what: str) -> np.ndarray:
    """(m, c) derivatives of the modes of ``found`` by a number of a peak that they say."""
    place, alpha = _places(found.modes, Basis("isotropic", found.order).modes), peak.axes[0]

    def unit(roughness: float) -> np.ndarray:
        return _expansion(peak.model, peak.distribution, roughness, found.order)[0][place]

    if what == "weight":
        return np.repeat(unit(alpha)[:, None], len(peak.weight), axis=1)
    step = STEP * alpha
    return np.outer((unit(alpha + step) - unit(alpha - step)) / (2.0 * step), peak.weight)
