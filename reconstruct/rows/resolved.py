"""Do measured rows resolve the peak that a fit has between them?

Light that a fit has where its nearest rows differ manifold hangs on what it takes for the shape of the peak. That is
well where a lobe follows the peak by itself, and rows show its flank. It says nothing where they hold but its top, or
where a lobe does not follow it and modes of high order mend that at the rows, and only there. Nor where a peak rises
about the light's own direction, or the mirror's, and no row is as near to that as the peak is wide: how high it goes on
to rise is then anybody's guess.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.table.neighbours import places
from photogonio.reconstruct.uncertainty.beyond import halton

PAIRS = 1024  # of directions between the rows
NEAREST = 4  # rows
APART = 1.0  # of f, that the nearest rows differ by in the mean: what is between them hangs on a lobe
TOP = 0.1  # of the highest reading: those above are a peak's
NARROW = 15.0  # times the middle reading that the highest is, and
NEAR = np.radians(20.0)  # how far from the mirror direction, or the light's own, all of the top is
RINGS = 3  # angles from there, at which the top was read
ALIKE, LEAST = 0.1, 1e-3  # of the largest of them, and radians: nearer ones are one
FINE = 8  # order beyond which modes
MENDED = 0.1  # of f in the mean, follow what lobes do not
# of the middle of two directions, at which a peak's rise is looked at
TILTS = np.radians(np.arange(0.0, 41.0, 10.0))
CORE = 0.1  # of the albedo, by how much a peak without rows may be brighter; of CUReT's thirty materials 0.024 at most


@dataclass(frozen=True, slots=True)
class Resolved:
    """How well rows say what is between them."""

    apart: float  # of f in the mean: what the nearest rows differ by
    rings: (
        int | None
    )  # angles from a peak's direction at which its top was read; None: there is no narrow one
    mended: float  # of f in the mean: rms of modes of high order

    @property
    def unresolved(self) -> bool:
        """Whether the fit's peak may be another between the rows."""
        few = self.rings is not None and self.rings < RINGS
        return self.apart > APART and (few or self.mended > MENDED)


def resolved_by(cells: Cells, model: Model) -> Resolved:
    """What the rows ``cells`` say of ``model``, of all channels together."""
    size = np.maximum(np.abs(cells.value).mean(0), np.finfo(float).tiny)
    top = np.sin([cells.theta_i.max(), cells.theta_r.max()])
    unit = np.stack([halton(PAIRS + 1, base)[1:] for base in (2, 3, 5, 7)])
    theta_i, theta_r = np.arcsin(np.sqrt(unit[:2]) * top[:, None])
    between = Cells.of_directions(
        theta_i, 2.0 * np.pi * unit[3], theta_r, 2.0 * np.pi * unit[3] + np.pi * unit[2]
    )
    mean = max(float(np.mean(np.maximum(model.evaluate(between), 0.0) / size)), np.finfo(float).tiny)
    said = np.mean(np.maximum(model.evaluate(cells), 0.0) / size, axis=1)
    tree = cKDTree(places(cells.theta_i, cells.theta_r, cells.dphi))
    near = tree.query(places(theta_i, theta_r, between.dphi), k=min(NEAREST, len(cells)))[1]
    apart = float(np.mean(np.ptp(said[near.reshape(PAIRS, -1)], axis=1))) / mean
    rows = model.basis.modes
    fine = np.max(rows[:, [0, 2]] if rows.shape[1] > 3 else rows[:, :2], axis=1) > FINE
    waves = np.sqrt(np.sum((model.coefficients[fine] / size) ** 2, axis=0)).mean() / np.pi
    value = np.mean(cells.value / size, axis=1)
    return Resolved(apart, _rings(cells, value), float(waves) / mean)


def core_unseen(cells: Cells, model: Model) -> float:
    """Of the albedo, what the light nearer to a peak's direction than any row is would be more by, rose f there as
    much again as it does from twice that angle to the nearest rows; of the worse of two peaks, and channels."""
    incident, exit = unit_vectors(cells.theta_i, 0.0), unit_vectors(cells.theta_r, cells.dphi)
    found = 0.0
    for side, turned in ((np.pi, [-1.0, -1.0, 1.0]), (0.0, [1.0, 1.0, 1.0])):
        cosine = np.einsum("ij,ij->i", incident, exit * turned)
        nearest = float(np.arccos(np.clip(cosine.max(), -1.0, 1.0)))
        edge, beyond = (np.maximum(_around(model, angle, side), 0.0) for angle in (nearest, 2.0 * nearest))
        rise = edge / np.maximum(beyond, np.finfo(float).tiny) - 1.0
        light = np.pi * np.sin(min(nearest, 0.5 * np.pi)) ** 2 * edge
        share = light / np.maximum(_albedo(model), np.finfo(float).tiny)
        found = max(found, float(np.max(share * np.minimum(rise, 1.0 / CORE))))
    return found


def _around(model: Model, angle: float, side: float) -> np.ndarray:
    """(c,) mean f of pairs that lie ``angle`` from one another, where ``side`` is 0, or from the mirror direction."""
    one, other = TILTS - 0.5 * angle, TILTS + 0.5 * angle
    dphi = np.where(one * other < 0.0, np.pi - side, side)
    pairs = Cells.of_angles(np.abs(one), np.minimum(np.abs(other), np.radians(85.0)), dphi)
    return model.evaluate(pairs).mean(0)


def _albedo(model: Model) -> np.ndarray:
    """(c,) under even light, by pairs that are evenly spread over projected solid angle."""
    unit = halton(PAIRS, 2), halton(PAIRS, 3), halton(PAIRS, 5)
    theta_i, theta_r = np.arcsin(np.sqrt(unit[0])), np.arcsin(np.sqrt(unit[1]))
    return np.pi * np.maximum(model.evaluate(Cells.of_angles(theta_i, theta_r, np.pi * unit[2])), 0.0).mean(0)


def _rings(cells: Cells, value: np.ndarray) -> int | None:
    """At how many angles from its direction the top of a narrow peak was read."""
    top = value > TOP * value.max()
    if value.max() < NARROW * max(float(np.median(np.abs(value))), np.finfo(float).tiny):
        return None
    incident, exit = unit_vectors(cells.theta_i, 0.0), unit_vectors(cells.theta_r, cells.dphi)
    for turned in ([-1.0, -1.0, 1.0], [1.0, 1.0, 1.0]):
        cosine = np.einsum("ij,ij->i", incident, exit * turned)
        angle = np.sort(np.arccos(np.clip(cosine[top], -1.0, 1.0)))
        if angle[-1] < NEAR:
            return 1 + int(np.sum(np.diff(angle) > max(ALIKE * angle[-1], LEAST)))
    return None
