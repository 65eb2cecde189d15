"""Single measured rows that their neighbours contradict: the only rows of a table that lose their say.

A stiff model misses whole peaks, and by many times the noise; that is the model's fault, not the rows'. So a row is
judged by the rows about it, not by the model: by those of neighbouring directions that lie about as far from the
mirror direction and from the lamp's own, since along those a surface may change within degrees. Rows that agree, as
repeated ones and reciprocal twins do, never contradict one another.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from photogonio.capture.diagnosis import Diagnosis
from photogonio.reconstruct.estimate.outlier_views import pair_places
from photogonio.reconstruct.modes.angles import half_difference, unit_vectors
from photogonio.reconstruct.table.cells import Cells

REACH = np.radians(25.0)  # of neighbours
CANDIDATES = 24  # nearest rows, of which
JUDGES = 8  # that lie about as far from both peaks have a say
FEWEST = 6
ALIKE = 0.5  # share by which the angle to a peak may differ, and
LEAST_ALIKE = np.radians(3.0)  # at least as much
BEYOND = 4.0  # ranges of what the judges say, beyond that range: what a steep place may do
BESIDE = np.radians(15.0)  # a row within which that agrees, to
AGREES = 0.35  # of how far both are off, speaks for a row
ONE_SIDED = 0.6  # of their distances: how far aside the judges of a row at the edge lie on the mean
CERTAIN = 5.0  # standard deviations beyond that

NAMED = 8  # rows, at most


def told_of(cells: Cells) -> list[Diagnosis]:
    """What is told of measured rows that have lost their say."""
    if cells.binned or cells.doubt is None:
        return []
    rows = np.flatnonzero(cells.doubt.any(1))
    degrees = np.degrees([cells.theta_i, cells.theta_r, np.abs(cells.dphi)])[:, rows[:NAMED]].T
    named = [
        f"{value:.4g} at ({i:.4g}, {r:.4g}, {d:.4g})"
        for value, (i, r, d) in zip(cells.value[rows[:NAMED]].mean(1), degrees, strict=True)
    ]
    more = f" and {len(rows) - NAMED} more" if len(rows) > NAMED else ""
    message = (
        f"{len(rows)} row{'s' if len(rows) > 1 else ''} contradicted by all neighbours count for little: "
        f"{', '.join(named)}{more} (theta_i, theta_r, dphi in degrees)"
    )
    return [Diagnosis("rows-contradicted", message, amount=len(rows))]


def contradiction_of(cells: Cells, noise: np.ndarray) -> np.ndarray:
    """(n, c) how far rows lie from what their neighbours say, 1/sr, if that is far outside of it; else 0.

    ``noise`` (n, c) is the standard deviation of a row.
    """
    near, nearest = _judges(cells)
    judged = (near >= 0).sum(1) >= FEWEST
    result = np.zeros(cells.value.shape)
    for c, value in enumerate(cells.value.T):
        said = np.where(near >= 0, value[near], np.nan)[judged]
        if not len(said):
            break
        low, high = np.nanmin(said, axis=1), np.nanmax(said, axis=1)
        slack = BEYOND * (high - low) + CERTAIN * noise[judged, c]
        odd = (value[judged] > high + slack) | (value[judged] < low - slack)
        off = np.abs(value[judged] - np.nanmedian(said, axis=1))
        beside = np.where(nearest[judged] >= 0, np.abs(value[nearest[judged]] - value[judged, None]), np.inf)
        result[judged, c] = np.where(odd & (beside.min(1) > AGREES * off), off, 0.0)
    return result


def _judges(cells: Cells) -> tuple[np.ndarray, np.ndarray]:
    """(n, JUDGES) neighbours of each row, or of its reciprocal twin, that have a say, nearest first, and (n, k) all
    that are very near; -1: none. At the edge of the data none has a say: f may go on as it begins."""
    n = len(cells)
    there = pair_places(cells.theta_i, cells.theta_r, cells.dphi)
    back = pair_places(cells.theta_r, cells.theta_i, cells.dphi)
    count = min(CANDIDATES, 2 * n)
    places = np.concatenate([there, back])
    distance, place = cKDTree(places).query(there, k=count, distance_upper_bound=REACH)
    distance, place = distance.reshape(n, count), np.minimum(place.reshape(n, count), 2 * n - 1)
    near = place % n
    peaks = half_difference(unit_vectors(cells.theta_i, 0.0), unit_vectors(cells.theta_r, cells.dphi))[:2]
    alike = np.isfinite(distance) & (near != np.arange(n)[:, None])
    for angle in peaks:
        apart = np.abs(angle[near] - angle[:, None])
        alike &= apart <= np.maximum(ALIKE * angle[:, None], LEAST_ALIKE)
    order = np.argsort(~alike, axis=1, kind="stable")[:, :JUDGES]
    alike, judges = np.take_along_axis(alike, order, 1), np.take_along_axis(near, order, 1)
    apart = places[np.take_along_axis(place, order, 1)] - there[:, None]
    aside = np.linalg.norm(np.sum(apart * alike[..., None], axis=1), axis=1)
    edge = aside > ONE_SIDED * np.sum(np.linalg.norm(apart, axis=2) * alike, axis=1)
    judges = np.where(alike & ~edge[:, None], judges, -1)
    return judges, np.where((distance <= BESIDE) & (near != np.arange(n)[:, None]), near, -1)
