"""Means of modes over facets: what a facet's value is a mean of, if its samples fill it evenly.

The mode at a facet's centre differs from its mean by the binning error, second order in the facet's size; these means
say how large it is, and take it out where samples are even. Source: docs/modes.md.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from photogonio.reconstruct.modes.angles import spherical_angles
from photogonio.reconstruct.modes.basis import isotropic_modes, isotropic_norms
from photogonio.reconstruct.modes.quadrature import gauss
from photogonio.reconstruct.modes.zernike import zernike_index, zernike_sequence
from photogonio.reconstruct.table.facets import mean_directions, vertices


def facet_rule(level: int, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions (f, points^2, 3) and weights (f, points^2), sr, of a product Gauss rule on every facet.

    The chord triangle p = a + u (b - a) + u v (c - b) is projected from the centre: dOmega = det(a, b, c) u du dv
    / |p|^3. Level 1 to 7.
    """
    nodes, weights = gauss(points)
    u, v = (x.ravel() for x in np.meshgrid(nodes, nodes, indexing="ij"))
    share = np.outer(weights * nodes, weights).ravel()
    a, b, c = np.moveaxis(vertices(level), 1, 0)[:, :, None, :]
    chord = a + u[:, None] * (b - a) + (u * v)[:, None] * (c - b)
    distance = np.linalg.norm(chord, axis=2)
    triple = np.einsum("fx,fx->f", a[:, 0], np.cross(b[:, 0], c[:, 0]))
    return chord / distance[..., None], share * triple[:, None] / distance**3


@lru_cache(maxsize=8)
def zernike_means(level: int, order: int) -> np.ndarray:
    """(f, j) mean of every Z_j up to ``order`` over every facet of ``level`` 1 to 7; exact to rounding."""
    points = 8 + order // 2**level + (4 if level == 1 else 0)
    directions, weights = facet_rule(level, points)
    means = np.empty((len(weights), (order + 1) * (order + 2) // 2))
    step = max(1, 200_000 // weights.shape[1])
    for start in range(0, len(weights), step):
        part = slice(start, start + step)
        values = zernike_sequence(order, *spherical_angles(directions[part]))
        means[part] = np.einsum("jfp,fp->fj", values, weights[part]) / weights[part].sum(1)[:, None]
    means.setflags(write=False)
    return means


def isotropic_means(level: int, order: int, facet_i: np.ndarray, facet_r: np.ndarray) -> np.ndarray:
    """(k, m) means of the isotropic modes over pairs of facets (k,): cos(l dphi) splits into products of means."""
    n, m, l = isotropic_modes(order).T
    means = zernike_means(level, order)
    incident, exit = means[np.asarray(facet_i)], means[np.asarray(facet_r)]
    total = 0.0
    for sign in (1, -1):
        j, k = zernike_index(n, sign * l), zernike_index(m, sign * l)
        total = total + incident[:, j] * exit[:, k] + incident[:, k] * exit[:, j]
    return total * (isotropic_norms(isotropic_modes(order)) / 2)


def centre_spread(level: int) -> np.ndarray:
    """(f,) root mean square distance of a facet's directions from their mean, in radians (of chord)."""
    return np.sqrt(np.maximum(1 - (mean_directions(level) ** 2).sum(1), 0.0))
