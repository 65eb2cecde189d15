"""The model a fit works with: modes plus lobes of any family, before it is said in the coefficient file's terms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.lobes.families import Family, lobe_columns
from photogonio.reconstruct.table.cells import Cells

STEP = 0.02  # of a shape's logarithm, in finite differences


@dataclass(frozen=True, slots=True)
class LobeSet:
    """Zero or more lobe families with the nonlinear parameters of each."""

    families: tuple[Family, ...] = ()
    shapes: tuple[np.ndarray, ...] = ()  # (p,) each, in the order of the family's shape_names

    def columns(self, cells: Cells) -> tuple[np.ndarray, np.ndarray]:
        """Fixed part (n,) and columns (n, q) of all lobes together."""
        parts = [self.columns_of(k, cells) for k in range(len(self.families))]
        if len(parts) == 1:
            return parts[0]
        fixed, columns = np.zeros(len(cells)), [np.empty((len(cells), 0))]
        for part, extra in parts:
            fixed += part
            columns.append(extra)
        return fixed, np.hstack(columns)

    def columns_of(self, k: int, cells: Cells) -> tuple[np.ndarray, np.ndarray]:
        """Fixed part (n,) and columns (n, q) of one lobe."""
        family, shape = self.families[k], self.shapes[k]
        if family.turning:
            turns = cells.phi_r - cells.phi_i, cells.phi_i
            return lobe_columns(family, shape, cells.theta_i, cells.theta_r, *turns)
        return lobe_columns(family, shape, cells.theta_i, cells.theta_r, cells.dphi)

    def upper_bounds(self) -> np.ndarray:
        """Of all lobes' coefficients, (q,)."""
        return np.concatenate([np.empty(0), *(family.upper_bounds() for family in self.families)])

    def flat(self) -> np.ndarray:
        """Logarithms of all nonlinear parameters, (p,): inverse of :meth:`with_flat`."""
        return np.log(np.concatenate([np.empty(0), *self.shapes]))

    def with_flat(self, logs: np.ndarray) -> LobeSet:
        """The same families with other nonlinear parameters, given as logarithms."""
        sizes = np.cumsum([len(family.shape_names) for family in self.families])[:-1]
        return LobeSet(self.families, tuple(np.split(np.exp(logs), sizes)) if self.families else ())

    @property
    def turning(self) -> bool:
        """Whether any lobe changes when the sample is turned."""
        return any(family.turning for family in self.families)

    @property
    def name(self) -> str:
        return " + ".join(family.name for family in self.families) or "none"


@dataclass(frozen=True, slots=True)
class Model:
    """A fitted model, 1/sr."""

    basis: Basis
    coefficients: np.ndarray  # (m, c)
    lobes: LobeSet
    lobe_coefficients: np.ndarray  # (q, c)

    @property
    def turning(self) -> bool:
        """Whether the azimuths against the sample matter, and not only their difference."""
        return self.basis.symmetry != "isotropic" or self.lobes.turning

    def evaluate(self, cells: Cells) -> np.ndarray:
        """Values (n, c) at the cells' mean directions."""
        fixed, columns = self.lobes.columns(cells)
        value = columns @ self.lobe_coefficients
        value += fixed[:, None]
        value += self.basis.evaluate(cells, self.coefficients)
        return value


def shape_slopes(model: Model, cells: Cells) -> np.ndarray:
    """(n, p, c) derivatives of f by the logarithms of the lobes' shapes."""
    logs = model.lobes.flat()
    channels = model.coefficients.shape[1]
    derivative = np.zeros((len(cells), len(logs), channels))
    for p in range(len(logs)):
        ends = []
        for step in (-STEP, STEP):
            fixed, columns = model.lobes.with_flat(_moved(logs, p, step)).columns(cells)
            ends.append(fixed[:, None] + columns @ model.lobe_coefficients)
        derivative[:, p] = (ends[1] - ends[0]) / (2 * STEP)
    return derivative


def _moved(logs: np.ndarray, p: int, step: float) -> np.ndarray:
    moved = logs.copy()
    moved[p] += step
    return moved
