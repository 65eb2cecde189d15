"""Surface scattering modes: orthonormal bases on pairs of directions, their design matrices and their sums.

Isotropic:  S_nm^l = [Theta_n^l(i) Theta_m^l(r) + Theta_m^l(i) Theta_n^l(r)] cos(l dphi) / c, n >= m >= l >=
            0, c^2 = (2 if n != m else 4) * (1 if l = 0 else 1/2); rows [n, m, l].
Chiral:     X_nm^l = [Theta_n^l(i) Theta_m^l(r) - Theta_m^l(i) Theta_n^l(r)] sin(l dphi), n > m >= l >= 1:
            what isotropy and reciprocity leave free besides S. It is odd under reflection in a mirror, and
            off by default.
General:    Z_j(i) Z_k(r); rows [n, l, n', l'].
Reciprocal: Z_j(i) Z_j(r), and [Z_j(i) Z_k(r) + Z_k(i) Z_j(r)] / sqrt(2) for j > k; rows [n, l, n', l'] of
j, k.

All are orthonormal under dOmega_i dOmega_r. Lists are in ascending order of the largest n, so that a lower
order's list is a prefix of a higher one's. Source: Koenderink et al. (1996), section 3, as corrected in
docs/modes.md.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from photogonio.reconstruct.modes import kernel as mode_sums
from photogonio.reconstruct.modes.parallel import over_rows
from photogonio.reconstruct.modes.zernike import (
    elevation_norms,
    radial_index,
    recurrence,
    zernike_count,
    zernike_index,
    zernike_orders,
    zernike_sequence,
)

MANY_MODES, FEW_LIT = (
    100,
    8,
)  # of a direction; pairs an incident direction: from then on its sums are made once
QUANTITIES = {"brdf": (0, 0), "brdf_cos": (1, 0), "brdf_cos_cos": (1, 1)}  # powers of cos_i, cos_r


def isotropic_modes(order: int) -> np.ndarray:
    """(m, 3) rows [n, m, l] up to ``order``; 1, 5, 14, 30, 55 and 285 at order 0, 2, 4, 6, 8, 16."""
    rows = [
        (n, m, l) for n in range(order + 1) for m in range(n % 2, n + 1, 2) for l in range(n % 2, m + 1, 2)
    ]
    return np.array(rows, int).reshape(-1, 3)


def chiral_modes(order: int) -> np.ndarray:
    """(m, 3) rows [n, m, l] of the chiral family, n > m >= l >= 1."""
    modes = isotropic_modes(order)
    return modes[(modes[:, 0] > modes[:, 1]) & (modes[:, 2] > 0)]


def general_modes(order: int) -> np.ndarray:
    """(m, 4) rows [n, l, n', l'] of Z_j(i) Z_k(r), n and n' <= order."""
    count = zernike_count(order)
    return _pair_rows(*np.divmod(np.arange(count * count), count))


def reciprocal_modes(order: int) -> np.ndarray:
    """(m, 4) rows [n, l, n', l'] of the symmetrised pairs j >= k, n and n' <= order."""
    return _pair_rows(*np.tril_indices(zernike_count(order)))


def _pair_rows(j: np.ndarray, k: np.ndarray) -> np.ndarray:
    (n, l), (m, p) = zernike_orders(j), zernike_orders(k)
    return np.column_stack([n, l, m, p])[np.lexsort((k, j, np.maximum(n, m)))]


def isotropic_norms(modes: np.ndarray) -> np.ndarray:
    """(m,) 1 / c of isotropic modes (m, 3)."""
    n, m, l = np.asarray(modes).T
    return np.sqrt(np.where(n == m, 0.25, 0.5) * np.where(l == 0, 1.0, 2.0))


def isotropic_design(
    order: int, theta_i: ArrayLike, theta_r: ArrayLike, dphi: ArrayLike, quantity: str = "brdf"
) -> np.ndarray:
    """(k, m) values of the isotropic modes at k pairs; angles in radians, that broadcast together.

    With another ``quantity`` the modes are divided by the cosines it names: the matrix takes coefficients
    to f.
    """
    modes = isotropic_modes(order)
    return _paired_design(modes, isotropic_norms(modes), 1.0, (theta_i, theta_r, dphi), quantity)


