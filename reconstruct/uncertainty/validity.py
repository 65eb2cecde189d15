"""Where a fit may be trusted: what is determined by data, what was seen, and what is extrapolated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.estimate.outlier_views import pair_places
from photogonio.reconstruct.estimate.weights import level
from photogonio.reconstruct.table.cells import Cells

STEP = 5.0  # degrees between the map's directions
NEAR = np.radians(7.5)  # a direction is seen if data lie as near
TURNS = tuple(np.radians([0.0, 45.0, 90.0, 135.0]))  # at which a surface that is not isotropic is looked at
TRUSTED = 0.1  # relative standard error of f
EXTRAPOLATED, SEEN, DETERMINED = 0, 1, 2


@dataclass(frozen=True, slots=True)
class Region:
    """The map on a grid of isotropic directions, (t, t, d) by theta_i, theta_r and dphi."""

    theta: np.ndarray  # (t,) radians
    dphi: np.ndarray  # (d,) radians
    seen: np.ndarray  # (t, t, d) bool: data lie within :data:`NEAR`, there or at the reciprocal twin
    relative_error: np.ndarray  # (t, t, d) standard error of f over f, mean of the channels

    @property
    def state(self) -> np.ndarray:
        """(t, t, d) DETERMINED where seen and known to :data:`TRUSTED`, SEEN where only seen, else EXTRAPOLATED."""
        known = self.relative_error <= TRUSTED
        return np.where(self.seen, np.where(known, DETERMINED, SEEN), EXTRAPOLATED)

    def valid(self) -> dict[str, float]:
        """Largest angles, degrees, that data reach and below which f is known to :data:`TRUSTED` on the mean."""
        weight = np.sin(2 * self.theta)[:, None, None] * np.sin(2 * self.theta)[None, :, None]
        weight = np.broadcast_to(weight, self.seen.shape)
        top, some = 0.0, np.any(self.seen, axis=(1, 2)) | np.any(self.seen, axis=(0, 2))
        for limit in np.arange(STEP, 90.0 + STEP, STEP):
            inside = self.theta < np.radians(limit)
            part = np.ix_(inside, inside, np.ones(len(self.dphi), bool))
            if some[inside][-1] and np.average(self.relative_error[part], weights=weight[part]) <= TRUSTED:
                top = float(limit)
        return {"theta_i_max": top, "theta_r_max": top}


def region_of(error: Callable[[Cells, np.ndarray], np.ndarray], model: Model, cells: Cells) -> Region:
    """The map of a fitted ``model`` whose data are ``cells`` and whose standard ``error`` at cells, where it says f (n,
    c), is (n, c), 1/sr."""
    theta = np.radians(np.arange(0.5 * STEP, 90.0, STEP))
    dphi = np.radians(np.arange(1.5 * STEP, 180.0, 3.0 * STEP))
    i, r, d = (a.ravel() for a in np.meshgrid(theta, theta, dphi, indexing="ij"))
    grid = Cells.of_angles(i, r, d)
    turns = np.array(TURNS if model.turning else TURNS[:1])
    relative = _relative(error, model, cells, _turned(grid, turns)).reshape(len(turns), -1).mean(0)
    shape = (len(theta), len(theta), len(dphi))
    return Region(theta, dphi, seen_at(cells, grid).reshape(shape), relative.reshape(shape))


def _turned(grid: Cells, turns: np.ndarray) -> Cells:
    """The directions (n,) of ``grid`` with the sample turned back by each of ``turns`` (k,), (k n,): all at once."""
    turn, every = np.repeat(turns, len(grid)), grid.take(np.tile(np.arange(len(grid)), len(turns)))
    return replace(every, phi_i=every.phi_i + turn, phi_r=every.phi_r + turn)


def _relative(
    error: Callable[[Cells, np.ndarray], np.ndarray], model: Model, cells: Cells, where: Cells
) -> np.ndarray:
    """(n,) standard error of f over f, mean of the channels, at the directions of ``where``."""
    said = model.evaluate(where)
    return (error(where, said) / np.maximum(np.abs(said), 1e-3 * level(cells))).mean(1)


def seen_at(cells: Cells, where: Cells) -> np.ndarray:
    """(n,) bool: whether data lie near the directions of ``where``, or near their reciprocal twins."""
    tree = cKDTree(
        np.concatenate(
            [
                pair_places(cells.theta_i, cells.theta_r, cells.dphi),
                pair_places(cells.theta_r, cells.theta_i, cells.dphi),
            ]
        )
    )
    # no farther than matters: of directions that nothing was seen near, all the tree would be searched
    places = pair_places(where.theta_i, where.theta_r, where.dphi)
    distance, _ = tree.query(places, distance_upper_bound=2 * NEAR)
    return distance <= NEAR
