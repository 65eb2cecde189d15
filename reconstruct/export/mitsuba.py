"""Mitsuba 3's ``measured`` material: a tensor file on half-vector slices, in RGB or by wavelengths.

The format is that of Dupuy & Jakob, "An Adaptive Parameterization for Efficient Material Acquisition and Rendering"
(SIGGRAPH Asia 2018): slices of f cos(exit) over the half vector for each incident angle, addressed by
u = (sqrt(2 theta_m / pi), (phi_m - phi_i + pi) / (2 pi)). Its warp by visible normals is the identity here.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.mitsuba import Mitsuba, read_tensors
from photogonio.reconstruct.export.rgb import rgb_order
from photogonio.reconstruct.export.table_grid import scale_in_words
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.modes.mirror_quadrature import around

_SLICE, _INCIDENT = 96, 56  # nodes a side of a slice; incident angles
# the same of a peak that stands wherever the light comes from, for a width of it
_RETRO_SLICE, _RETRO_INCIDENT, _RETRO_WIDTH = 128, 80, 0.15
_TURNING_SLICE, _TURNING_INCIDENT, _TURNS = (
    48,
    24,
    43,
)  # the same where the sample's turn counts, and its azimuths
_TYPES = {np.dtype("uint8"): 1, np.dtype("float32"): 10}
_LEAST = 1e-4  # of a slice's mean: keeps every direction within reach of sampling
_LAST = np.radians(89.5)  # incidence
_LOOKS, _QUADRATURE = 12, (24, 64)  # angles of incidence at which light is counted, and nodes of that
_BRIGHT = np.radians(86.0)  # the last of them
_ADDED = 1.002  # light that slices may add
_WAVELENGTH = re.compile(r"([0-9]+(?:\.[0-9]+)?) ?(?:nm)?")


@dataclass(frozen=True, slots=True)
class _Nodes:
    """Where the tensors have their values; radians."""

    theta_i: np.ndarray
    phi_i: np.ndarray
    slice: int

    @classmethod
    def of(cls, brdf: Brdf) -> _Nodes:
        """Incidence is denser toward grazing, where linear interpolation between even nodes would add light.

        Azimuths begin at -pi: the reader clamps those below its first node without a word.
        """
        lobes = getattr(brdf, "lobes", ())  # tables that are handed on have none
        retro = [lobe.finest for lobe in lobes if lobe.model == "retro"]
        count, side = _INCIDENT, _SLICE
        if retro:  # up to a file of 41 MB
            finer = np.clip(_RETRO_WIDTH / min(retro), 1.0, 1.25)
            count, side = int(finer * _RETRO_INCIDENT), int(finer * _RETRO_SLICE)
        if brdf.turning:
            count, side = _TURNING_INCIDENT, _TURNING_SLICE
        theta_i = _LAST * (1 - (1 - np.linspace(0.0, 1.0, count)) ** (1.5 if retro else 2.0))
        phi_i = np.linspace(-np.pi, np.pi, _TURNS) if brdf.turning else np.zeros(1)
        return cls(theta_i, phi_i, side)


def write_mitsuba(brdf: Brdf, path: Path) -> None:
    """R, G and B by name, or any one channel, which is repeated, for RGB variants; channels named by their
    wavelengths ("550" or "550 nm") for spectral ones.

    Raises:
        InputError: the format, as written here, cannot hold this BRDF.
    """
    wavelengths = wavelengths_of(brdf.channels)
    order = rgb_order(brdf.channels) or list(range(len(brdf.channels)))
    if wavelengths is not None:
        order = list(np.argsort(wavelengths))
    elif len(order) not in (1, 3):
        raise InputError(
            "--format mitsuba",
            f"holds R, G and B, or wavelengths; this BRDF has {', '.join(brdf.channels)}",
        )
    nodes = _Nodes.of(brdf)
    slices = [[_slice(brdf, nodes.slice, t, p) for t in nodes.theta_i] for p in nodes.phi_i]
    value = _between(np.stack([[v[order] for v, _ in row] for row in slices]), nodes)
    value *= _held(brdf, value, nodes, order)[:, None, None, None]
    area = np.stack([[a for _, a in row] for row in slices])
    sampled = value.mean(axis=2) * area
    text = f"photogonio, {scale_in_words(brdf)}"
    even = np.ones((*sampled.shape[:2], 2, 2))
    least = _LEAST * np.maximum(sampled.mean(axis=(2, 3), keepdims=True), 1e-6 * max(sampled.mean(), 1e-30))
    write_tensors(
        path,
        {
            "description": np.frombuffer(text.encode(), np.uint8),
            "theta_i": nodes.theta_i.astype(np.float32),
            "phi_i": nodes.phi_i.astype(np.float32),
            "ndf": even[0, 0].astype(np.float32),
            "sigma": (0.25 * even[0, 0]).astype(np.float32),  # so that ndf / (4 sigma) is one
            "vndf": even.astype(np.float32),
            "luminance": np.maximum(sampled, least).astype(np.float32),
            **_colours(value, None if wavelengths is None else np.sort(wavelengths)),
            "jacobian": np.array([1], np.uint8),
        },
    )


def wavelengths_of(channels: tuple[str, ...]) -> np.ndarray | None:
    """(c,) nm where every channel is named by its wavelength; else None."""
    found = [_WAVELENGTH.fullmatch(name.strip()) for name in channels]
    if len(channels) < 2 or not all(found):
        return None
    numbers = np.array([float(match[1]) for match in found if match])
    return numbers if ((numbers >= 200) & (numbers <= 3000)).all() else None


def _between(value: np.ndarray, nodes: _Nodes) -> np.ndarray:
    """Values (phi_i, theta_i, c, s, s) between which lines are nearest to f, in place of values on it.

    Lines between nodes on a bent curve are all on one side of it, by h^2 f'' / 12 on the mean; least squares put the
    nodes lower by that, which leaves 0.4 of the rms error.
    """
    sides = np.linspace(0.0, 1.0, nodes.slice)
    places = ((0, nodes.phi_i), (1, nodes.theta_i), (3, sides), (4, sides))
    less = sum(_bend(value, axis, at, around=axis in (0, 3)) for axis, at in places if len(at) > 2)
    return np.clip(value - less / 12.0, 0.5 * value, 1.5 * value)


def _held(brdf: Brdf, value: np.ndarray, nodes: _Nodes, order: list[int]) -> np.ndarray:
    """(theta_i,) factors that take off what light the slices add, between nodes of incidence too."""
    table = _table(nodes, value)
    every = nodes.theta_i[1 :: max(len(nodes.theta_i) // _LOOKS, 1)]
    looks = np.append(0.5 * (every[1:] + every[:-1]), _BRIGHT)
    more = np.ones(len(looks))
    for k, theta in enumerate(looks):
        exit, weight = around(theta, *_QUADRATURE)
        for phi in nodes.phi_i[:: _TURNS // 4 + 1] if brdf.turning else (0.0,):
            cos, sin = np.cos(phi), np.sin(phi)
            toward = exit @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
            incident = np.broadcast_to(unit_vectors(theta, phi), exit.shape)
            source = weight @ np.maximum(brdf(incident, toward), 0.0)[:, order]
            sent = weight @ table.evaluate(incident, toward)
            more[k] = max(more[k], (sent / np.maximum(source, 1e-300)).max() / _ADDED)
    return 1.0 / np.interp(nodes.theta_i, looks, more)


def _table(nodes: _Nodes, value: np.ndarray) -> Mitsuba:
    """The values (phi_i, theta_i, c, s, s) as the reader has them."""
    sides = np.linspace(0.0, 1.0, nodes.slice)
    isotropic, grid = len(nodes.phi_i) == 1, np.moveaxis(value, 2, -1)
    axes = (nodes.theta_i, sides, sides) if isotropic else (nodes.phi_i, nodes.theta_i, sides, sides)
    table = RegularGridInterpolator(axes, grid[0] if isotropic else grid, bounds_error=False, fill_value=None)
    names = tuple(str(k) for k in range(value.shape[2]))
    return Mitsuba(names, isotropic, table, (float(nodes.theta_i[-1]), float(nodes.phi_i[0])))


def _bend(value: np.ndarray, axis: int, at: np.ndarray, *, around: bool) -> np.ndarray:
    """h^2 times the second derivative along an axis with nodes ``at``; the last is the first if it goes ``around``."""
    moved = np.moveaxis(value, axis, -1)
    rise = np.diff(moved, axis=-1) / np.diff(at)
    step = 0.5 * (np.diff(at)[1:] + np.diff(at)[:-1])
    found = np.zeros_like(moved)
    found[..., 1:-1] = step * np.diff(rise, axis=-1)
    if around:
        found[..., 0] = found[..., -1] = (at[1] - at[0]) * (rise[..., 0] - rise[..., -1])
    return np.moveaxis(found, -1, axis)


def _colours(value: np.ndarray, wavelengths: np.ndarray | None) -> dict[str, np.ndarray]:
    """The values (phi_i, theta_i, c, s, s) as the reader's variants want them."""
    if wavelengths is not None:
        return {"wavelengths": wavelengths.astype(np.float32), "spectra": value.astype(np.float32)}
    shape = (*value.shape[:2], 3, *value.shape[3:])
    return {"rgb": np.broadcast_to(value, shape).astype(np.float32)}


