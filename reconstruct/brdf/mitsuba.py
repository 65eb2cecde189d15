"""Mitsuba 3's ``measured`` tensor files, read and looked up as Mitsuba does, for files without a warp of their own.

Dupuy & Jakob, "An Adaptive Parameterization for Efficient Material Acquisition and Rendering" (SIGGRAPH Asia 2018).
Values lie between nodes linearly: of incidence, of azimuth where the file has several, and over a slice of half
vectors.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.merl import CHANNELS
from photogonio.reconstruct.modes.angles import spherical_angles

_TYPES: dict[int, np.dtype] = {1: np.dtype("u1"), 10: np.dtype("<f4"), 11: np.dtype("<f8")}
_MAGIC = b"tensor_file\0"


@dataclass(frozen=True, slots=True)
class Mitsuba:
    """A table of f cos(exit)."""

    channels: tuple[str, ...]
    isotropic: bool
    table: RegularGridInterpolator  # over phi_i, theta_i (radians) and the slice's two coordinates
    last: tuple[float, float]  # greatest theta_i, and least phi_i that the nodes have

    def evaluate(self, incident: np.ndarray, exit: np.ndarray) -> np.ndarray:
        """f (n, c), 1/sr, of unit vectors (n, 3)."""
        half = incident + exit
        half = half / np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-12)
        (theta_i, phi_i), (theta_m, phi_m) = spherical_angles(incident), spherical_angles(half)
        turn = phi_m - phi_i if self.isotropic else phi_m
        across = np.mod(turn + np.pi, 2 * np.pi) / (2 * np.pi)
        along = np.sqrt(np.clip(2 * theta_m / np.pi, 0.0, 1.0))
        phi = np.mod(phi_i + np.pi, 2 * np.pi) - np.pi
        place = np.column_stack([phi, np.minimum(theta_i, self.last[0]), across, along])
        value = self.table(place if not self.isotropic else place[:, 1:])
        seen = (incident[:, 2] > 0) & (exit[:, 2] > 0)
        return np.where(seen[:, None], value / np.maximum(exit[:, 2:], 1e-9), 0.0)


def read_mitsuba(path: Path) -> Mitsuba:
    """A tensor file whose warp is the identity, as ``export`` writes it.

    Raises:
        InputError: no such file, no tensor file, or one of a measuring bench, whose slices are warped.
    """
    tensors = read_tensors(path)
    values = next((tensors[name] for name in ("rgb", "spectra") if name in tensors), None)
    missing = {"theta_i", "phi_i", "vndf"} - set(tensors)
    if values is None or missing:
        raise InputError(path, f"has no {', '.join(sorted(missing)) or 'rgb or spectra'}")
    if not np.allclose(tensors["vndf"], 1.0):
        raise InputError(path, "has slices warped by a measuring bench; only files without a warp are read")
    phi_i, theta_i = (np.asarray(tensors[name], float) for name in ("phi_i", "theta_i"))
    if values.ndim != 5 or values.shape[:2] != (len(phi_i), len(theta_i)) or not np.isfinite(values).all():
        raise InputError(path, f"has values of shape {values.shape}, which are not those of its angles")
    waves = tensors.get("wavelengths")
    channels = CHANNELS if waves is None else tuple(f"{w:g}" for w in waves)
    isotropic = len(phi_i) == 1
    nodes = [np.linspace(0.0, 1.0, n) for n in values.shape[3:]]
    grid = np.moveaxis(values, 2, -1).astype(float)
    if isotropic:
        table = RegularGridInterpolator((theta_i, *nodes), grid[0])
    else:
        table = RegularGridInterpolator((phi_i, theta_i, *nodes), grid, bounds_error=False, fill_value=None)
    return Mitsuba(channels, isotropic, table, (float(theta_i[-1]), float(phi_i[0])))


def read_tensors(path: Path) -> dict[str, np.ndarray]:
    """The arrays of a tensor file by name. Inverse of :func:`.export.mitsuba.write_tensors`.

    Raises:
        InputError: no such file, or none whose header fits its length.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}") from None
    if not data.startswith(_MAGIC):
        raise InputError(path, "is no tensor file of Mitsuba")
    tensors: dict[str, np.ndarray] = {}
    try:
        place = len(_MAGIC) + 2
        (count,) = struct.unpack_from("<I", data, place)
        place += 4
        for _ in range(min(count, 64)):
            (length,) = struct.unpack_from("<H", data, place)
            name = data[place + 2 : place + 2 + length].decode()
            place += 2 + length
            axes, kind, start = struct.unpack_from("<HBQ", data, place)
            shape = struct.unpack_from(f"<{axes}Q", data, place + 11)
            place += 11 + 8 * axes
            size = int(np.prod([int(n) for n in shape], dtype=object))
            tensors[name] = np.frombuffer(data, _TYPES[kind], size, start).reshape(shape)
    except (struct.error, ValueError, KeyError, UnicodeDecodeError, OverflowError):
        raise InputError(path, "is cut short, or no tensor file that is known here") from None
    return tensors
