"""Modes that stand for lobes, held to the light that the lobes send out.

A series that is cut off rings, most toward grazing, and sends out more than its BRDF there. Taken away is p(i) + p(r),
the reciprocal sum of one power of 1 - cos theta of either direction, by no more than the excess asks for: of all
powers within the order, the one that costs f least.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.modes import integrals
from photogonio.reconstruct.modes.angles import spherical_angles
from photogonio.reconstruct.modes.basis import isotropic_design
from photogonio.reconstruct.modes.mirror_quadrature import around
from photogonio.reconstruct.modes.transform import pair_coefficients, pair_matrix
from photogonio.reconstruct.represent.isotropic import JUDGED

_ANGLES = np.radians([*range(0, 60, 10), *range(60, 75, 3), *range(75, 89)])
_TURNS = np.arange(16) * (2.0 * np.pi / 16)
_NODES = 24, 64  # of an albedo's quadrature
_SLACK = 0.002  # of an albedo, that may be added
_PARTS = 60  # of an interval, in a mean over it


def held(source: Brdf, found: Brdf) -> tuple[Brdf, np.ndarray]:
    """``found``, which stands for ``source``, without the light that it adds up to 88 degrees of incidence; and the
    rms (c,) of what was taken from f, cosine weighted, both angles below 70 degrees, 1/sr."""
    nothing = np.zeros(len(found.channels))
    if found.quantity != "brdf":
        return found, nothing
    turns = _TURNS if found.turning else np.zeros(1)
    there, here = (_sent(one, turns) for one in (found, source))
    excess = (there - (1.0 + _SLACK) * here).max(axis=1)  # (angles, c)
    if not (excess > 0.0).any():
        return found, nothing
    power = np.arange(found.order // 2 + 1)[:, None]
    # of p = u^k: what p(i) + p(r) sends out from each angle, (powers, angles)
    falls = np.pi * (1.0 - np.cos(_ANGLES)) ** power + 2.0 * np.pi / ((power + 1.0) * (power + 2.0))
    size = np.maximum((excess / falls[..., None]).max(axis=1), 0.0)  # (powers, c)
    best = np.argmin(size * _rms(power, 0.5 * np.pi), axis=0)
    taken = np.zeros_like(size)
    taken[best, np.arange(len(best))] = size[best, np.arange(len(best))]
    return _less(found, taken), (taken * _rms(power, JUDGED)).sum(axis=0)


def _sent(brdf: Brdf, turns: np.ndarray) -> np.ndarray:
    """(angles, turns, c) directional albedo: of modes in closed form, of lobes by quadrature."""
    value = integrals.directional_albedo(
        brdf.symmetry, brdf.modes, brdf.coefficients, brdf.quantity, _ANGLES[:, None], turns
    )
    for row, angle in zip(value, _ANGLES, strict=True):
        exit, weight = around(float(angle), *_NODES)
        theta, dphi = spherical_angles(exit)
        for lobe in brdf.lobes:
            for one, turn in zip(row, turns, strict=True):
                one += weight @ lobe.evaluate(angle, theta, dphi, turn)
    return value


def _rms(power: np.ndarray, limit: float) -> np.ndarray:
    """(powers, 1) of u^k(i) + u^k(r), cosine weighted, both angles below ``limit``."""
    u = (np.arange(_PARTS) + 0.5) / _PARTS * (1.0 - np.cos(limit))
    weight = (1.0 - u) / (1.0 - u).sum()
    mean, square = (weight @ (u ** (n * power)).T for n in (1, 2))
    return np.sqrt(2.0 * square + 2.0 * mean**2)[:, None]


def _less(brdf: Brdf, taken: np.ndarray) -> Brdf:
    """The BRDF less the sum over powers k of ``taken`` (powers, c) times u^k(i) + u^k(r)."""
    rows = Basis("isotropic", brdf.order).modes
    own = (rows[:, 1] == 0) & (rows[:, 2] == 0)
    u = (np.arange(len(taken) + 1) + 0.5) / (len(taken) + 1)
    first, second = (one.ravel() for one in np.meshgrid(u, u))
    design = isotropic_design(brdf.order, np.arccos(1.0 - first), np.arccos(1.0 - second), 0.0)[:, own]
    power = np.arange(len(taken))
    wanted = (first[:, None] ** power + second[:, None] ** power) @ taken
    modes, less = rows[own], -np.linalg.lstsq(design, wanted, rcond=None)[0]
    if brdf.symmetry != "isotropic":
        modes, less = pair_coefficients(brdf.symmetry, pair_matrix("isotropic", modes, less))
    return _plus(brdf, modes, less)


def _plus(brdf: Brdf, modes: np.ndarray, more: np.ndarray) -> Brdf:
    """The BRDF with coefficients ``more`` (m, c) of some modes added, which may be new ones."""
    where = {tuple(row): k for k, row in enumerate(brdf.modes.tolist())}
    some = more.any(axis=1)
    modes, more = modes[some], more[some]
    place = np.array([where.get(tuple(row), -1) for row in modes.tolist()])
    coefficients = brdf.coefficients.copy()
    coefficients[place[place >= 0]] += more[place >= 0]
    new = place < 0
    unsure = np.full((int(new.sum()), more.shape[1]), np.nan if np.isnan(brdf.standard_errors).any() else 0.0)
    return replace(
        brdf,
        modes=np.concatenate([brdf.modes, modes[new]]),
        coefficients=np.concatenate([coefficients, more[new]]),
        standard_errors=np.concatenate([brdf.standard_errors, unsure]),
    )
