"""Any BRDF that a file holds, ready to be compared: coefficients, truth, MERL, a grid or a table."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from capture.errors import InputError
from photogonio.metrics import Directions
from reconstruct.angles import spherical_angles, unit_vectors
from reconstruct.brdf import load_brdf
from reconstruct.measured import read_samples
from reconstruct.merl import CHANNELS, read_merl

Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True, slots=True)
class Known:
    """A BRDF known everywhere (``evaluate``), or at given pairs of directions only (``at`` and ``value``)."""

    name: str
    channels: tuple[str, ...]
    isotropic: bool
    evaluate: Evaluate | None = None  # incident, exit (n, 3) -> (n, c), 1/sr
    at: Directions | None = None
    value: np.ndarray | None = None  # (n, c) 1/sr


def load_known(path: str | Path) -> Known:
    """Read a BRDF: coefficients or truth (.json), MERL (.binary), a grid (.npz) or a table (.csv).

    Raises:
        InputError: no such file, or none of these.
    """
    path = Path(path)
    readers = {".json": _read_json, ".binary": _read_merl, ".npz": _read_grid, ".csv": _read_table}
    if path.is_dir():
        path = next(
            (path / name for name in ("coefficients.json", "truth.json") if (path / name).is_file()), path
        )
    if not path.is_file():
        raise InputError(path, "no such file; expected a BRDF (.json, .binary, .npz or .csv)")
    if path.suffix not in readers:
        raise InputError(path, f"expected a BRDF: one of {', '.join(readers)}")
    return readers[path.suffix](path)


def _read_json(path: Path) -> Known:
    brdf = load_brdf(path)
    return Known(
        name=path.name,
        channels=brdf.channels,
        isotropic=brdf.symmetry == "isotropic",
        evaluate=brdf.evaluate,
    )


def _read_merl(path: Path) -> Known:
    return Known(path.name, CHANNELS, isotropic=True, evaluate=read_merl(path).evaluate)


def _read_grid(path: Path) -> Known:
    """Arrays ``grid`` (n, 3) of theta_i, theta_r, dphi in radians, and ``brdf`` (n, c)."""
    try:
        with np.load(path, allow_pickle=False) as file:
            grid, value = np.asarray(file["grid"], float), np.asarray(file["brdf"], float)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        raise InputError(path, "expected arrays `grid` and `brdf`") from None
    if grid.ndim != 2 or grid.shape[1] != 3 or value.shape[:1] != grid.shape[:1]:
        raise InputError(path, f"expected grid (n, 3) and brdf (n, c), found {grid.shape} and {value.shape}")
    theta_i, theta_r, dphi = grid.T
    at = _at(unit_vectors(theta_i, np.zeros_like(dphi)), unit_vectors(theta_r, dphi))
    value = value.reshape(len(grid), -1)
    return Known(path.name, _names(value.shape[1]), isotropic=True, at=at, value=value)


def _read_table(path: Path) -> Known:
    samples = read_samples(path)
    at = _at(samples.incident, samples.exit)
    return Known(path.name, samples.channels, isotropic=False, at=at, value=samples.value)


def _at(incident: np.ndarray, exit: np.ndarray) -> Directions:
    """Given directions, each weighted as a node of an even grid of angles."""
    polar = [spherical_angles(v)[0] for v in (incident, exit)]
    return Directions(incident, exit, np.sin(polar[0]) * np.sin(polar[1]))


def _names(count: int) -> tuple[str, ...]:
    return CHANNELS if count == 3 else tuple(f"c{k}" for k in range(count))