def chiral_design(
    order: int, theta_i: ArrayLike, theta_r: ArrayLike, dphi: ArrayLike, quantity: str = "brdf"
) -> np.ndarray:
    """(k, m) values of the chiral modes; arguments as for :func:`isotropic_design`."""
    modes = chiral_modes(order)
    return _paired_design(modes, np.ones(len(modes)), -1.0, (theta_i, theta_r, dphi), quantity)


def _paired_design(modes, norms, sign, angles, quantity) -> np.ndarray:
    angles = flat(*angles)
    order = int(modes[:, 0].max(initial=0))
    first, second, weights = _places(modes, norms, order)
    design = np.empty((len(angles[0]), len(modes)))

    def task(start: int, stop: int) -> None:
        chunk = [_chunk(angle, start, stop) for angle in angles]
        mode_sums.paired_design(
            *recurrence(order), *chunk, first, second, modes[:, 2].copy(), weights, sign, design[start:stop]
        )
        if quantity != "brdf":
            design[start:stop] /= cosines(quantity, chunk[0], chunk[1])[:, None]

    over_rows(task, len(design), threads=1)
    return design


def evaluate_isotropic(
    modes,
    coefficients: ArrayLike,
    theta_i: ArrayLike,
    theta_r: ArrayLike,
    dphi: ArrayLike,
    *,
    threads: int | None = None,
) -> np.ndarray:
    """(k, c) sums of isotropic modes (m, 3) with ``coefficients`` (m, c) at k pairs (radians, broadcast
    together).

    Factored over azimuth: for each l, radial products weighted once a channel, then one cos(l dphi). No
    design matrix is formed; exactly reciprocal, bit for bit, and the same for any number of ``threads``.
    """
    modes, coefficients = _checked(modes, coefficients, 3)
    angles = flat(theta_i, theta_r, dphi)
    order = int(modes[:, 0].max(initial=0))
    first, second, weights = _places(modes, isotropic_norms(modes), order)
    spare = -len(modes) % mode_sums.GROUP
    first, second = np.pad(first, (0, spare)), np.pad(second, (0, spare))
    weighted = np.pad(coefficients * weights[:, None], ((0, spare), (0, -coefficients.shape[1] % 3)))
    weighted = np.ascontiguousarray(weighted)  # it has the layout of the coefficients, which may be columns
    result = np.empty((len(angles[0]), coefficients.shape[1]))

    def task(start: int, stop: int) -> None:
        chunk = [_chunk(angle, start, stop) for angle in angles]
        mode_sums.isotropic_sum(*recurrence(order), *chunk, first, second, weighted, result[start:stop])

    over_rows(task, len(result), threads)
    return result


def pair_design(symmetry: str, order: int, angles: Sequence[ArrayLike], quantity: str = "brdf") -> np.ndarray:
    """(k, m) values of the ``reciprocal`` or ``general`` modes at ``angles`` theta_i, phi_i, theta_r, phi_r, radians;
    ``quantity`` as for :func:`isotropic_design`."""
    general = symmetry == "general"
    j, k = pair_indices((general_modes if general else reciprocal_modes)(order))
    norm = np.where(j == k, 0.5, np.sqrt(0.5))[:, None]
    theta_i, phi_i, theta_r, phi_r = flat(*angles)
    design = np.empty((len(theta_i), len(j)))

    def task(start: int, stop: int) -> None:
        part = slice(start, stop)
        zi = zernike_sequence(order, theta_i[part], phi_i[part])
        zr = zernike_sequence(order, theta_r[part], phi_r[part])
        product = zi[j] * zr[k] if general else norm * (zi[j] * zr[k] + zi[k] * zr[j])
        design[part] = (product / cosines(quantity, theta_i[part], theta_r[part])).T

    over_rows(task, len(design), threads=1)
    return design


def evaluate_pairs(
    symmetry: str,
    modes: ArrayLike,
    coefficients: ArrayLike,
    angles: Sequence[ArrayLike],
    *,
    threads: int | None = None,
) -> np.ndarray:
    """(k, c) sums of ``reciprocal`` or ``general`` modes (m, 4) with ``coefficients`` (m, c) at ``angles`` theta_i,
    phi_i, theta_r, phi_r, radians: for each channel Z(i)^T A Z(r), A symmetric if reciprocal."""
    modes, coefficients = _checked(modes, coefficients, 4)
    j, k = pair_indices(modes)
    if symmetry == "general":
        return _bilinear(modes, j, k, coefficients, angles, threads)
    half = coefficients * np.where(j == k, 0.5, np.sqrt(0.5))[:, None]
    both = np.concatenate([half, half])
    return _bilinear(modes, np.concatenate([j, k]), np.concatenate([k, j]), both, angles, threads)


