"""MERL's binary BRDF tables: read, looked up and written.

Matusik, Pfister, Brand & McMillan, "A Data-Driven Reflectance Model" (SIGGRAPH 2003): 90 x 90 x 180 half and
difference angles (Rusinkiewicz 1998), theta_half spaced by the square root, phi_difference over half a turn
(reciprocity).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.modes.angles import from_half_difference, half_difference

SHAPE = (90, 90, 180)  # theta_half, theta_difference, phi_difference
CHANNELS = ("R", "G", "B")
_SCALE = np.array([1.0, 1.15, 1.66]) / 1500.0  # of the stored numbers, by MERL's own reader


@dataclass(frozen=True, slots=True)
class Merl:
    """An isotropic, reciprocal table of three channels."""

    value: np.ndarray  # (90, 90, 180, 3) 1/sr; NaN where MERL marks a pair as not measured

    def evaluate(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        """f (n, 3), 1/sr, of unit vectors (n, 3) in the tangent frame: the bin's, as in MERL's reader; of bins that the
        horizon cuts, that of the next."""
        return self.value[bins_of(incident, exit)]


def bins_of(incident: np.ndarray, exit: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,) each, which bin of a table answers for unit vectors (n, 3): see :meth:`Merl.evaluate`."""
    theta_h, theta_d, phi_d = half_difference(incident, exit)
    h = np.clip((90.0 * np.sqrt(theta_h / (np.pi / 2))).astype(int), 0, 89)
    d = np.clip((theta_d / (np.pi / 2) * 90.0).astype(int), 0, 89)
    p = np.clip((np.mod(phi_d, np.pi) / np.pi * 180.0).astype(int), 0, 179)
    below = _centred_below()  # bins that the horizon cuts, whose middles nobody measures
    above = (incident[:, 2] > 0.0) & (exit[:, 2] > 0.0)
    for _ in range(SHAPE[1]):
        cut = above & below[h, d, p] & (d > 0)
        if not cut.any():
            break
        d = d - cut
    return h, d, p


def read_merl(path: Path) -> Merl:
    """Read a MERL ``.binary``.

    Raises:
        InputError: no such file, or not 90 x 90 x 180 numbers of three channels.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}") from None
    count = 3 * int(np.prod(SHAPE))
    if len(data) != 12 + 8 * count or tuple(np.frombuffer(data[:12], "<i4")) != SHAPE:
        raise InputError(path, "is no MERL table; expected 90 x 90 x 180 numbers of three channels")
    value = np.moveaxis(np.frombuffer(data[12:], "<f8").reshape(3, *SHAPE), 0, -1)
    return Merl(np.where(value < 0, np.nan, value * _SCALE))


def is_merl(path: Path) -> bool:
    """Whether a file begins and is as long as one."""
    if not path.is_file() or path.stat().st_size != 12 + 24 * int(np.prod(SHAPE)):
        return False
    with path.open("rb") as file:
        return tuple(np.frombuffer(file.read(12), "<i4")) == SHAPE


def write_merl(path: Path, value: np.ndarray) -> None:
    """Write the bins' values (90, 90, 180, 3), 1/sr; inverse of :func:`read_merl`.

    NaN, of pairs with a direction below the surface, is marked -1, as MERL does; negative values become 0.
    """
    stored = np.where(np.isnan(value), -1.0, np.maximum(value, 0.0) / _SCALE).reshape(-1, 3)
    with path.open("wb") as file:
        file.write(np.array(SHAPE, "<i4").tobytes())
        file.write(np.ascontiguousarray(stored.T, "<f8").tobytes())


def bin_values(brdf: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
    """(90, 90, 180, 3) f(incident (n, 3), exit (n, 3)) -> (n, 3) at the bins' centres; NaN below the surface."""
    incident, exit = bin_centres()
    value = np.full((len(incident), 3), np.nan)
    above = (incident[:, 2] > 0) & (exit[:, 2] > 0)
    value[above] = brdf(incident[above], exit[above])
    return value.reshape(*SHAPE, 3)


def bin_centres() -> tuple[np.ndarray, np.ndarray]:
    """Incident and exit unit vectors (90*90*180, 3) at the bins' centres, in the file's order."""
    theta_h = np.radians(90.0) * ((np.arange(SHAPE[0]) + 0.5) / SHAPE[0]) ** 2
    theta_d = np.radians(90.0) * (np.arange(SHAPE[1]) + 0.5) / SHAPE[1]
    phi_d = np.pi * (np.arange(SHAPE[2]) + 0.5) / SHAPE[2]
    h, d, p = (grid.ravel() for grid in np.meshgrid(theta_h, theta_d, phi_d, indexing="ij"))
    return from_half_difference(h, d, p)


@lru_cache(maxsize=1)
def _centred_below() -> np.ndarray:
    """(90, 90, 180) bool: bins whose centre has a direction below the horizon."""
    incident, exit = bin_centres()
    return ((incident[:, 2] <= 0.0) | (exit[:, 2] <= 0.0)).reshape(SHAPE)
