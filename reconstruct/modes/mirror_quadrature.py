"""Exit directions about the mirror's, for albedos of what is narrow there."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.modes.angles import unit_vectors

POLAR, AZIMUTHS = 48, 96  # nodes that do for gloss


def around(theta_i: float, polar: int = POLAR, azimuths: int = AZIMUTHS) -> tuple[np.ndarray, np.ndarray]:
    """Exit directions (n, 3) and weights (n,), projected solid angle, of the quadrature of an albedo: nodes lie dense
    about the mirror's direction of light from ``theta_i`` and azimuth 0."""
    node, size = np.polynomial.legendre.leggauss(polar)
    turn = (np.arange(azimuths) + 0.5) / azimuths
    phi = np.pi * (1 + np.sign(2 * turn - 1) * np.abs(2 * turn - 1) ** 3)
    d_phi = 2 * np.pi * 3 * np.abs(2 * turn - 1) ** 2 / azimuths
    found = []
    # u from 0 to 1 on either side of the mirror's polar angle, dense near it; azimuth dense near half a turn
    for end in (0.0, np.pi / 2):
        u = 0.5 * (node + 1)
        theta = theta_i + (end - theta_i) * u**3
        d_theta = np.abs(end - theta_i) * 3 * u**2 * 0.5 * size
        t, p = (grid.ravel() for grid in np.meshgrid(theta, phi, indexing="ij"))
        weight = np.outer(d_theta * np.sin(theta) * np.cos(theta), d_phi).ravel()
        found.append((unit_vectors(t, p), weight))
    return np.concatenate([one for one, _ in found]), np.concatenate([one for _, one in found])


def scattered_around(theta_i: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """As :func:`around`, by twice ``count`` nodes of Fibonacci's lattice: for what jumps from cell to cell, whose edges
    stand in line with a grid's rows."""
    k = np.arange(count)
    u, turn = (k + 0.5) / count, np.mod((k + 0.5) * (np.sqrt(5.0) - 1.0) / 2.0, 1.0)
    aside = 2.0 * turn - 1.0
    phi = np.pi * (1.0 + np.sign(aside) * np.abs(aside) ** 3)
    found = []
    for end in (0.0, np.pi / 2):
        theta = theta_i + (end - theta_i) * u**3
        weight = np.abs(end - theta_i) * 3.0 * u**2 * 2.0 * np.pi * 3.0 * aside**2 / count
        found.append((unit_vectors(theta, phi), weight * np.sin(theta) * np.cos(theta)))
    return np.concatenate([one for one, _ in found]), np.concatenate([one for _, one in found])
