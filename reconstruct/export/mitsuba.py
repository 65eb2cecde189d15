"""Mitsuba 3's ``measured`` material: a tensor file on half-vector slices, in RGB.

The format is that of Dupuy & Jakob, "An Adaptive Parameterization for Efficient Material Acquisition and Rendering"
(SIGGRAPH Asia 2018): slices of f cos(exit) over the half vector for each incident angle, addressed by
u = (sqrt(2 theta_m / pi), (phi_m - phi_i + pi) / (2 pi)). Its warp by visible normals is the identity here.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.merl import CHANNELS
from photogonio.reconstruct.modes.angles import unit_vectors

_SLICE, _INCIDENT = 96, 32  # nodes a side of a slice; incident angles
_TYPES = {np.dtype("uint8"): 1, np.dtype("float32"): 10}
_LEAST = 1e-4  # of a slice's mean: keeps every direction within reach of sampling


def write_mitsuba(brdf: Brdf, path: Path) -> None:
    """Isotropic BRDFs of three channels (R, G, B by name, else in order) or of one, which is repeated.

    Raises:
        InputError: the format, as written here, cannot hold this BRDF.
    """
    if brdf.turning:
        raise InputError(
            "--format mitsuba", "holds isotropic BRDFs only; this one changes as the sample turns"
        )
    if len(brdf.channels) not in (1, 3):
        raise InputError("--format mitsuba", f"holds R, G and B; this BRDF has {', '.join(brdf.channels)}")
    named = set(brdf.channels) == set(CHANNELS)
    order = [brdf.channels.index(name) for name in CHANNELS] if named else list(range(len(brdf.channels)))
    theta_i = np.linspace(0.0, 0.99 * np.pi / 2, _INCIDENT)
    slices = [_slice(brdf, angle) for angle in theta_i]
    rgb = np.stack([np.broadcast_to(value[order], (3, _SLICE, _SLICE)) for value, _ in slices])[None]
    sampled = np.stack([value.mean(0) * area for value, area in slices])[None]
    even = np.ones((1, _INCIDENT, _SLICE, _SLICE))
    text = f"photogonio, {'absolute' if brdf.scale == 'absolute' else 'relative'} scale"
    write_tensors(
        path,
        {
            "description": np.frombuffer(text.encode(), np.uint8),
            "theta_i": theta_i.astype(np.float32),
            "phi_i": np.zeros(1, np.float32),
            "ndf": even[0, 0].astype(np.float32),
            "sigma": (0.25 * even[0, 0]).astype(np.float32),  # so that ndf / (4 sigma) is one
            "vndf": even.astype(np.float32),
            "luminance": np.maximum(sampled, _LEAST * sampled.mean()).astype(np.float32),
            "rgb": rgb.astype(np.float32),
            "jacobian": np.array([1], np.uint8),
        },
    )


def _slice(brdf: Brdf, theta_i: float) -> tuple[np.ndarray, np.ndarray]:
    """f cos(exit) (c, s, s) by azimuth and angle of the half vector, and the exit solid angle a unit of u (s, s)."""
    u = np.linspace(0.0, 1.0, _SLICE)
    theta_m, phi_m = (grid.ravel() for grid in np.meshgrid(u**2 * np.pi / 2, (2 * u - 1) * np.pi))
    half = unit_vectors(theta_m, phi_m)
    incident = np.broadcast_to(unit_vectors(theta_i, 0.0), half.shape)
    along = (incident * half).sum(1)
    exit = 2 * along[:, None] * half - incident
    seen = (exit[:, 2] > 0) & (along > 0)
    value = np.zeros((len(half), len(brdf.channels)))
    value[seen] = np.maximum(brdf(incident[seen], exit[seen]), 0.0) * exit[seen, 2:]
    area = 2 * np.pi**2 * np.sqrt(2 * theta_m / np.pi) * np.sin(theta_m) * 4 * np.maximum(along, 0.0)
    return value.T.reshape(-1, _SLICE, _SLICE), area.reshape(_SLICE, _SLICE)


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
