"""Neighbouring rows of a very long table joined, so that a fit of them takes minutes and no memory to speak of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from photogonio.reconstruct.modes.angles import spherical_angles
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples

MOST = 20000  # rows that are fitted one by one
FINEST = 0.5  # degrees, of the cells that are tried first


def merged(samples: GoniometerSamples) -> GoniometerSamples:
    """The samples, or where there are more than :data:`MOST` the means of those whose directions share a cell: mean
    directions, mean values, standard errors as of a mean."""
    if len(samples.value) <= MOST:
        return samples
    pair = np.hstack([samples.incident, samples.exit])
    step = FINEST
    while True:
        keys = _keys(pair, np.radians(step))
        if len(np.unique(keys)) <= MOST:
            break
        step *= np.sqrt(2.0)
    cell = np.unique(keys, return_inverse=True)[1].ravel()
    count = np.bincount(cell)
    size = count[:, None]
    mean = np.column_stack([np.bincount(cell, column) for column in pair.T]) / size
    theta_i, phi_i = spherical_angles(mean[:, :3])
    theta_r, phi_r = spherical_angles(mean[:, 3:])
    value = np.column_stack([np.bincount(cell, column) for column in samples.value.T]) / size
    sigma = None
    if samples.sigma is not None:
        sigma = np.sqrt(np.column_stack([np.bincount(cell, column**2) for column in samples.sigma.T])) / size
    note = f"{len(cell)} rows joined to {len(count)} means of rows within about {step:.1f} degrees"
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


def _keys(pair: np.ndarray, step: float) -> np.ndarray:
    """(n,) a number for the cell that each pair of directions (n, 6) is in."""
    width = int(2.0 / step) + 2
    keys = np.zeros(len(pair), np.int64)
    for column in pair[:, [0, 1, 3, 4]].T:
        keys = keys * width + np.floor((column + 1.0) / step).astype(np.int64)
    return keys
