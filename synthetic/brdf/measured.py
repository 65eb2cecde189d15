"""BRDFs that somebody measured: MERL's binary cubes and tables of angles and values, interpolated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator, RegularGridInterpolator
from scipy.ndimage import map_coordinates

from photogonio.synthetic.brdf.reflectance import PairAngles, Reflectance

MERL_SHAPE = (90, 90, 180)  # theta_h, theta_d, phi_d
MERL_SCALE = (1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0)


@dataclass(frozen=True, eq=False)
class Read(Reflectance):
    """A BRDF that another reader has: f (n, c), 1/sr, at unit vectors (n, 3); what it marks as not measured is 0."""

    function: Callable[[np.ndarray, np.ndarray], np.ndarray]
    isotropic: bool = True
    reciprocal: bool = False

    def above(self, pairs: PairAngles) -> np.ndarray:
        return np.maximum(np.nan_to_num(self.function(pairs.incident, pairs.exit)), 0.0)


@dataclass(frozen=True, eq=False)
class MerlCube(Reflectance):
    """A MERL cube, trilinear in Rusinkiewicz's angles (Matusik et al. 2003; Rusinkiewicz 1998).

    ``cube`` (3, 90, 90, 180) in 1/sr, negative where not measured; theta_h in steps of its root. MERL's own
    reader truncates to a cell, so that a cell's value stands for its middle.
    """

    cube: np.ndarray

    def above(self, pairs: PairAngles) -> np.ndarray:
        theta_h = np.sqrt(np.arccos(pairs.cos_h) / (0.5 * np.pi)) * MERL_SHAPE[0]
        theta_d = np.arccos(pairs.cos_d) / (0.5 * np.pi) * MERL_SHAPE[1]
        phi_d = np.mod(difference_azimuth(pairs), np.pi) / np.pi * MERL_SHAPE[2]
        padded = np.concatenate(
            [self.cube[..., -1:], self.cube, self.cube[..., :1]], axis=-1
        )  # cyclic over pi
        place = np.stack([theta_h - 0.5, theta_d - 0.5, phi_d + 0.5])
        channels = [map_coordinates(c, place, order=1, mode="nearest") for c in padded]
        return np.maximum(np.stack(channels, axis=-1), 0.0)


def difference_azimuth(pairs: PairAngles) -> np.ndarray:
    """phi_d (n,): azimuth of the incident direction in the frame that has the half vector for its pole."""
    phi = np.arctan2(pairs.half[:, 1], pairs.half[:, 0])
    cos, sin = np.cos(phi), np.sin(phi)
    x = cos * pairs.incident[:, 0] + sin * pairs.incident[:, 1]
    y = -sin * pairs.incident[:, 0] + cos * pairs.incident[:, 1]
    sin_h = np.sqrt(np.maximum(1.0 - pairs.cos_h**2, 0.0))
    return np.arctan2(y, pairs.cos_h * x - sin_h * pairs.incident[:, 2])


@dataclass(frozen=True, eq=False)
class Tabulated(Reflectance):
    """An isotropic table of theta_i, theta_r, |dphi| (radians) and values in 1/sr, interpolated linearly.

    A full grid is interpolated on the grid, with its end values beyond it. Scattered rows are taken both ways
    (Helmholtz) and interpolated on the equal-area discs, with the nearest row's value outside.
    """

    angles: np.ndarray  # (n, 3)
    values: np.ndarray  # (n, c)
    lookup: Callable[[np.ndarray], np.ndarray] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        axes = [np.unique(np.round(self.angles[:, k], 9)) for k in range(3)]
        full = np.prod([len(a) for a in axes]) == len(self.angles)
        object.__setattr__(self, "lookup", self.on_grid(axes) if full else self.scattered())

    def on_grid(self, axes: list[np.ndarray]):
        order = np.lexsort(np.round(self.angles, 9).T[::-1])
        cube = self.values[order].reshape([len(a) for a in axes] + [-1])
        inner = RegularGridInterpolator(axes, cube)

        lowest, highest = [a[0] for a in axes], [a[-1] for a in axes]

        def lookup(angles: np.ndarray) -> np.ndarray:
            return inner(np.clip(angles, lowest, highest))

        return lookup

    def scattered(self):
        angles = np.concatenate([self.angles, self.angles[:, [1, 0, 2]]])
        values = np.concatenate([self.values, self.values])
        place, first = np.unique(np.round(on_discs(angles), 9), axis=0, return_index=True)
        inner, outer = LinearNDInterpolator(place, values[first]), NearestNDInterpolator(place, values[first])

        def lookup(wanted: np.ndarray) -> np.ndarray:
            where = on_discs(wanted)
            found = inner(where)
            return np.where(np.isfinite(found), found, outer(where))

        return lookup

    def above(self, pairs: PairAngles) -> np.ndarray:
        cos = np.minimum(np.stack([pairs.cos_i, pairs.cos_r]), 1.0)
        return self.lookup(np.stack([*np.arccos(cos), np.arccos(pairs.cos_dphi)], axis=-1))


def on_discs(angles: np.ndarray) -> np.ndarray:
    """(rho_i, rho_r cos dphi, rho_r |sin dphi|), (n, 3), of theta_i, theta_r, dphi (n, 3)."""
    rho = np.sqrt(2.0) * np.sin(0.5 * angles[:, :2])
    return np.stack(
        [rho[:, 0], rho[:, 1] * np.cos(angles[:, 2]), rho[:, 1] * np.abs(np.sin(angles[:, 2]))], axis=-1
    )
