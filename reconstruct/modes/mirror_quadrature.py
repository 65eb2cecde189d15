"""Exit directions about the mirror's, for albedos of what is narrow there."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.modes.angles import unit_vectors

POLAR, AZIMUTHS = 48, 96  # nodes that do for gloss


def around(
    theta_i: float, polar: int = POLAR, azimuths: int = AZIMUTHS, *, retro: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Exit directions (n, 3) and weights (n,), projected solid angle, of the quadrature of an albedo: nodes lie dense
    about the mirror's direction of light from ``theta_i`` and azimuth 0; with ``retro``, half as many again, about the
    light's own too."""
    node, size = np.polynomial.legendre.leggauss(polar)
    phi, d_phi = _both_ways(azimuths * 3 // 8) if retro else _mirror_ways(azimuths)
    found = []
    # u from 0 to 1 on either side of the mirror's polar angle, which is the light's too, dense near it
    for end in (0.0, np.pi / 2):
        u = 0.5 * (node + 1)
        theta = theta_i + (end - theta_i) * u**3
        d_theta = np.abs(end - theta_i) * 3 * u**2 * 0.5 * size
        t, p = (grid.ravel() for grid in np.meshgrid(theta, phi, indexing="ij"))
        weight = np.outer(d_theta * np.sin(theta) * np.cos(theta), d_phi).ravel()
        found.append((unit_vectors(t, p), weight))
    return np.concatenate([one for one, _ in found]), np.concatenate([one for _, one in found])


def _mirror_ways(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Azimuths (n,) dense near half a turn, and their weights."""
    turn = (np.arange(count) + 0.5) / count
    phi = np.pi * (1 + np.sign(2 * turn - 1) * np.abs(2 * turn - 1) ** 3)
    return phi, 2 * np.pi * 3 * np.abs(2 * turn - 1) ** 2 / count


def _both_ways(count: int) -> tuple[np.ndarray, np.ndarray]:
    """The same dense near no turn and half a one, ``count`` in each quarter."""
    part = (np.arange(count) + 0.5) / count
    quarter = 0.5 * np.pi * part**3
    weight = 1.5 * np.pi * part**2 / (count - 0.25 / count)  # which add up to 2 pi
    phi = np.concatenate([quarter, np.pi - quarter, np.pi + quarter, 2 * np.pi - quarter])
    return phi, np.tile(weight, 4)


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
