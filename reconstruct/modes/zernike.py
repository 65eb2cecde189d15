"""The hemisphere basis: Zernike polynomials carried to the hemisphere by Lambert's equal-area map.

rho = sqrt(2) sin(theta / 2), so rho^2 = 1 - cos(theta) and dA = dOmega / 2.
Theta_n^l(theta) = sqrt((n + 1) / (2 pi)) R_n^|l|(rho), orthonormal in theta with the complex factor e^(i l
phi). Z_n^l = sqrt(2 - [l = 0]) Theta_n^|l| times cos(l phi) for l >= 0, sin(|l| phi) for l < 0.

Source: Koenderink, van Doorn & Stavridi (1996), section 2, with the factor of docs/modes.md; the radial
polynomials by the three-term recurrence of Jacobi's P_k^(0, l), k = (n - l) / 2 (DLMF 18.9), upward in n at
fixed l.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from photogonio.capture.jit import contracted


class Recurrence(NamedTuple):
    """R[k] from R[before[k]] and R[before2[k]], in ascending order of n, then l."""

    n: np.ndarray  # (t,) int64
    l: np.ndarray  # (t,) int64
    before: np.ndarray  # (t,) int64 index of (n - 2, l); of (n - 1, l - 1) where n = l
    before2: np.ndarray  # (t,) int64 index of (n - 4, l), or of before where there is none
    a: np.ndarray  # (t,) P_k = (a z + b) P_k-1 - c P_k-2
    b: np.ndarray  # (t,)
    c: np.ndarray  # (t,)


def radial_count(order: int) -> int:
    """Number of pairs (n, l) with 0 <= l <= n <= order and n - l even."""
    return (order + 2) ** 2 // 4


def radial_index(n: ArrayLike, l: ArrayLike) -> np.ndarray:
    """Place of (n, |l|) in a radial sequence. A lower order's sequence is a prefix of a higher one's."""
    n, l = np.asarray(n), np.abs(l)
    return (n + 1) ** 2 // 4 + l // 2


@lru_cache(maxsize=64)
def recurrence(order: int) -> Recurrence:
    """Coefficients of the recurrence for every (n, l) up to ``order``."""
    # each in one stretch of memory, at every order: for another layout all that takes them is compiled anew
    n, l = np.array([(n, l) for n in range(order + 1) for l in range(n % 2, n + 1, 2)]).T.copy()
    k, safe = (n - l) // 2, np.maximum(n, 3)
    down = np.maximum(2 * k * (k + l), 1.0)
    first = k == 1
    a = np.where(first, (l + 2) / 2, (safe - 1) * safe / down)
    b = np.where(first, -l / 2, -(l**2) * (safe - 1) / (down * (safe - 2)))
    c = np.where(k < 2, 0.0, 2 * (k - 1) * (k + l - 1) * safe / (down * (safe - 2)))
    before = np.where(k > 0, radial_index(n - 2, l), np.maximum(radial_index(n - 1, l - 1), 0))
    before2 = np.where(k > 1, radial_index(n - 4, l), before)
    return Recurrence(n, l, before, before2, a, b, c)


@contracted
def fill_radial(n, l, before, before2, a, b, c, rho, slant, outer, table):
    """Fill ``table`` (t, lanes) with R_n^l, by the recurrence in one of two forms.

    Where rho^2 < 1/2: outer = 0, slant = z = 2 rho^2 - 1, and P_k = (a z + b) P_k-1 - c P_k-2. Elsewhere
    outer = 1, slant = z - 1 = -2 cos(theta), and since a + b = 1 + c, P_k = (1 + a slant) P_k-1 + c (P_k-1
    - P_k-2): exact at rho = 1 and accurate near it, as the first form is near rho = 0.
    """
    for j in range(len(rho)):
        table[0, j] = 1.0 + 0.0 * rho[j]  # not a number where rho is none
    for t in range(1, len(n)):
        p, pp, at, bt, ct = before[t], before2[t], a[t], b[t], c[t]
        if n[t] == l[t]:
            for j in range(len(rho)):
                table[t, j] = rho[j] * table[p, j]
        elif p == pp:  # the first of its kind: c is 0
            for j in range(len(rho)):
                table[t, j] = (at * slant[j] + (1.0 if outer[j] > 0.0 else bt)) * table[p, j]
        else:
            for j in range(len(rho)):
                factor = at * slant[j] + (1.0 if outer[j] > 0.0 else bt)
                table[t, j] = factor * table[p, j] + ct * (outer[j] * table[p, j] - table[pp, j])


def radial_sequence(order: int, rho: ArrayLike) -> np.ndarray:
    """R_n^l(rho) for every n <= order: (t, ...) in ascending order of n, then l (see :func:`radial_index`).

    ``rho`` in [0, 1], any shape. Exact at 0 and 1; within 1e-12 up to order 200. One pass of 5 operations a
    value.
    """
    rho = np.asarray(rho, float)
    return _sequence(order, rho, (1.0 - rho) * (1.0 + rho)).reshape(radial_count(order), *rho.shape)


def radial(n: int, l: int, rho: ArrayLike) -> np.ndarray:
    """R_n^|l|(rho), the shape of ``rho``; n - |l| is even and not negative, else ValueError."""
    _check(n, l)
    return radial_sequence(n, rho)[radial_index(n, l)]


def elevation_sequence(order: int, theta: ArrayLike) -> np.ndarray:
    """Theta_n^l(theta) for every n <= order: (t, ...) as :func:`radial_sequence` orders them; radians."""
    theta = np.asarray(theta, float)
    table = _sequence(order, np.sqrt(2.0) * np.sin(theta / 2), np.cos(theta))
    return (table * elevation_norms(order)[:, None]).reshape(radial_count(order), *theta.shape)


def elevation_norms(order: int) -> np.ndarray:
    """(t,) sqrt((n + 1) / (2 pi)) in the order of :func:`radial_sequence`."""
    return np.sqrt((recurrence(order).n + 1) / (2 * np.pi))


def zernike_count(order: int) -> int:
    """Number of Z_n^l up to ``order``."""
    return (order + 1) * (order + 2) // 2


def zernike_index(n: ArrayLike, l: ArrayLike) -> np.ndarray:
    """OSA/ANSI index j = (n (n + 2) + l) / 2. Inverse of :func:`zernike_orders`."""
    return (np.asarray(n) * (np.asarray(n) + 2) + np.asarray(l)) // 2


def zernike_orders(j: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """n and l of OSA/ANSI index j. Inverse of :func:`zernike_index`."""
    j = np.asarray(j)
    n = np.floor((np.sqrt(8.0 * j + 1) - 1) / 2).astype(int)
    return n, 2 * j - n * (n + 2)


def zernike_sequence(order: int, theta: ArrayLike, phi: ArrayLike) -> np.ndarray:
    """Z_n^l(theta, phi) for every n <= order: (j, ...) by OSA/ANSI index; radians, broadcast together."""
    n, l = zernike_orders(np.arange(zernike_count(order)))
    theta, phi = np.broadcast_arrays(np.asarray(theta, float), np.asarray(phi, float))
    return elevation_sequence(order, theta)[radial_index(n, l)] * azimuth_sequence(order, phi)[order + l]


def azimuth_sequence(order: int, phi: ArrayLike) -> np.ndarray:
    """(2 order + 1, ...): sqrt(2) sin(|l| phi), l = -order .. -1; 1; then sqrt(2) cos(l phi), l to order."""
    phi = np.asarray(phi, float)
    turns = np.arange(1, order + 1).reshape(-1, *[1] * phi.ndim) * phi
    return np.sqrt(2.0) * np.concatenate([np.sin(turns[::-1]), (np.sqrt(0.5) + 0 * phi)[None], np.cos(turns)])


def _sequence(order: int, rho: np.ndarray, cos: np.ndarray) -> np.ndarray:
    if order < 0:
        raise ValueError(f"order is {order}; it must not be negative")
    rho, cos = np.ravel(rho), np.ravel(cos)
    outer = cos <= 0.5
    table = np.empty((radial_count(order), rho.size))
    slant = np.where(outer, -2 * cos, 2 * rho * rho - 1)
    fill_radial(*recurrence(order), rho, slant, outer.astype(float), table)
    return table


def _column(values: np.ndarray, dimensions: int) -> np.ndarray:
    return values.reshape(-1, *[1] * dimensions)


def _check(n: int, l: int) -> None:
    if abs(l) > n or (n - l) % 2:
        raise ValueError(f"no mode has n = {n}, l = {l}: |l| <= n and n - l even are needed")
