"""The mathematics once more, from the paper and docs/modes.md alone, slowly and plainly.

Nothing here imports the project. tests/test_oracles.py tests this file against the paper's explicit
formulas and against integrals, so that the rest can be tested against it.
"""

from __future__ import annotations

from itertools import combinations
from math import factorial

import mpmath as mp
import numpy as np

mp.mp.dps = 320  # the printed sum cancels about 0.6 n digits: 120 at order 200


def radial(n: int, l: int, rho: float):
    """R_n^l(rho) by the printed factorial sum, as an mpmath number."""
    l, rho = abs(l), mp.mpf(rho)
    total = mp.mpf(0)
    for s in range((n - l) // 2 + 1):
        below = factorial(s) * factorial((n + l) // 2 - s) * factorial((n - l) // 2 - s)
        total += mp.mpf((-1) ** s * factorial(n - s) // below) * rho ** (n - 2 * s)
    return total


def elevation(n: int, l: int, theta: float):
    """Theta_n^l(theta) = sqrt((n + 1) / (2 pi)) R_n^l(sqrt(2) sin(theta / 2)), as an mpmath number."""
    return mp.sqrt(mp.mpf(n + 1) / (2 * mp.pi)) * radial(n, l, mp.sqrt(2) * mp.sin(mp.mpf(theta) / 2))


def hemisphere(n: int, l: int, theta: float, phi: float):
    """Z_n^l, the real form of K_n^l."""
    theta, phi = mp.mpf(theta), mp.mpf(phi)
    wave = mp.cos(l * phi) if l >= 0 else mp.sin(-l * phi)
    return mp.sqrt(2 - (l == 0)) * elevation(n, l, theta) * wave


def isotropic(n: int, m: int, l: int, theta_i: float, theta_r: float, dphi: float) -> float:
    """S_nm^l with its constant c."""
    one = elevation(n, l, theta_i) * elevation(m, l, theta_r)
    other = elevation(m, l, theta_i) * elevation(n, l, theta_r)
    c2 = mp.mpf(2 if n != m else 4) * (1 if l == 0 else mp.mpf(1) / 2)
    return float((one + other) * mp.cos(l * mp.mpf(dphi)) / mp.sqrt(c2))


def isotropic_list(order: int) -> list[tuple[int, int, int]]:
    """n >= m >= l >= 0, n - l and m - l even, n <= order."""
    every = ((n, m, l) for n in range(order + 1) for m in range(n + 1) for l in range(m + 1))
    return [(n, m, l) for n, m, l in every if (n - l) % 2 == 0 and (m - l) % 2 == 0]


def paper_listing(theta_1: float, theta_2: float, dphi: float) -> dict[tuple[int, int, int], float]:
    """The modes up to order two as printed, misprints mended (docs/modes.md); c = 1."""
    c1, c2 = np.cos(theta_1), np.cos(theta_2)
    return {
        (0, 0, 0): 1 / np.pi,
        (1, 1, 1): 4 / np.pi * np.sin(theta_1 / 2) * np.sin(theta_2 / 2) * np.cos(dphi),
        (2, 0, 0): np.sqrt(3) / np.pi * (1 - c1 - c2),
        (2, 2, 0): 3 / np.pi * (1 - 2 * c1) * (1 - 2 * c2),
        (2, 2, 2): 3 / np.pi * (1 - c1) * (1 - c2) * np.cos(2 * dphi),
    }


def count_isotropic(order: int) -> int:
    """Modes of even order N: the sum over n of those with that n, (N/2 + 1)(N/2 + 2)(N + 3) / 6."""
    return (order // 2 + 1) * (order // 2 + 2) * (order + 3) // 6


def direction(theta: float, phi: float) -> np.ndarray:
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def ggx(theta_i: float, theta_r: float, dphi: float, alpha: float, f0: float) -> float:
    """D G2 F / (4 cos_i cos_r) of docs/modes.md, from vectors."""
    i, r = direction(theta_i, 0.0), direction(theta_r, dphi)
    h = (i + r) / np.linalg.norm(i + r)
    d = alpha**2 / (np.pi * (h[2] ** 2 * (alpha**2 - 1) + 1) ** 2)

    def smith(v):  # Lambda of Smith's masking for GGX
        tan2 = (1 - v[2] ** 2) / v[2] ** 2
        return (np.sqrt(1 + alpha**2 * tan2) - 1) / 2

    g2 = 1 / (1 + smith(i) + smith(r))
    f = f0 + (1 - f0) * (1 - h @ i) ** 5
    return d * g2 * f / (4 * i[2] * r[2])


def facet_triangles(level: int) -> np.ndarray:
    """(80 * 4^(level - 1), 3, 3) corners of all facets of the sphere, in no order: icosahedron with poles at +-z."""
    ring = [direction(np.arctan(2), 2 * np.pi * k / 5) for k in range(5)]
    lower = [direction(np.pi - np.arctan(2), 2 * np.pi * (k + 0.5) / 5) for k in range(5)]
    corners = [np.array([0.0, 0, 1]), *ring, *lower, np.array([0.0, 0, -1])]
    edge = min(np.linalg.norm(a - b) for a, b in combinations(corners, 2))
    triangles = [
        np.array(t)
        for t in combinations(corners, 3)
        if all(abs(np.linalg.norm(a - b) - edge) < 1e-9 for a, b in combinations(t, 2))
    ]
    for _ in range(level):
        triangles = [child for t in triangles for child in _quarters(t)]
    return np.array(triangles)


def _quarters(triangle: np.ndarray) -> list[np.ndarray]:
    a, b, c = triangle
    ab, bc, ca = ((p + q) / np.linalg.norm(p + q) for p, q in ((a, b), (b, c), (c, a)))
    return [np.array(t) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]


def facet_margins(triangles: np.ndarray, point: np.ndarray) -> np.ndarray:
    """(t,) sine of the distance of a unit vector from the nearest edge of each triangle, positive inside."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    sign = np.sign(np.einsum("tx,tx->t", a, np.cross(b, c)))
    sides = [np.cross(p, q) for p, q in ((a, b), (b, c), (c, a))]
    return np.min([sign * (s @ point) / np.linalg.norm(s, axis=1) for s in sides], axis=0)


def spectrum_of_mirror(n: int, m: int, l: int) -> float:
    """Integral of S_nm^l(theta, theta, pi) dOmega, the paper's section 4: a mirror's q on the orthonormal modes."""
    both = (2 if n == m else 0) * (-1) ** l
    c2 = (2 if n != m else 4) * (1.0 if l == 0 else 0.5)
    return both / np.sqrt(c2)