def _slice(brdf: Brdf, side: int, theta_i: float, phi_i: float) -> tuple[np.ndarray, np.ndarray]:
    """f cos(exit) (c, s, s) by azimuth and angle of the half vector, and the exit solid angle a unit of u (s, s)."""
    u = np.linspace(0.0, 1.0, side)
    theta_m, phi_m = (grid.ravel() for grid in np.meshgrid(u**2 * np.pi / 2, (2 * u - 1) * np.pi))
    half = unit_vectors(theta_m, phi_m)
    incident = np.broadcast_to(unit_vectors(theta_i, phi_i), half.shape)
    along = (incident * half).sum(1)
    exit = 2 * along[:, None] * half - incident
    seen = (exit[:, 2] > 0) & (along > 0)
    value = np.zeros((len(half), len(brdf.channels)))
    value[seen] = np.maximum(brdf(incident[seen], exit[seen]), 0.0) * exit[seen, 2:]
    area = 2 * np.pi**2 * np.sqrt(2 * theta_m / np.pi) * np.sin(theta_m) * 4 * np.maximum(along, 0.0)
    return value.T.reshape(-1, side, side), area.reshape(side, side)


def remark_mitsuba(path: Path, text: str) -> None:
    """Add ``text`` to the description of a file that :func:`write_mitsuba` wrote."""
    tensors = read_tensors(path)
    told = tensors["description"].tobytes() + b"; " + text.encode()
    write_tensors(path, tensors | {"description": np.frombuffer(told, np.uint8)})


def write_tensors(path: Path, tensors: Mapping[str, np.ndarray]) -> None:
    """Mitsuba's tensor file: a header with name, type, place and shape of each array, then their bytes."""
    header = b"tensor_file\0" + bytes([1, 0]) + struct.pack("<I", len(tensors))
    place = len(header) + sum(2 + len(name) + 2 + 1 + 8 + 8 * array.ndim for name, array in tensors.items())
    body = b""
    for name, array in tensors.items():
        gap = -(place + len(body)) % 8
        body += b"\0" * gap
        header += struct.pack("<H", len(name)) + name.encode()
        header += struct.pack("<HBQ", array.ndim, _TYPES[array.dtype], place + len(body))
        header += struct.pack(f"<{array.ndim}Q", *array.shape)
        body += np.ascontiguousarray(array).tobytes()
    path.write_bytes(header + body)
