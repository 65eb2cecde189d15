"""What no parameter of the file says of its errors: what all photos miss alike, and what was never seen.

Both are known anywhere, by a tree of neighbours and by other models; the file has a small table of each over angles,
relative to f. It is fitted a little on the high side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import nnls

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.errors import RelativeTable
from photogonio.reconstruct.brdf.parameters import slopes
from photogonio.reconstruct.estimate.model import Model
from photogonio.reconstruct.estimate.model_discrepancy import Misfit
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.budget import Uncertainty

# nodes in degrees: of both polar angles, and of the difference of azimuths; the first that do are taken
GRIDS = (
    ((45.0,), (90.0,)),
    ((20.0, 60.0, 85.0), (45.0, 135.0)),
    ((15.0, 45.0, 75.0, 87.0), (30.0, 90.0, 150.0)),
)
ENOUGH = 0.1  # of the whole variance: what a finer table must mend in the mean
PAIRS = 2048  # at which errors are known
HIGHEST = 88.0  # degrees: an albedo has a tenth of its light from beyond 70
HIGH = 2.0  # judged by how many intervals of drawn sets hold: with 4 they were too wide, with 1 too narrow at peaks
ROUNDS = 6
MOST = 5.0  # relative: where f is all but nothing
NOTHING = 1e-4  # relative: a smaller error is none
DIGITS = 2


@dataclass(frozen=True, slots=True)
class Sampled:
    """A fit and its errors at pairs of directions, 1/sr."""

    cells: Cells
    value: np.ndarray  # (n, c) f
    size: np.ndarray  # (n, c) the same, at least the floor
    missed: np.ndarray  # (n, c) what all photos miss alike, and departures from the fit
    total: np.ndarray  # (n, c) standard error without that, and without the scale's
    scale: float  # relative, of the scale that all share
    change: np.ndarray  # (n, p, c) derivatives by the file's parameters

    @classmethod
    def of(
        cls, brdf: Brdf, names: Sequence[str], model: Model, spread: Uncertainty, misfit: Misfit, known: float
    ) -> Sampled:
        """Of ``brdf`` whose parameters are ``names``; of its departure from the ``model``, to keep to physics,
        ``known`` are a standard error."""
        cells = _pairs()
        angles = cells.theta_i, cells.phi_i, cells.theta_r, cells.phi_r
        value, said = brdf.evaluate(*angles), model.evaluate(cells)
        return cls(
            cells,
            value,
            np.maximum(np.abs(value), misfit.floor),
            np.hypot(misfit.at(cells, said), (value - said) / known),
            replace(spread, scale_error=0.0).standard_error(model, cells, said),
            spread.scale_error,
            slopes(brdf, angles, names),
        )

    @property
    def whole(self) -> np.ndarray:
        """(n, c) standard error of all together."""
        return np.sqrt(self.total**2 + self.missed**2 + (self.scale * self.value) ** 2)


def tables_of(
    at: Sampled, covariance: np.ndarray, wider: float
) -> tuple[RelativeTable | None, RelativeTable | None]:
    """Tables of what all photos miss alike, and of what is not seen, beside the ``covariance`` (c, p, p), so
    that all together are ``wider`` by that factor than the fit's own errors."""
    channels = zip(np.moveaxis(at.change, 2, 0), covariance, strict=True)
    own = np.stack([np.sum(change @ known * change, axis=1) for change, known in channels], axis=1)
    rest = np.maximum((wider * at.total) ** 2 - own, 0.0)
    whole = np.maximum(at.whole / at.size, NOTHING)
    missed, unseen = (np.minimum(one / at.size, MOST) for one in (wider * at.missed, np.sqrt(rest)))
    return _table(at.cells, missed, whole), _table(at.cells, unseen, whole)


def _pairs() -> Cells:
    """Evenly spread over angles, at all azimuths of the sample."""
    unit = np.stack([halton(PAIRS, base) for base in (2, 3, 5, 7)], axis=1)
    theta_i, theta_r = np.radians(HIGHEST) * unit[:, :2].T
    phi, dphi = 2.0 * np.pi * unit[:, 3], np.pi * unit[:, 2]
    return Cells.of_directions(theta_i, phi, theta_r, phi + dphi)


def halton(count: int, base: int) -> np.ndarray:
    """(count,) van der Corput's sequence; scipy.stats has it as well, and half a second of imports."""
    left, share, found = np.arange(count), 1.0 / base, np.zeros(count)
    while left.any():
        left, digit = np.divmod(left, base)
        found += share * digit
        share /= base
    return found


def _table(cells: Cells, relative: np.ndarray, whole: np.ndarray) -> RelativeTable | None:
    """The smallest that says ``relative`` (n, c) closely enough, beside the ``whole`` error; None of nothing."""
    if relative.max(initial=0.0) < NOTHING:
        return None
    best, missed = None, np.inf
    for theta, dphi in GRIDS:
        table = _on_grid(cells, relative, whole, np.array(theta), np.array(dphi))
        said = table.at(cells.theta_i, cells.theta_r, cells.dphi)[:, None]
        off = np.mean(np.abs(said**2 - relative**2) / whole**2)
        if best is None or off < missed - ENOUGH:
            best, missed = table, off
    return best


def _on_grid(
    cells: Cells, relative: np.ndarray, whole: np.ndarray, theta: np.ndarray, dphi: np.ndarray
) -> RelativeTable:
    """Nodes between which ``relative`` is said on the high side, the same for a pair and its reciprocal twin: least
    squares of what is said over the ``whole`` error, that count :data:`HIGH` times as much where too little is said."""
    i, r = (_hats(np.degrees(angle), theta) for angle in (cells.theta_i, cells.theta_r))
    d = _hats(np.degrees(np.abs(cells.dphi)), dphi)
    first, second = np.tril_indices(len(theta))
    both = i[:, first] * r[:, second] + np.where(first == second, 0.0, i[:, second] * r[:, first])
    design = np.einsum("na,nk->nak", both, d).reshape(len(d), -1)
    weight, counts = whole**-2.0, np.ones_like(whole)
    for _ in range(ROUNDS):
        each = counts * weight  # channels' squares at a pair are, but for a constant, those of their mean
        total = each.sum(1)
        root, mean = np.sqrt(total), np.sum(each * relative, axis=1) / total
        found = nnls(design * root[:, None], root * mean)[0]
        counts = np.where((design @ found)[:, None] < relative, HIGH, 1.0)
    values = np.empty((len(theta), len(theta), len(dphi)))
    values[first, second] = values[second, first] = found.reshape(len(first), len(dphi))
    scale = 10.0 ** (DIGITS - 1 - np.floor(np.log10(np.maximum(values, NOTHING))))
    return RelativeTable(theta, theta, dphi, np.ceil(values * scale - 1e-9) / scale)


def _hats(angle: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """(n, k) how much of each node bilinear interpolation takes at ``angle`` (n,)."""
    return np.stack([np.interp(angle, nodes, unit) for unit in np.eye(len(nodes))], axis=1)
