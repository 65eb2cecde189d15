"""From a photo's codes to linear signal, and back: sRGB, a power law, a curve that the file
names, or a recovered one.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from photogonio.capture.containers import tone
from photogonio.capture.containers.tone import Curve, Tone

SRGB_KNEE = 0.04045  # IEC 61966-2-1
SRGB_KNEE_LINEAR = SRGB_KNEE / 12.92


def srgb_to_linear(code: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1, codes as fractions of full scale. Inverse of :func:`linear_to_srgb`."""
    return tone.srgb(np.asarray(code))


def linear_to_srgb(linear: np.ndarray) -> np.ndarray:
    """Inverse of :func:`srgb_to_linear`."""
    linear = np.asarray(linear)
    curve = 1.055 * np.maximum(linear, 0.0) ** (1 / 2.4) - 0.055
    return np.where(linear <= SRGB_KNEE_LINEAR, linear * 12.92, curve)


def gamma_to_linear(code: np.ndarray, gamma: float) -> np.ndarray:
    """``code ** gamma``, odd below 0. Inverse of :func:`linear_to_gamma`."""
    return np.sign(code) * np.abs(code) ** gamma


def linear_to_gamma(linear: np.ndarray, gamma: float) -> np.ndarray:
    """Inverse of :func:`gamma_to_linear`."""
    return np.sign(linear) * np.abs(linear) ** (1 / gamma)


@dataclass(frozen=True, slots=True)
class Encoding:
    """How a file's codes stand for light: curve, then black and white level.

    ``black`` and ``white`` are codes as fractions of full scale; :meth:`linear` is 0 at the one and 1 at
    the other.
    """

    kind: str = (
        "linear"  # "linear" | "srgb" | "gamma" | "table" | "curves" | "file" (each photo's own: see own_of)
    )
    gamma: float = 1.0
    black: float = 0.0
    white: float = 1.0
    table: np.ndarray = field(
        default_factory=lambda: np.empty((0, 0))
    )  # (256, c) linear at equally spaced codes
    curves: tuple[Curve, ...] = ()  # "curves": one for all channels, or one a channel

    def own_of(self, told: Tone) -> Encoding:
        """Of a photo whose file says ``told``: its own where that is to be taken, with the same levels; else this."""
        return replace(self, kind="curves", curves=told.curves) if self.kind == "file" else self

    @property
    def straight(self) -> bool:
        return self.kind == "linear" or (self.kind == "curves" and set(self.curves) == {tone.LINEAR})

    def curve(self, code: np.ndarray) -> np.ndarray:
        """Linear signal (..., c) of codes (..., c), both as fractions of full scale, levels not yet
        applied.
        """
        if self.kind == "srgb":
            return srgb_to_linear(code)
        if self.kind == "gamma":
            return gamma_to_linear(code, self.gamma)
        if self.kind == "table":
            grid = np.linspace(0.0, 1.0, len(self.table))
            columns = [np.interp(code[..., c], grid, self.table[:, c]) for c in range(self.table.shape[1])]
            return np.stack(columns, axis=-1)
        if self.kind == "curves":
            if len(self.curves) == 1:
                return self.curves[0].light(code)
            return np.stack([curve.light(code[..., c]) for c, curve in enumerate(self.curves)], axis=-1)
        if self.kind == "file":
            raise ValueError("each photo has its own curve: ask own_of")
        return code

    def linear(self, code: np.ndarray, channels: int) -> np.ndarray:
        """Linear signal (..., c) of codes (..., c): 0 at black, 1 at white."""
        ends = np.repeat([[self.black], [self.white]], channels, axis=1)
        black, white = self.curve(ends)
        return (self.curve(code) - black) / (white - black)

    def lookup(self, full_scale: int, channels: int) -> tuple[np.ndarray, np.ndarray]:
        """Linear signal and quantisation variance, (full_scale + 1, c) float32 each, of every integer code.

        A code stands for all signals within half a step of it: variance step^2 / 12.
        """
        codes = np.arange(-0.5, full_scale + 1) / full_scale
        edges = self.linear(np.repeat(codes[:, None], channels, axis=1), channels)
        middle = np.arange(full_scale + 1) / full_scale
        value = self.linear(np.repeat(middle[:, None], channels, axis=1), channels)
        return value.astype(np.float32), (np.diff(edges, axis=0) ** 2 / 12).astype(np.float32)


@dataclass(frozen=True, slots=True)
class Coded:
    """How a photo's codes became radiance."""

    exposure: float  # signal over radiance
    encoding: Encoding
    steps: float  # codes of full scale
