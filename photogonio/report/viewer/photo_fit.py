"""How each photo's cells lie about the fit: a photo that others contradict stands out here."""

from __future__ import annotations

import numpy as np

from photogonio.reconstruct.table.cells import Cells
from photogonio.report.sections import Section, Table

FEW = 12  # photos shown without a fold

_TEXT = (
    "Difference: median of what the photo shows over what the fit says, mean of the channels. Misfit: median of its "
    "size. Weight: mean of the robust weights of its cells, about 1; cells which the others contradict have less."
)


def photo_fit(cells: Cells, predicted: np.ndarray, weight: np.ndarray) -> Section | None:
    """A row a photo, from its cells, the fit (n, c) in 1/sr and the robust weights (n, c); None of a single group, as
    tables have."""
    if len(cells.groups) < 2:
        return None
    ratio = (
        np.divide(cells.value, predicted, out=np.full_like(predicted, np.nan), where=predicted > 0.0) - 1.0
    )
    rows = []
    for k, name in enumerate(cells.groups):
        mine = cells.group == k
        off = ratio[mine & np.isfinite(ratio).all(1)]
        if not len(off):
            rows.append((name, str(int(mine.sum())), "–", "–", "–"))
            continue
        middle, size = np.median(off, axis=0).mean(), np.median(np.abs(off), axis=0).mean()
        rows.append(
            (
                name,
                str(int(mine.sum())),
                f"{100 * middle:+.2f} %",
                f"{100 * size:.2f} %",
                f"{weight[mine].mean():.2f}",
            )
        )
    head = ("photo", "cells", "difference", "misfit", "weight")
    return Section("Fit by photo", Table(head, rows), _TEXT, folded=len(rows) > FEW)
