"""What a cell's mean has beyond the BRDF at its mean directions: the binning error, to second order.

A cell's samples differ from its middle by small turns of both directions together, since what changes from pixel to
pixel is the normal (on a ball) or the point (on a plane). The mean of f over turns of variance v about both tangent
axes is f plus v / 2 times the sum of the second derivatives along them. The mean directions themselves shift with the
turns, which a table's own mean directions have too: that part is no error, and is left out.
"""

from __future__ import annotations

import numpy as np

from reconstruct.angles import pair_angles, spherical_angles, unit_vectors
from reconstruct.cells import Cells
from reconstruct.model import Model

LEAST_COSINE = 1e-3  # a turn does not take a direction below the horizon


def binning(cells: Cells, model: Model) -> np.ndarray:
    """(n, c) mean of ``model`` over each cell less its value at the cell's mean directions, 1/sr."""
    if cells.turn is None:
        return np.zeros((len(cells), model.coefficients.shape[1]))
    dphi = cells.phi_r - cells.phi_i if model.turning else cells.dphi
    incident, exit = unit_vectors(cells.theta_i, 0.0), unit_vectors(cells.theta_r, dphi)
    step = np.sqrt(2.0 * cells.turn)  # a turn about one axis at a time
    total, means = 0.0, np.zeros((2, len(cells), 3))
    for axis, sign in ((0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0)):
        turned = [_turned(directions, axis, sign * step[:, axis]) for directions in (incident, exit)]
        theta_i, theta_r, dphi = pair_angles(*turned)
        if cells.canonical:
            turned = [unit_vectors(theta_i, 0.0), unit_vectors(theta_r, np.abs(dphi))]
        total = total + 0.25 * model.evaluate(_placed(cells, turned, model))
        means += turned
    return total - model.evaluate(_placed(cells, means, model))


def _placed(cells: Cells, directions, model: Model) -> Cells:
    """Directions (n, 3) of incidence and exit, turned back from the plane of incidence if ``model`` heeds it."""
    theta_i, theta_r, dphi = pair_angles(*directions)
    if not model.turning:
        return Cells.of_angles(theta_i, theta_r, np.abs(dphi))
    (_, phi_i), (_, phi_r) = (spherical_angles(one) for one in directions)
    return Cells.of_directions(theta_i, cells.phi_i + phi_i, theta_r, cells.phi_i + phi_r)


def _turned(directions: np.ndarray, axis: int, angle: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) turned about the tangent axis x or y by ``angle`` (n,), kept above the horizon."""
    cos, sin = np.cos(angle), np.sin(angle)
    x, y, z = directions.T
    turned = (
        [x, cos * y - sin * z, sin * y + cos * z] if axis == 0 else [cos * x + sin * z, y, cos * z - sin * x]
    )
    turned[2] = np.maximum(turned[2], LEAST_COSINE)
    return np.stack(turned, axis=-1)
