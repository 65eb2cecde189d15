"""What a cell's mean has beyond the BRDF at its mean directions, to second order: binning error and the lamp's size.

A cell's samples differ from its middle by small turns of both directions together, since what changes from pixel to
pixel is the normal (on a ball) or the point (on a plane). The mean of f over turns of variance v about both tangent
axes is f plus v / 2 times the sum of the second derivatives along them. The mean directions themselves shift with the
turns, which a table's own mean directions have too: that part is no error, and is left out.

A lamp of some size lights a point from many directions: what is seen is the mean of f over them, each weighted by its
cosine, so that a gloss looks wider and lower than it is.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.estimate.narrow_gloss import half_angles
from photogonio.reconstruct.modes.angles import pair_angles, spherical_angles, unit_vectors
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.table.refinement import NEAR

LEAST_LAMP = (
    1e-5  # radians^2: a smaller lamp, of half a degree in radius, blurs nothing that cells could show
)
DISPLACED = float(np.radians(0.03))
NORMAL_RULE = (
    (-np.sqrt(3.0), 1.0 / 6.0),
    (0.0, 2.0 / 3.0),
    (np.sqrt(3.0), 1.0 / 6.0),
)  # of Gauss and Hermite
LEAST_COSINE = 1e-3  # a turn does not take a direction below the horizon


def binning(cells: Cells, model: Model) -> np.ndarray:
    """(n, c) mean of ``model`` over each cell less its value at the cell's mean directions, 1/sr."""
    if cells.turn is None:
        return np.zeros((len(cells), model.coefficients.shape[1]))
    dphi = cells.phi_r - cells.phi_i if model.turning else cells.dphi
    incident, exit = unit_vectors(cells.theta_i, 0.0), unit_vectors(cells.theta_r, dphi)
    step = np.sqrt(2.0 * cells.turn)  # a turn about one axis at a time
    total: np.ndarray | float = 0.0
    means = np.zeros((2, len(cells), 3))
    for axis, sign in ((0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0)):
        turned = [_turned(directions, axis, sign * step[:, axis]) for directions in (incident, exit)]
        theta_i, theta_r, dphi = pair_angles(*turned)
        if cells.canonical:
            turned = [unit_vectors(theta_i, 0.0), unit_vectors(theta_r, np.abs(dphi))]
        total = total + 0.25 * model.evaluate(_placed(cells, turned, model))
        means += turned
    middle = _placed(cells, means, model)
    if cells.rigid:
        middle = middle.with_phase(np.einsum("ij,ij->i", incident, exit))
    return total - model.evaluate(middle)


def lamp_size(cells: Cells, model: Model) -> np.ndarray:
    """(n, c) mean of ``model`` over the lamp as each cell sees it less its value toward the lamp's middle, 1/sr."""
    total = np.zeros((len(cells), model.coefficients.shape[1]))
    if cells.lamp is None or not (cells.lamp > LEAST_LAMP).any():
        return total
    incident = unit_vectors(cells.theta_i, 0.0)
    exit = unit_vectors(cells.theta_r, cells.phi_r - cells.phi_i if model.turning else cells.dphi)
    along = np.stack([incident[:, 2], np.zeros(len(cells)), -incident[:, 0]], axis=-1)
    aside = np.broadcast_to([0.0, 1.0, 0.0], along.shape)
    step, weight = np.sqrt(2.0 * cells.lamp)[:, None], 0.0
    for tangent in (along, -along, aside, -aside):
        moved = np.cos(step) * incident + np.sin(step) * tangent
        cosine = np.maximum(moved[:, 2:], 0.0)
        moved[:, 2] = np.maximum(moved[:, 2], LEAST_COSINE)
        total += cosine * model.evaluate(_placed(cells, [moved, exit], model))
        weight = weight + cosine
    return total / np.maximum(weight, LEAST_COSINE) - model.evaluate(_placed(cells, [incident, exit], model))


