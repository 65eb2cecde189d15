"""Do measured rows follow a mirror lobe at a wrong azimuth? By the evidence of lobes, with azimuths as read and turned.

Smooth modes know no side: turned by half a turn of azimuth they are as likely. A gloss is not, since it widens and
grows toward grazing as no peak about the light's own direction does; nor is a retro-reflector, the other way about.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.weights import error_model
from photogonio.reconstruct.rows.row_average import grid
from photogonio.reconstruct.rows.row_evidence import RowEvidence
from photogonio.reconstruct.table.cells import Cells

ORDER = 8
LEAST = 0.02  # of the level: no lobe says a surface to less, and rows without noise would make much of that
GLOSS = 0.5  # roughness: what rises more broadly toward the lamp may be a rough matte surface
MOST_ROWS = 1000  # evenly taken of more


def mirrored_odds(cells: Cells, turned: Cells | None = None) -> float:
    """Logarithm of the odds that azimuths of the same rows are as ``turned`` has them, not as in ``cells``; None:
    counted from the mirror side instead of the lamp's."""
    turned = replace(cells, dphi=np.pi - cells.dphi) if turned is None else turned
    some = np.arange(0, len(cells), -(-len(cells) // MOST_ROWS))
    cells, turned = cells.take(some), turned.take(some)
    gloss = [one for one in grid() if one.shapes[0][0] <= GLOSS]
    as_read, other = (
        RowEvidence.of(one, error_model(one), ORDER, (LobeSet(), *lobes)).evidence(LEAST)[0].max()
        for one, lobes in ((cells, grid()), (turned, gloss))
    )
    return float(other - as_read)
