"""Modes that were asked for, alone, on rows that determine them: a prior may not cost what the rows show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogonio.reconstruct.estimate.folded_design import FoldedDesign
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model_selection import NO_PRIOR, Candidate
from photogonio.reconstruct.estimate.normal_equations import Factors, solve
from photogonio.reconstruct.estimate.weights import level
from photogonio.reconstruct.table.cells import Cells

ROWS_A_MODE = 8  # so many determine the modes
WORSE = 1.05  # of the misfit of plain least squares, at most


def close_to_rows(
    tried: Sequence[Candidate], cells: Cells, weight: np.ndarray, symmetry: str
) -> list[Candidate]:
    """Those of ``tried``, of one order and no lobes, whose misfit of the rows is about that of least squares, if these
    determine the modes; ``weight`` (n, c). Neighbourhoods that are left out would ask for a surface without its peaks.
    """
    basis = Basis(symmetry, tried[0].order)
    if len(cells) < ROWS_A_MODE * len(basis.modes):
        return list(tried)
    folded = FoldedDesign(basis.design(cells), weight, np.zeros(len(cells), int))
    sums = folded.statistics(cells.value, np.empty((len(cells), 0)))

    def misfit(one: Candidate) -> np.ndarray:
        penalty = one.prior.precision(basis.degree(), level(cells))
        return np.sqrt(sums.residual(solve(sums, Factors(sums.modes_gram, penalty), np.empty(0)))[0])

    least = misfit(Candidate(tried[0].order, NO_PRIOR, tried[0].lobes, tried[0].loss))
    close = [one for one in tried if (misfit(one) <= WORSE * least).all()]
    return close or [min(tried, key=lambda one: misfit(one).sum())]
