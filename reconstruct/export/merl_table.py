"""MERL's binary table, which many renderers and tools open."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.merl import SHAPE, Merl, bin_values, bins_of, read_merl, write_merl
from photogonio.reconstruct.export.loss import ANGLES
from photogonio.reconstruct.export.rgb import rgb_order
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.modes.mirror_quadrature import scattered_around

_NODES, _MORE = 3000, 20_000  # of an albedo's quadrature, on either side of the mirror's angle
_SLACK = 0.002  # of an albedo, that bins may add
_ROUNDS = 30  # of lowering


class NearestBins:
    """f of a file as MERL's own reader has it."""

    def __init__(self, path: Path):
        self.table: Merl = read_merl(path)

    def __call__(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        """(n, 3), 1/sr, of unit vectors (n, 3)."""
        return self.table.evaluate(incident, exit)

    def albedo(self, incident: np.ndarray) -> np.ndarray:
        """(n, 3) directional albedo of light from unit vectors (n, 3)."""
        found = []
        for theta in np.arccos(incident[:, 2]):
            exit, weight = scattered_around(theta, _MORE)
            toward = np.broadcast_to(unit_vectors(theta, 0.0), exit.shape)
            found.append(weight @ np.nan_to_num(self(toward, exit)))
        return np.array(found)


def write_merl_table(brdf: Brdf, path: Path) -> None:
    """Isotropic BRDFs of the channels R, G, B (any three, in order) or of one channel, which is repeated.

    Bins hold f at their centres (means over them are no nearer to f for who reads the nearest bin), lowered where that
    reader would see light added: toward grazing f rises by per cents within a bin.

    Raises:
        InputError: the format cannot hold this BRDF.
    """
    if brdf.turning:
        raise InputError("--format merl", "holds isotropic BRDFs only; this one changes as the sample turns")
    count = len(brdf.channels)
    if count not in (1, 3):
        raise InputError("--format merl", f"holds three channels; this BRDF has {', '.join(brdf.channels)}")
    order = rgb_order(brdf.channels)

    def evaluate(incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        f = brdf(incident, exit)
        return f[:, order] if order else np.broadcast_to(f, (len(f), 3))

    value = bin_values(evaluate)
    write_merl(path, value * _held(evaluate, value)[None, :, None])


def _held(evaluate: Callable[[np.ndarray, np.ndarray], np.ndarray], value: np.ndarray) -> np.ndarray:
    """(90, c) factors, at most 1, of the bins of each difference angle, with which no more light is sent out than f
    (n, 3) does, from the lower edge of each such bin on, where bins are brightest beside it."""
    edges = np.radians(np.append(np.arange(ANGLES[-1]) + 0.02, ANGLES[-1]))
    sent, source = np.zeros((len(edges), SHAPE[1], 3)), np.empty((len(edges), 3))
    for k, angle in enumerate(edges):
        exit, weight = scattered_around(angle, _NODES)
        incident = np.broadcast_to(unit_vectors(angle, 0.0), exit.shape)
        bins = bins_of(incident, exit)
        np.add.at(sent[k], bins[1], weight[:, None] * np.nan_to_num(value[bins]))
        source[k] = weight @ np.maximum(evaluate(incident, exit), 0.0)
    share = sent / np.maximum(sent.max(axis=1, keepdims=True), 1e-300)
    factor = np.ones((SHAPE[1], 3))
    for _ in range(_ROUNDS):
        over = 1.0 - (1.0 + _SLACK) * source / np.maximum((sent * factor).sum(axis=1), 1e-300)
        factor *= 1.0 - (share * np.maximum(over, 0.0)[:, None]).max(axis=0)
    return factor
