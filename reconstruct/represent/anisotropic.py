"""Lobes of two roughnesses in the terms of the file's first version: isotropic lobes, and modes that turn.

What such a lobe is on the mean over all turns is nearest to the isotropic lobe of its mean roughness; the rest, a
ridge that points along the sample, can only be said in modes, and its width decides how many. Over a product of two
hemispheres least squares with product weights factorise: with the modes' matrix Z of one hemisphere, those of f are
H f H^T with H = (Z^T w Z + penalty)^-1 Z^T w. Nodes are even in azimuth, so that in waves around Z falls apart into a
small matrix a wave, and sums of squares stay what they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.optimize import nnls

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.lobes.lobe import Lobe
from photogonio.reconstruct.modes.transform import pair_coefficients
from photogonio.reconstruct.modes.zernike import (
    azimuth_sequence,
    elevation_sequence,
    radial_index,
    zernike_index,
    zernike_orders,
)
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
    """Polar angles of a rule, waves around, and the modes there, up to an order.

    Values are (..., w, t, w', t'), by wave and polar angle of the incident direction, then of the exit one: see
    :func:`_in_waves`. The modes' waves stand in the midst of all.
    """

    weight: np.ndarray  # (t,) cosine weighted
    emphasis: np.ndarray  # (t,) the same, less where few photos see
    modes: (
        np.ndarray
    )  # (m, t, r) of each wave up to the order, with 0 where a wave has fewer modes than others
    analysis: np.ndarray  # (m, r, t) values to coefficients
    places: np.ndarray  # (m, r) OSA/ANSI indices of the modes; -1 of none

    def rest(self, values: np.ndarray) -> np.ndarray:
        """What of values the modes do not hold."""
        found = values.copy()
        found[self._own] -= _both(self.modes, self._within(values))
        return found

    def coefficients(self, values: np.ndarray) -> np.ndarray:
        """(..., j, j) of values."""
        within, held = self._within(values), self.places >= 0
        places = self.places[held]
        found = np.zeros((*values.shape[:-4], len(places), len(places)))
        picked = within.reshape(*values.shape[:-4], held.size, held.size)[..., held.ravel(), :][
            ..., held.ravel()
        ]
        found[..., places[:, None], places] = picked
        return found

    def gram(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """(k, l) weighted inner products of values (k, ...) and (l, ...)."""
        weighted = a * (self.emphasis[:, None, None] * self.emphasis)
        return weighted.reshape(len(a), -1) @ b.reshape(len(b), -1).T

    def _within(self, values: np.ndarray) -> np.ndarray:
        """(..., m, r, m, r) coefficients."""
        return _both(self.analysis, values[self._own])

    @property
    def _own(self) -> Any:
        """Where the modes' waves are."""
        order = len(self.modes) // 2
        own = slice(NODES[1] // 2 - order, NODES[1] // 2 + order + 1)
        return (..., own, slice(None), own, slice(None))


def _both(matrices: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(..., m, b, m, b): matrices (m, b, a) on either direction of values (..., m, a, m, a)."""
    waves, into, of = matrices.shape
    lead = values.shape[:-4]
    first = np.matmul(matrices, values.reshape(*lead, waves, of, waves * of))
    first = first.reshape(*lead, waves * into, waves, of)
    both = np.matmul(np.moveaxis(first, -2, -3), matrices.swapaxes(-1, -2))
    return np.moveaxis(both, -3, -2).reshape(*lead, waves, into, waves, into)


Values = dict[object, np.ndarray]  # of lobes, whatever the order


def represent_turning(
    lobes: Sequence[Lobe],
    channels: int,
    order: int,
    symmetry: str,
    *,
    alone: bool = False,
    known: Values | None = None,
) -> Represented:
    """``lobes`` by modes of ``symmetry`` up to ``order`` and lobes of the first version; by modes ``alone`` if so.

    ``known`` keeps what the same lobes are worth from one order to another.
    """
    known = {} if known is None else known
    half = _hemisphere(order)
    count = int(half.places.max()) + 1
    matrix = np.zeros((channels, count, count))
    missing = np.zeros((channels, *2 * (NODES[1], NODES[0])))
    kept: list[Lobe] = []
    for k, lobe in enumerate(lobes):
        for j, (part, factors, is_ground) in enumerate(parts_of(lobe)):
            shapes = () if alone or is_ground else standing_for(lobe)
            found, coefficients, left = _nearest(half, _once(known, (k, j), part), shapes, known)
            matrix += np.einsum("kab,kc->cab", found, factors)
            missing += np.tensordot(factors, left, axes=(0, 0))
            kept += all_weighted(shapes, coefficients, factors)
    _, coefficients = pair_coefficients(symmetry, matrix)
    return Represented(order, coefficients, tuple(kept), _rms(half, missing))


def _once(known: Values, name: object, lobe: Lobe) -> np.ndarray:
    """:func:`_values` of a lobe."""
    if name not in known:
        known[name] = _values(lobe)
    return known[name]


def _nearest(half: _Hemisphere, lobe: np.ndarray, shapes: tuple[np.ndarray, ...], known: Values):
    """Modes (k, j, j), coefficients (2 lobes, k) of the first version's lobes, and what is missing of a lobe's values
    (k, ...)."""
    rest = half.rest(lobe)
    if not shapes:
        return half.coefficients(lobe), np.empty((0, len(lobe))), rest
    one = np.ones(1)
    columns = np.concatenate(
        [
            _once(known, (float(shape[0]), f0), Lobe(float(shape[0]), f0 * one, one))
            for shape in shapes
            for f0 in (1.0, 0.0)
        ]
    )
    file_rest = half.rest(columns)
    root = np.linalg.cholesky(half.gram(file_rest, file_rest))
    found = np.stack(
        [nnls(root.T, np.linalg.solve(root, moment))[0] for moment in half.gram(rest, file_rest)]
    )
    left = lobe - np.tensordot(found, columns, axes=1)
    missing = rest - np.tensordot(found, file_rest, axes=1)
    return half.coefficients(left), found.T, missing


def _values(lobe: Lobe) -> np.ndarray:
    """(c, w, t, w, t) of a lobe at all pairs of directions, in waves."""
    theta, phi = _nodes()
    azimuth = phi[:, None, None]
    return _in_waves(lobe.evaluate(theta[:, None, None, None], theta[:, None], phi - azimuth, azimuth))


def _in_waves(value: np.ndarray) -> np.ndarray:
    """(c, w, t, w', t') of values (t, p, t', p', c): the azimuths p of both directions as orthonormal waves, -1, -2 ...
    the sines, so that sums of squares stay."""
    waves, turns = _waves(), NODES[1]
    rows = np.ascontiguousarray(np.moveaxis(value, -1, 0))
    first = np.matmul(waves, rows.reshape(*rows.shape[:3], -1)).reshape(-1, turns) @ waves.T
    return np.ascontiguousarray(first.reshape(rows.shape).transpose(0, 2, 1, 4, 3))


def _rms(half: _Hemisphere, missing: np.ndarray) -> np.ndarray:
    """(c,) rms of values (c, ...), cosine weighted, both angles below 70 degrees."""
    weight = np.where(_nodes()[0] < JUDGED, half.weight, 0.0)
    weight = weight / (NODES[1] * weight.sum())
    return np.sqrt(np.einsum("k,cakbl,l->c", weight, missing**2, weight, optimize=True))


def typical(brdf: Brdf) -> np.ndarray:
    """(c,) rms of f by the measure of the representation error, 1/sr."""
    theta, phi = _nodes()
    value = brdf.evaluate(theta[:, None, None, None], phi[:, None, None], theta[:, None], phi)
    return _rms(_hemisphere(0), _in_waves(value))


def _nodes() -> tuple[np.ndarray, np.ndarray]:
    """Polar angles and azimuths, radians."""
    cos = 0.5 * (np.polynomial.legendre.leggauss(NODES[0])[0] + 1.0)
    return np.arccos(cos), 2.0 * np.pi * (np.arange(NODES[1]) + 0.5) / NODES[1]


@lru_cache(maxsize=1)
def _waves() -> np.ndarray:
    """(w, p) orthonormal, from -NODES[1] / 2 on; of the last cosine there is nothing at these azimuths."""
    found = azimuth_sequence(NODES[1] // 2, _nodes()[1])[:-1]
    return found / np.linalg.norm(found, axis=1, keepdims=True)


@lru_cache(maxsize=4)
def _hemisphere(order: int) -> _Hemisphere:
    theta = _nodes()[0]
    weight = np.polynomial.legendre.leggauss(NODES[0])[1] * np.cos(theta)
    emphasis = weight * (BEYOND + fade(theta))
    radial = np.sqrt(NODES[1]) * elevation_sequence(order, theta)
    modes = np.zeros((2 * order + 1, len(theta), order // 2 + 1))
    places = np.full((2 * order + 1, order // 2 + 1), -1)
    for wave, l in enumerate(range(-order, order + 1)):
        n = np.arange(abs(l), order + 1, 2)
        modes[wave, :, : len(n)] = radial[radial_index(n, np.full_like(n, l))].T
        places[wave, : len(n)] = zernike_index(n, l)
    gram = modes.swapaxes(1, 2) @ (emphasis[:, None] * modes)
    n = zernike_orders(np.maximum(places, 0))[0]
    mean = gram.trace(axis1=1, axis2=2).sum() / (places >= 0).sum()
    penalty = np.where(places < 0, mean, PENALTY * mean * (n * (n + 2) / 8.0) ** 2)  # none there to be found
    analysis = np.linalg.solve(
        gram + penalty[:, :, None] * np.eye(penalty.shape[1]), modes.swapaxes(1, 2) * emphasis
    )
    return _Hemisphere(weight, emphasis, modes, analysis, places)
