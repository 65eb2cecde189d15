"""A BRDF as modes and GGX lobes alone, or as modes alone: what other programs know, and what is lost by it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.lobe_schema import is_of_first_version
from photogonio.reconstruct.brdf.parameters import either_side, named_number
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.modes.transform import pair_coefficients, pair_matrix
from photogonio.reconstruct.represent.anisotropic import Values, represent_turning, typical
from photogonio.reconstruct.represent.isotropic import Represented, represent

# orders tried, each only while the loss of the last is larger: narrow glosses are worth modes beyond 16
FINER = ((8, 0.001), (12, 0.001), (16, 0.001), (20, 0.003), (24, 0.003))
FINER_TURNING = tuple((order, 0.025) for order in (8, 12, 16, 20, 24))  # a ridge of 0.15 takes the last
HIGHEST, HIGHEST_TURNING = 64, 24  # a turning one to order 24 has up to 26,000 modes
NOTHING = 1e-5  # of the largest coefficient


@dataclass(frozen=True, slots=True)
class Developed:
    """A BRDF of the file's first version."""

    brdf: Brdf
    loss: np.ndarray  # (c,) rms of what is lost over that of f, cosine weighted, both angles below 70 degrees
    size: np.ndarray  # (c,) that rms of f, 1/sr; NaN where nothing is lost


def developed(brdf: Brdf, order: int | None = None, *, alone: bool = False) -> Developed:
    """``brdf`` with lobes of the file's first version, or with modes ``alone``, and modes up to ``order``, or as few as
    say it closely.

    Raises:
        InputError: ``order`` is below that of the BRDF's own modes or too high, or its quantity holds a cosine.
    """
    foreign = tuple(lobe for lobe in brdf.lobes if alone or not is_of_first_version(lobe))
    if not foreign and order is None:
        nothing = np.zeros(len(brdf.channels))
        return Developed(_first(brdf), nothing, np.full_like(nothing, np.nan))
    if brdf.quantity != "brdf" and foreign:
        raise InputError("--format modes", f"cannot develop lobes beside modes of {brdf.quantity}")
    brdf = _turned(brdf) if brdf.turning else brdf
    highest = HIGHEST_TURNING if brdf.turning else HIGHEST
    if order is not None and not brdf.order <= order <= highest:
        raise InputError(
            f"--order {order}", f"expected {brdf.order}, that of the BRDF's own modes, to {highest}"
        )
    size = np.maximum(typical(brdf), np.finfo(float).tiny)
    found, loss = _said(brdf, foreign, order, alone, size)
    own = tuple(lobe for lobe in brdf.lobes if not _is_among(lobe, foreign))
    errors = _errors(brdf, foreign, found, alone)
    return Developed(_joined(brdf, found, own + found.lobes, errors), loss, size)


def _first(brdf: Brdf) -> Brdf:
    """The same in the first version, which knows no covariance."""
    return replace(brdf, version=1, uncertainty=None)


def _represented(
    brdf: Brdf, lobes: tuple[Lobe, ...], order: int, alone: bool, known: Values | None = None
) -> Represented:
    channels = len(brdf.channels)
    if brdf.turning:
        return represent_turning(lobes, channels, order, brdf.symmetry, alone=alone, known=known)
    return represent(lobes, channels, order, alone=alone)


def _said(
    brdf: Brdf, lobes: tuple[Lobe, ...], order: int | None, alone: bool, size: np.ndarray
) -> tuple[Represented, np.ndarray]:
    """The lobes at the order asked for, or at the first that is close, and the loss over ``size``."""
    if order is not None:
        found = _represented(brdf, lobes, order, alone)
        return found, found.missing / size
    finer, tried = FINER_TURNING if brdf.turning else FINER, dict[int, Represented]()
    known: Values = {}

    def at(step: int) -> Represented:
        order = max(finer[step][0], brdf.order)
        if order not in tried:
            tried[order] = _represented(brdf, lobes, order, alone, known)
        return tried[order]

    low, high = 0, len(finer) - 1
    while low < high:  # the loss falls with the order, and the highest orders take most of the time
        middle = (low + high) // 2
        far = (at(middle).missing / size).max() > finer[middle + 1][1]
        low, high = (middle + 1, high) if far else (low, middle)
    return at(low), at(low).missing / size


def _joined(brdf: Brdf, found: Represented, lobes: tuple[Lobe, ...], errors: np.ndarray) -> Brdf:
    """The BRDF's own modes and those that stand for lobes, without those that say nothing."""
    modes = Basis(brdf.symmetry, found.order).modes
    coefficients = found.coefficients.copy()
    own = _places(brdf, modes)
    coefficients[own] += brdf.coefficients
    size = np.abs(coefficients).max(1)
    kept = size > (NOTHING * size.max() if brdf.turning else -1.0)
    kept[own] = True
    return replace(
        _first(brdf),
        order=found.order,
        modes=modes[kept],
        coefficients=coefficients[kept],
        standard_errors=errors[kept],
        lobes=lobes,
    )


def _places(brdf: Brdf, modes: np.ndarray) -> np.ndarray:
    """(m,) where the BRDF's modes stand among ``modes``."""
    where = {tuple(row): k for k, row in enumerate(modes.tolist())}
    return np.array([where[tuple(row)] for row in brdf.modes.tolist()], int)


def _errors(brdf: Brdf, lobes: tuple[Lobe, ...], found: Represented, alone: bool) -> np.ndarray:
    """(m, c) standard errors of the developed modes: of the own, and of what the lobes' numbers put into them; NaN
    where the surface turns and lobes are developed."""
    modes = Basis(brdf.symmetry, found.order).modes
    own = _places(brdf, modes)
    known, nothing = brdf.uncertainty, np.zeros((len(modes), len(brdf.channels)))
    if known is None or not lobes:
        nothing[own] = brdf.standard_errors
        return nothing
    if brdf.turning:
        return np.full_like(nothing, np.nan)
    changes = np.zeros((len(known.parameters), *nothing.shape))
    for p, name in enumerate(known.parameters):
        if p < len(own):
            changes[p, own[p]] = 1.0
            continue
        place, what = named_number(name, brdf.lobes)
        if not _is_among(brdf.lobes[place], lobes):
            continue
        less, more, between = either_side(brdf.lobes[place], what)
        ends = [_represented(brdf, (one,), found.order, alone).coefficients for one in (less, more)]
        changes[p] = (ends[1] - ends[0]) / between
    variance = np.einsum("pmc,cpq,qmc->mc", changes, known.spread(), changes, optimize=True)
    return np.hypot(np.sqrt(np.maximum(variance, 0.0)), known.scale * np.abs(found.coefficients))


def _is_among(lobe: Lobe, lobes: tuple[Lobe, ...]) -> bool:
    return any(lobe is one for one in lobes)


def _turned(brdf: Brdf) -> Brdf:
    """The same with reciprocal or general modes."""
    if brdf.symmetry != "isotropic":
        return brdf
    modes, coefficients = pair_coefficients(
        "reciprocal", pair_matrix("isotropic", brdf.modes, brdf.coefficients)
    )
    return replace(
        brdf,
        symmetry="reciprocal",
        modes=modes,
        coefficients=coefficients,
        standard_errors=np.full_like(coefficients, np.nan),
        uncertainty=None,
    )