def _bilinear(modes, j, k, coefficients, angles, threads) -> np.ndarray:
    order = int(modes[:, [0, 2]].max(initial=0))
    count, channels = zernike_count(order), coefficients.shape[1]
    matrix = np.zeros((channels, count, count))
    for each, values in zip(matrix, coefficients.T, strict=True):
        np.add.at(each, (j, k), values)
    theta_i, phi_i, theta_r, phi_r = flat(*angles)
    result = np.empty((len(theta_i), channels))
    if count >= MANY_MODES:
        lit, whose = np.unique(theta_i + 1j * phi_i, return_inverse=True)
        if FEW_LIT * len(lit) <= len(result):
            sums = np.matmul(zernike_sequence(order, lit.real, lit.imag).T, matrix).swapaxes(0, 1)
            return _by_incidence(order, sums, whose, theta_r, phi_r)

    def task(start: int, stop: int) -> None:
        part = slice(start, stop)
        zi = zernike_sequence(order, theta_i[part], phi_i[part])
        zr = zernike_sequence(order, theta_r[part], phi_r[part])
        for channel in range(channels):
            result[part, channel] = np.einsum("jk,jk->k", zi, matrix[channel] @ zr)

    over_rows(task, len(result), threads)
    return result


def _by_incidence(order, sums, whose, theta_r, phi_r) -> np.ndarray:
    """(k, c) values where few incident directions are those of many pairs: each has ``sums`` (u, c, j) of modes of the
    exit direction; ``whose`` (k,) are their places."""
    result = np.empty((len(whose), sums.shape[1]))
    sorted_places = np.argsort(whose, kind="stable")

    def task(start: int, stop: int) -> None:
        places = sorted_places[start:stop]
        zr = zernike_sequence(order, theta_r[places], phi_r[places])
        ends = np.flatnonzero(np.diff(whose[places], append=-1)) + 1
        for first, last in zip([0, *ends[:-1]], ends, strict=True):
            result[places[first:last]] = (sums[whose[places[first]]] @ zr[:, first:last]).T

    over_rows(task, len(result), threads=1)
    return result


def cosines(quantity: str, theta_i: np.ndarray, theta_r: np.ndarray) -> np.ndarray:
    """The cosines by which modes of ``quantity`` are divided to give f, the shape of ``theta_i``."""
    try:
        incident, exit = QUANTITIES[quantity]
    except KeyError:
        raise ValueError(f"quantity is {quantity!r}; it is one of {', '.join(QUANTITIES)}") from None
    return np.cos(theta_i) ** incident * np.cos(theta_r) ** exit


def flat(*angles: ArrayLike) -> list[np.ndarray]:
    """Angles broadcast together, each (k,), without a copy where they are one-dimensional or scalars."""
    arrays = np.broadcast_arrays(*[np.asarray(angle) for angle in angles])
    return [a if a.ndim == 1 else a.reshape(-1) for a in arrays]


def _chunk(angle: np.ndarray, start: int, stop: int) -> np.ndarray:
    """A copy, so that the compiled code meets one kind of array whatever was given."""
    return np.array(angle[start:stop], dtype=float)


def pair_indices(modes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """OSA/ANSI indices j and k, each (m,), of rows [n, l, n', l'] (m, 4)."""
    n, l, m, p = np.asarray(modes).T
    return zernike_index(n, l), zernike_index(m, p)


def _places(modes, norms, order) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places of (n, l) and (m, l) in a radial sequence, and each mode's factor on radial polynomials."""
    n, m, l = modes.T
    first, second, scale = radial_index(n, l), radial_index(m, l), elevation_norms(order)
    return first, second, norms * scale[first] * scale[second]


def _checked(modes, coefficients, width) -> tuple[np.ndarray, np.ndarray]:
    modes, coefficients = np.asarray(modes, int), np.asarray(coefficients, float)
    if (
        modes.ndim != 2
        or modes.shape[1] != width
        or coefficients.ndim != 2
        or len(modes) != len(coefficients)
    ):
        raise ValueError(
            f"modes {modes.shape} and coefficients {coefficients.shape}: (m, {width}) and (m, c) are needed"
        )
    return modes, coefficients