def blur(cells: Cells, model: Model) -> np.ndarray:
    """(n, c) what the cells' width and the lamps' size add to ``model`` together, 1/sr. Of a narrow peak to the fifth
    order, and of both at once: they widen it by a good part of its own width."""
    added = binning(cells, model) + lamp_size(cells, model)
    if not cells.peaked or cells.turn is None or not model.lobes.families or model.turning:
        return added
    near = np.flatnonzero(half_angles(cells) < NEAR)
    added[near] = _peak_blur(cells.take(near), np.sqrt(cells.turn[near]), model)
    return added


def _peak_blur(cells: Cells, turn: np.ndarray, model: Model) -> np.ndarray:
    """The same of the lobes alone, ``turn`` (n, 2) being deviations: modes change little over a cell."""
    lobes = replace(model, coefficients=np.zeros_like(model.coefficients[:1]), basis=Basis("isotropic", 0))
    start = unit_vectors(cells.theta_i, 0.0), unit_vectors(cells.theta_r, cells.dphi)
    total, means = np.zeros((len(cells), model.coefficients.shape[1])), np.zeros((2, len(cells), 3))
    for (a, first), (b, second) in product(NORMAL_RULE, NORMAL_RULE):
        turned = [_turned(_turned(one, 0, a * turn[:, 0]), 1, b * turn[:, 1]) for one in start]
        theta_i, theta_r, dphi = pair_angles(*turned)
        turned = [unit_vectors(theta_i, 0.0), unit_vectors(theta_r, dphi)]  # both sides of the plane alike
        total += first * second * _over_lamp(cells, turned, lobes)
        means += first * second * np.array(turned)
    return total - lobes.evaluate(_placed(cells, means, lobes))


def _over_lamp(cells: Cells, directions: list[np.ndarray], model: Model) -> np.ndarray:
    """(n, c) mean of ``model`` over a glowing disc about the first of ``directions``, weighted by the cosine: Radon's
    seven points."""
    incident, exit = directions
    if cells.lamp is None or not (cells.lamp > LEAST_LAMP).any():
        return model.evaluate(_placed(cells, directions, model))
    along = np.stack([incident[:, 2], np.zeros(len(cells)), -incident[:, 0]], axis=-1)
    aside = np.broadcast_to([0.0, 1.0, 0.0], along.shape)
    step = (
        2.0 * np.sqrt(2.0 / 3.0 * cells.lamp)[:, None]
    )  # a disc's variance is a fourth of its squared radius
    total, weight = np.zeros((len(cells), model.coefficients.shape[1])), np.zeros((len(cells), 1))
    for share, turn in ((0.25, None), *((0.125, k * np.pi / 3.0) for k in range(6))):
        moved = incident
        if turn is not None:
            moved = np.cos(step) * incident + np.sin(step) * (np.cos(turn) * along + np.sin(turn) * aside)
        cosine = share * np.maximum(moved[:, 2:], LEAST_COSINE)
        moved = np.column_stack([moved[:, :2], np.maximum(moved[:, 2], LEAST_COSINE)])
        total += cosine * model.evaluate(_placed(cells, [moved, exit], model))
        weight += cosine
    return total / weight


def displaced(cells: Cells, model: Model) -> np.ndarray:
    """(n, c) standard error, 1/sr, of a narrow peak's flanks by errors of :data:`DISPLACED` in where the normal points:
    the sample's place and the lamp's are known to some hundredths of a degree."""
    lobes = replace(model, coefficients=np.zeros_like(model.coefficients[:1]), basis=Basis("isotropic", 0))
    start = unit_vectors(cells.theta_i, 0.0), unit_vectors(cells.theta_r, cells.dphi)
    square = np.zeros((len(cells), model.coefficients.shape[1]))
    for axis in (0, 1):
        ends = [
            lobes.evaluate(
                _placed(cells, [_turned(one, axis, np.full(len(cells), t)) for one in start], lobes)
            )
            for t in (-DISPLACED, DISPLACED)
        ]
        square += (0.5 * (ends[1] - ends[0])) ** 2
    return np.sqrt(square)


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
