"""Are some rows of a table a multiple of the others, by what no surface knows of? By the evidence of smooth surfaces
and of lobes, with values as read and evened.

Every second line, as of two detectors that take turns; every second incidence; the rows on one side of the plane of
incidence, which an isotropic surface without handedness has no name for; the later ones, where lines come in no order
of the angles, as a lamp fades. Of such groups a surface knows nothing, so that evidence which rises when one of them is
divided by a number can have no other cause. A few bright rows may be off by their own noise, and stir it most where
noise is taken to be the same everywhere; so it is asked once more where bright rows count as little as they may.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.weights import error_model
from photogonio.reconstruct.rows.row_average import grid
from photogonio.reconstruct.rows.row_evidence import RowEvidence
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table
from photogonio.reconstruct.table.neighbours import expected, places

ORDER = 8
LEAST = 0.02  # of the level, as in `mirrored`
MOST_ROWS = 1000  # evenly taken of more
FEWEST = 40  # rows, and
SIDE = 10  # of each group
PAIRS, SAME = 20, np.radians(0.3)  # read at mirrored azimuths, and how alike these are
MIXED = 0.3  # of the squares of their differences; brushed surfaces leave 0.43 and more
PLANE = np.radians(1.0)  # from the plane of incidence, which has no side
STEP = np.radians(0.25)  # within which incidences are one
SCANS = 4
FREE = 0.7  # of the variance of the lines' numbers, that the angles must leave: else they come in their order
FACTORS = np.log([0.5, 0.6, 0.7, 0.8, 0.9, 1 / 0.9, 1 / 0.8, 1 / 0.7, 1 / 0.6, 2.0])
FACTOR = float(np.log(1.05))  # that is told
FLOOR = 0.1  # of the middle value: errors are not less
FINER = np.linspace(-0.1, 0.1, 9)  # of the logarithm, about the likeliest of them


@dataclass(frozen=True, slots=True)
class Uneven:
    """A group of rows that are a multiple of the others."""

    group: str  # "lines" | "scans" | "side" | "order"
    factor: float
    odds: float  # natural logarithm, for it


def uneven_of(samples: GoniometerSamples, value: np.ndarray, least: float) -> Uneven | None:
    """The likeliest group of which ``value`` (n,) are a multiple, of rows in the order that they were written in; None
    where none has odds above ``least``."""
    count = len(value)
    every = -(-count // MOST_ROWS)
    some = np.arange(0, count, every + (every % 2 == 0))  # an even step would leave every second line out
    names = ("theta_i", "phi_i", "theta_r", "phi_r")
    at = {name: getattr(samples, name)[some] for name in names}
    rows = GoniometerSamples(**at, value=value[some, None], sigma=None, channels=samples.channels[:1])
    if len(some) < FEWEST:
        return None
    cells = cells_of(samples_table(rows))
    groups = {name: one for name, one in _groups(cells, some).items() if _tells(one)}
    if not groups:
        return None
    lobes = (LobeSet(), *grid())
    alike = RowEvidence.of(cells, error_model(cells), ORDER, lobes)
    (odds, near), name = max((_odds(alike, group, FACTORS), name) for name, group in groups.items())
    if odds < least:
        return None
    group = groups[name]
    relative = RowEvidence.of(cells, _relative(cells), ORDER, lobes)
    odds, factor = min(_odds(one, group, near + FINER) for one in (alike, relative))
    if odds < least or abs(factor) < FACTOR or (name == "side" and _left_by_sides(cells) > MIXED):
        return None
    return Uneven(name, float(np.exp(factor)), odds)


def _odds(shared: RowEvidence, group: np.ndarray, factors: np.ndarray) -> tuple[float, float]:
    """The greatest odds for one of ``factors``, logarithms, of a group of the values that ``shared`` has, and which."""

    def evidence(factor: float) -> float:
        """Of the values as read, if the evened ones are what a surface says."""
        evened = replace(shared, value=shared.value * np.exp(-factor * group)[:, None])
        return float(evened.evidence(LEAST)[0].max() - factor * group.sum())

    best, factor = max((evidence(one), one) for one in factors.tolist())
    return best - evidence(0.0), factor


def _relative(cells: Cells) -> np.ndarray:
    """(n, 1) errors that grow with the value of a row, and of the rows around it."""
    value = cells.value[:, 0]
    middle = float(
        max(np.median(np.abs(value)), FLOOR * np.mean(np.abs(value)))
    )  # of many zeros the first is one
    at = places(cells.theta_i, cells.theta_r, cells.dphi)
    told = expected(at, np.maximum(value, FLOOR * middle), at, own=True).value
    return (FLOOR * middle + np.maximum(told, value))[:, None]


def _left_by_sides(cells: Cells) -> float:
    """Of the squared logarithms of readings over those at mirrored azimuths, what one factor leaves: that of a brushed
    surface is another in every direction. 0 where few were read on both sides."""
    sine, value = np.sin(cells.phi_r - cells.phi_i), cells.value[:, 0]
    at = places(cells.theta_i, cells.theta_r, cells.dphi)
    one, other = (np.flatnonzero((sign * sine > np.sin(PLANE)) & (value > 0.0)) for sign in (1.0, -1.0))
    if min(len(one), len(other)) < PAIRS:
        return 0.0
    distance, twin = cKDTree(at[other]).query(at[one])
    same = distance < SAME
    if same.sum() < PAIRS:
        return 0.0
    ratio = np.log(value[one[same]] / value[other[twin[same]]])
    return float(np.var(ratio) / max(np.mean(ratio**2), 1e-300))


def _tells(group: np.ndarray) -> bool:
    return min(int((group > 0.0).sum()), int((group < 0.0).sum())) >= SIDE


def _groups(cells: Cells, line: np.ndarray) -> dict[str, np.ndarray]:
    """(n,) each, by which a factor's logarithm is multiplied: half above, half below 0."""
    sine = np.sin(cells.phi_r - cells.phi_i)
    found = {
        "lines": np.where(line % 2 == 1, 0.5, -0.5),
        "side": 0.5 * np.where(np.abs(sine) > np.sin(PLANE), np.sign(sine), 0.0),
    }
    scan, rows = np.unique(np.rint(cells.theta_i / STEP), return_inverse=True, return_counts=True)[1:]
    if SCANS <= len(rows) and rows.min() >= SIDE:
        found["scans"] = np.where(scan.ravel() % 2 == 1, 0.5, -0.5)
    order = (line - line.mean()) / (line[-1] - line[0])
    if _left_by_angles(cells, order) > FREE:
        found["order"] = order
    return found


def _left_by_angles(cells: Cells, order: np.ndarray) -> float:
    """Of the variance of ``order`` (n,), what smooth functions of the angles leave."""
    design = np.column_stack([Basis("isotropic", 4).design(cells), cells.theta_i, cells.theta_r])
    missed = order - design @ np.linalg.lstsq(design, order, rcond=None)[0]
    return float(np.sum(missed**2) / np.sum(order**2))
