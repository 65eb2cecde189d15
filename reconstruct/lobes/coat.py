"""What a coat sends back of the light from each direction, and so what enters it: E(w) of docs/modes.md.

E is an integral over the exit hemisphere, taken once for each coat, and looked up as a smooth function of the square
root of the cosine: near grazing it changes within angles of the roughness.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.interpolate import CubicSpline, PPoly

from photogonio.reconstruct.lobes.interface import FINE, coat_albedo
from photogonio.reconstruct.lobes.lobe_sums import mirror_values
from photogonio.reconstruct.modes.integrals import albedo_by_quadrature

HARMONICS, MOST_HARMONICS = 6.0, 40  # even waves of a coat of two roughnesses, times the root of their ratio
TURNING_PIECES = 32
TURNS = 256  # azimuths of a mean over all
LEAST_FINE = 0.02  # roughness that the rule resolves
STEPS = 4096  # of straight lines in cos, which compiled code reads fastest


@dataclass(frozen=True, slots=True)
class Interface:
    """A rough dielectric surface."""

    along: float  # roughness along the azimuth
    across: float
    azimuth: float  # radians
    beckmann: bool
    separable: bool
    f0: float


@dataclass(frozen=True, slots=True)
class CoatAlbedo:
    """E of one coat."""

    spline: PPoly  # of sqrt(cos): (m,) even waves in azimuth stretched, the first alone if isotropic
    azimuth: float
    stretch: float
    table: np.ndarray  # (k,) 1 - E as compiled code takes it; (0,) where it turns
    mean: float  # 2 times the integral of E cos dcos, over all azimuths: under even light

    def at(self, cos: np.ndarray, phi: np.ndarray | float = 0.0) -> np.ndarray:
        """E (...) of directions."""
        waves = self.spline(np.sqrt(np.maximum(cos, 0.0)))
        if waves.shape[-1] == 1:
            return waves[..., 0]
        turn = 2.0 * _stretched(np.asarray(phi, float) - self.azimuth, self.stretch)
        return np.sum(waves * np.cos(turn[..., None] * np.arange(waves.shape[-1])), axis=-1)

    @property
    def turning(self) -> bool:
        return self.spline.c.shape[-1] > 1

    def entered(self, theta_i, phi_i, theta_r, phi_r) -> np.ndarray:
        """(n,) (1 - E(i)) (1 - E(r))."""
        return (1.0 - self.at(np.cos(theta_i), phi_i)) * (1.0 - self.at(np.cos(theta_r), phi_r))


@lru_cache(maxsize=64)
def coat_albedo_of(interface: Interface) -> CoatAlbedo:
    """E of a coat, with weight 1."""
    if interface.along == interface.across:
        pieces = coat_albedo(interface.separable, interface.beckmann, interface.along, interface.f0, FINE)
        spline = PPoly(np.ascontiguousarray(pieces.T)[:, :, None], np.linspace(0.0, 1.0, len(pieces) + 1))
        table = 1.0 - spline(np.sqrt(np.linspace(0.0, 1.0, STEPS + 1)))[:, 0]
    else:
        table, spline = np.empty(0), _waves(replace(interface, azimuth=0.0))
    stretch = _stretch(interface)
    nodes, weights = np.polynomial.legendre.leggauss(64)
    nodes = 0.5 * (nodes + 1.0)
    turns = _stretched(np.pi * (np.arange(TURNS) + 0.5) / TURNS, stretch)
    waves = np.cos(2.0 * np.outer(turns, np.arange(spline.c.shape[-1]))).mean(0)
    # cos dcos = 2 root^3 droot
    mean = float(np.sum(0.5 * weights * 4.0 * nodes**3 * (spline(nodes) @ waves)))
    return CoatAlbedo(spline, interface.azimuth, stretch, table, mean)


def _stretch(interface: Interface) -> float:
    return float(np.sqrt(interface.across / interface.along))


def _stretched(turn: np.ndarray, by: float) -> np.ndarray:
    """Azimuths from that of the first roughness, their tangents times ``by``; of ``1 / by`` the inverse.

    E changes where the roughness of a direction does, (along cos)^2 + (across sin)^2, whose zeros lie at tangents of
    i along / across: at i sqrt(along / across) when stretched, so that waves are needed by the root of the ratio.
    """
    return np.arctan2(by * np.sin(turn), np.cos(turn))


@lru_cache(maxsize=64)
def _waves(interface: Interface) -> CubicSpline:
    """Even waves of E in stretched azimuth from that of the first roughness, of sqrt(cos)."""
    root, stretch = np.linspace(0.0, 1.0, TURNING_PIECES + 1), _stretch(interface)
    count = min(int(np.ceil(HARMONICS * max(stretch, 1.0 / stretch))), MOST_HARMONICS)
    turns = 0.5 * np.pi * (np.arange(count) + 0.5) / count
    sent = [_albedo(interface, np.arccos(root**2), turn) for turn in _stretched(turns, 1.0 / stretch)]
    cosines = np.cos(2.0 * np.outer(turns, np.arange(count)))
    share = np.where(np.arange(count) == 0, 1.0, 2.0) / count
    return CubicSpline(root, np.stack(sent, axis=1) @ cosines * share)


def _albedo(interface: Interface, theta: np.ndarray, turn: float) -> np.ndarray:
    """(n,) E at angles ``theta``, ``turn`` radians from the azimuth of the first roughness."""
    own = (interface.along, interface.across, 0.0, interface.beckmann, interface.separable, interface.f0)

    def value(incident, exit, dphi) -> np.ndarray:
        total: np.ndarray | float = 0.0
        for side in (1.0, -1.0):
            angles = np.broadcast_arrays(incident, turn, exit, turn + side * dphi)
            flat = [np.asarray(a, float).reshape(-1) for a in angles]
            total = total + 0.5 * mirror_values(own, flat).reshape(angles[0].shape)
        return np.asarray(total)[..., None]

    return albedo_by_quadrature(value, theta, max(min(interface.along, interface.across), LEAST_FINE))[:, 0]
