"""Neighbouring rows of a very long table joined, so that a fit of them takes minutes and no memory to speak of."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from photogonio.reconstruct.modes.angles import spherical_angles
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples

MOST = 20000  # rows that are fitted one by one
FINEST = 0.5  # degrees, of the cells that are tried first
_EVEN = 0.5  # of those rows, that cells of one size may be; the others are theirs where values differ most in a cell
_HALVINGS = 7  # of such a cell
_SEVERAL, _LEAST = 3, 0.1  # rows of a cell that tell noise, and the share of all that have least of it
_BENT = 4.0  # times noise: values that differ by more lie on a bent surface


@dataclass(frozen=True, slots=True)
class _Level:
    """Cells of one size."""

    cell: np.ndarray  # (rows,) which of them a row is in
    spread: (
        np.ndarray
    )  # (cells,) relative deviation of its values, never above that of the cell it is part of
    above: np.ndarray  # (cells,) that of the other


def merged(samples: GoniometerSamples) -> GoniometerSamples:
    """The samples, or where there are more than :data:`MOST` the means of those whose directions share a cell: mean
    directions, mean values, standard errors as of a mean.

    The mean of a peak is not its value at the mean direction: cells are the smaller the more their values differ, and
    where they still differ by more than noise the row nearest to the middle stands for its cell.
    """
    if len(samples.value) <= MOST:
        return samples
    pair = np.hstack([samples.incident, samples.exit])
    step = FINEST
    while len(np.unique(_keys(pair, np.radians(step)))) > _EVEN * MOST:
        step *= np.sqrt(2.0)
    cell, bent = _cells(pair, samples.value, np.radians(step))
    count = np.bincount(cell)
    mean, value = _means(cell, pair), _means(cell, samples.value)
    middle = _nearest(cell, ((pair - mean[cell]) ** 2).sum(axis=1))
    mean[bent], value[bent] = pair[middle[bent]], samples.value[middle[bent]]
    theta_i, phi_i = spherical_angles(mean[:, :3])
    theta_r, phi_r = spherical_angles(mean[:, 3:])
    sigma = None
    if samples.sigma is not None:
        sigma = np.sqrt(_means(cell, samples.sigma**2) / count[:, None])
        sigma[bent] = samples.sigma[middle[bent]]
    note = f"{len(cell)} rows joined to {len(count)} means of rows within about {step:.1f} degrees, less at peaks"
    return replace(
        samples,
        theta_i=theta_i,
        phi_i=phi_i,
        theta_r=theta_r,
        phi_r=phi_r,
        value=value,
        sigma=sigma,
        line=None,
        notes=(*samples.notes, note),
    )


def _cells(pair: np.ndarray, value: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """(n,) which cell a row is in, of at most :data:`MOST`: those of the step, halved where values differ; and (cells,)
    whether values differ by more than noise there."""
    levels: list[_Level] = []
    for halving in range(_HALVINGS + 1):
        cell = np.unique(_keys(pair, step / 2**halving), return_inverse=True)[1].ravel()
        spread, above = _spread(cell, value), np.full(cell.max() + 1, np.inf)
        if levels:
            above[cell] = levels[-1].spread[levels[-1].cell]
        levels.append(_Level(cell, np.minimum(spread, above), above))
    noise, spread = _noise(levels), np.concatenate([one.spread for one in levels])
    levels[-1] = replace(levels[-1], spread=np.zeros(len(levels[-1].spread)))
    low, high = 1e-6, max(float(levels[0].spread.max()), 1e-6)
    for _ in range(40):
        bound = np.sqrt(low * high)
        few = sum(int(((one.spread <= bound) & (one.above > bound)).sum()) for one in levels) <= MOST
        low, high = (low, bound) if few else (bound, high)
    found, first = np.empty(len(pair), np.int64), 0
    for one in levels:
        whole = ((one.spread <= high) & (one.above > high))[one.cell]
        found[whole] = first + one.cell[whole]
        first += len(one.spread)
    known, cell = np.unique(found, return_inverse=True)
    return cell.ravel(), spread[known] > _BENT * noise


def _noise(levels: list[_Level]) -> float:
    """What values of neighbours differ by where they differ least."""
    found = np.full(len(levels[0].cell), np.inf)
    for one in levels:
        several = (np.bincount(one.cell) >= _SEVERAL)[one.cell]
        found[several] = one.spread[one.cell[several]]
    found = found[np.isfinite(found)]
    return float(np.quantile(found, _LEAST)) if len(found) else 0.0


def _nearest(cell: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """(cells,) the row of each that is nearest."""
    order = np.lexsort((distance, cell))
    return order[np.searchsorted(cell[order], np.arange(cell.max() + 1))]


def _spread(cell: np.ndarray, value: np.ndarray) -> np.ndarray:
    """(cells,) of the worst channel, standard deviation over the mean's size."""
    mean = _means(cell, value)
    apart = np.sqrt(_means(cell, (value - mean[cell]) ** 2))
    return (apart / np.maximum(np.abs(mean), 1e-300)).max(axis=1)


def _means(cell: np.ndarray, value: np.ndarray) -> np.ndarray:
    """(cells, c) mean values."""
    return np.column_stack([np.bincount(cell, column) for column in value.T]) / np.bincount(cell)[:, None]


def _keys(pair: np.ndarray, step: float) -> np.ndarray:
    """(n,) a number for the cell that each pair of directions (n, 6) is in."""
    width = int(2.0 / step) + 2
    keys = np.zeros(len(pair), np.int64)
    for column in pair[:, [0, 1, 3, 4]].T:
        keys = keys * width + np.floor((column + 1.0) / step).astype(np.int64)
    return keys
