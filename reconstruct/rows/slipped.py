"""Do the values of a table stand a row or two beside their directions? By the evidence of smooth surfaces, with values
as read and moved.

A column that was pasted a row too low, or a value that was lost on the way, leaves every angle and every value as it
should be, and no pair together. Within a scan that is a small turn, which a surface may have; from the end of one scan
to the beginning of the next it is not, nor do exchanged pairs and mirror twins agree then.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.weights import error_model, level
from photogonio.reconstruct.rows.narrow import narrow_peak
from photogonio.reconstruct.rows.row_average import grid
from photogonio.reconstruct.rows.row_evidence import RowEvidence
from photogonio.reconstruct.table.cells import cells_of
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table

ORDER = 8
LEAST = 0.02  # of the level, as in `mirrored`
FEWEST = 40  # rows
MOST_ROWS = 1000  # evenly taken of more
BY = (1, -1, 2, -2)  # rows that all values may be off
MOST = 0.5  # of the rows turn alike
FROM = np.arange(0.1, 0.95, 0.1)  # of the rows, from where on they may be one off


@dataclass(frozen=True, slots=True)
class Slip:
    """How values would have to be moved."""

    by: int  # rows toward the table's end
    first: int  # the first row that is moved; 0: all are
    odds: float  # natural logarithm, that they have slipped so over that they have not

    def mended(self, value: np.ndarray) -> np.ndarray:
        """Values (n, ...) moved; what is pushed over one end comes in at the other."""
        return np.concatenate([value[: self.first], np.roll(value[self.first :], self.by, axis=0)])


def slip_of(
    samples: GoniometerSamples, value: np.ndarray, least: float, *, turns: bool = False
) -> Slip | None:
    """The likeliest slip of ``value`` (n,), of rows in the order that they were written in; None where none has odds
    above ``least``, with lobes or by smooth modes alone, which a peak beside its direction does not stir. ``turns``:
    azimuths that count from elsewhere are no slip."""
    if len(value) < FEWEST:
        return None
    slips = [Slip(by, 0, 0.0) for by in BY]
    slips += [Slip(by, int(share * len(value)), 0.0) for share in FROM.tolist() for by in (1, -1)]
    some = np.arange(0, len(value), -(-len(value) // MOST_ROWS))
    peak = narrow_peak(samples.theta_i, samples.theta_r, samples.phi_r - samples.phi_i, value)
    if peak is not None:  # of which each row is alone
        some = some[~peak.rows[some]]
        if len(some) < FEWEST:
            return None
    moved = [value[some], *(one.mended(value)[some] for one in slips)]
    told = _evidence(samples, some, moved, (LobeSet(),))
    best = int(np.argmax(told))
    if told[best] - told[0] < least:
        return None
    as_read, mended = _evidence(samples, some, [moved[0], moved[best]], (LobeSet(), *grid()))
    odds = float(min(mended - as_read, told[best] - told[0]))
    slip = replace(slips[best - 1], odds=odds)
    if odds < least or (turns and told[best] - _turned(samples, some, moved[0], slip) < least):
        return None
    return slip


def _turned(samples: GoniometerSamples, some: np.ndarray, value: np.ndarray, slip: Slip) -> float:
    """The evidence of values (k,) as read at azimuths that are off by as much as the slip would make it, in most
    rows."""
    dphi = (samples.phi_r - samples.phi_i)[slip.first :]
    steps = np.rint(np.degrees(np.roll(dphi, -slip.by) - dphi) % 360.0)
    turn, count = np.unique(steps, return_counts=True)
    if count.max() < MOST * len(steps):
        return -np.inf
    turned = replace(samples, phi_r=samples.phi_r + np.radians(turn[count.argmax()]))
    return _evidence(turned, some, [value], (LobeSet(),))[0]


def _evidence(
    samples: GoniometerSamples, some: np.ndarray, values: list[np.ndarray], lobes: tuple[LobeSet, ...]
) -> list[float]:
    """Logarithm of the evidence of each of several ``values`` (k,) at the rows ``some`` (k,)."""
    names = ("theta_i", "phi_i", "theta_r", "phi_r")
    at = {name: getattr(samples, name)[some] for name in names}
    rows = GoniometerSamples(**at, value=values[0][:, None], sigma=None, channels=samples.channels[:1])
    cells = cells_of(samples_table(rows))
    shared, size = RowEvidence.of(cells, error_model(cells), ORDER, lobes), level(cells)
    return [float(replace(shared, value=one[:, None] / size).evidence(LEAST)[0].max()) for one in values]
