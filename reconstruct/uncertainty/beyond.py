"""What no parameter of the file says of its errors: what all photos miss alike, and what was never seen.

Both are known anywhere, by a tree of neighbours and by other models; the file has a small table of each over angles,
relative to f. A node's value is what holds in its neighbourhood on the high side, so that the file claims no more than
the fit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.errors import RelativeTable
from photogonio.reconstruct.brdf.parameters import slopes
from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.estimate.model_discrepancy import Misfit
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.budget import Uncertainty
from scipy.stats import qmc

# nodes in degrees: of both polar angles, and of the difference of azimuths; the first that do are taken
GRIDS = (
    ((45.0,), (90.0,)),
    ((15.0, 45.0, 75.0), (30.0, 90.0, 150.0)),
    ((10.0, 30.0, 50.0, 70.0), (15.0, 45.0, 75.0, 105.0, 135.0, 165.0)),
)
ENOUGH = 0.1  # of the whole standard error: what a table may be off by, rms
PAIRS = 4096  # at which errors are known
HIGHEST = 85.0  # degrees
HIGH = 0.75  # quantile of a neighbourhood that a node holds
MOST = 5.0  # relative: where f is all but nothing
NOTHING = 1e-4  # relative: a smaller error is none
DIGITS = 2


@dataclass(frozen=True, slots=True)
class Beyond:
    """Relative errors (n, c) at pairs of directions, and the whole standard error, for comparison."""

    cells: Cells
    misfit: np.ndarray
    unseen: np.ndarray
    whole: np.ndarray


def tables_of(
    brdf: Brdf, model: Model, spread: Uncertainty, misfit: Misfit, known: float
) -> tuple[RelativeTable | None, RelativeTable | None]:
    """Tables of what all photos miss alike, and of what was not seen, of ``brdf`` with its covariance.

    Where it departs from the ``model`` to keep to physics, that many over ``known`` are a standard error.
    """
    found = _beyond(brdf, model, spread, misfit, known)
    return _table(found, found.misfit), _table(found, found.unseen)


def _beyond(brdf: Brdf, model: Model, spread: Uncertainty, misfit: Misfit, known: float) -> Beyond:
    cells = _pairs()
    value = brdf.evaluate(cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r)
    said = model.evaluate(cells)
    size = np.maximum(np.abs(value), misfit.floor)
    missed = np.hypot(misfit.at(cells, said), (value - said) / known)
    total = spread.standard_error(model, cells)
    change = slopes(brdf, cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r, brdf.uncertainty.parameters)
    own = np.einsum("npc,cpq,nqc->nc", change, brdf.uncertainty.spread(), change, optimize=True)
    rest = np.maximum(total**2 - own - (spread.scale_error * value) ** 2, 0.0)
    return Beyond(
        cells,
        np.minimum(missed / size, MOST),
        np.minimum(np.sqrt(rest) / size, MOST),
        np.hypot(total, missed) / size,
    )


def _pairs() -> Cells:
    """Evenly spread over angles, at all azimuths of the sample."""
    unit = qmc.Halton(4, scramble=False).random(PAIRS)
    theta_i, theta_r = np.radians(HIGHEST) * unit[:, :2].T
    phi, dphi = 2.0 * np.pi * unit[:, 3], np.pi * unit[:, 2]
    return Cells.of_directions(theta_i, phi, theta_r, phi + dphi)


def _table(found: Beyond, relative: np.ndarray) -> RelativeTable | None:
    """The smallest that says ``relative`` (n, c) closely enough; None of nothing."""
    if relative.max(initial=0.0) < NOTHING:
        return None
    cells, whole = found.cells, np.sqrt(np.mean(found.whole**2))
    best, missed = None, np.inf
    for theta, dphi in GRIDS:
        table = _on_grid(cells, relative, np.array(theta), np.array(dphi))
        said = table.at(cells.theta_i, cells.theta_r, cells.dphi)[:, None]
        off = np.sqrt(np.mean((said**2 - relative**2) ** 2 / np.maximum(found.whole, NOTHING) ** 2))
        if best is None or off < missed - ENOUGH * whole:
            best, missed = table, off
    return best


def _on_grid(cells: Cells, relative: np.ndarray, theta: np.ndarray, dphi: np.ndarray) -> RelativeTable:
    """Nodes that hold what is in their neighbourhoods: the same for a pair and its reciprocal twin."""
    i, r = (_hats(np.degrees(angle), theta) for angle in (cells.theta_i, cells.theta_r))
    d = _hats(np.degrees(np.abs(cells.dphi)), dphi)
    values = np.empty((len(theta), len(theta), len(dphi)))
    for a in range(len(theta)):
        for b in range(a + 1):
            for k in range(len(dphi)):
                weight = (i[:, a] * r[:, b] + i[:, b] * r[:, a]) * d[:, k]
                values[a, b, k] = values[b, a, k] = _high(relative, weight)
    scale = 10.0 ** (DIGITS - 1 - np.floor(np.log10(np.maximum(values, NOTHING))))
    return RelativeTable(theta, theta, dphi, np.ceil(values * scale - 1e-9) / scale)


def _hats(angle: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """(n, k) how much of each node bilinear interpolation takes at ``angle`` (n,)."""
    return np.stack([np.interp(angle, nodes, unit) for unit in np.eye(len(nodes))], axis=1)


def _high(relative: np.ndarray, weight: np.ndarray) -> float:
    """Of values (n, c) with weights (n,) the root mean square, or the quantile :data:`HIGH` if that is more."""
    near = weight > 0.0
    values = relative[near].ravel()
    parts = np.repeat(weight[near], relative.shape[1])
    order = np.argsort(values)
    rank = np.cumsum(parts[order]) / parts.sum()
    quantile = float(values[order][min(int(np.searchsorted(rank, HIGH)), len(values) - 1)])
    return max(quantile, float(np.sqrt(np.average(values**2, weights=parts))))
