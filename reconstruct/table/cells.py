"""The cells of a table as a fit sees them: mean value, noise, mean directions and place of each."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from photogonio.reconstruct.modes.angles import pair_angles, spherical_angles
from photogonio.reconstruct.table.facet_table import FacetTable
from photogonio.reconstruct.table.refinement import near_mirror

LEAST_SAMPLES = 3  # a cell of fewer pixels is mostly edge
LEAST_ANGLE = 1e-3  # radians: nearer to the normal an azimuth means nothing


@dataclass(frozen=True, slots=True)
class Cells:
    """Observations of a BRDF at mean directions; n cells, c channels."""

    theta_i: np.ndarray  # (n,) radians
    phi_i: np.ndarray  # (n,) radians
    theta_r: np.ndarray  # (n,) radians
    phi_r: np.ndarray  # (n,) radians
    dphi: np.ndarray  # (n,) radians, phi_r - phi_i folded to [0, pi]
    value: np.ndarray  # (n, c) 1/sr
    variance: np.ndarray  # (n, c) of the mean, from noise alone
    count: np.ndarray  # (n,) samples
    group: np.ndarray  # (n,) index of the view
    place: np.ndarray  # (n, 3) world point, length units
    groups: tuple[str, ...]
    channels: tuple[str, ...]
    binned: bool  # False: every cell is one measurement of its own
    turn: np.ndarray | None = (
        None  # (n, 2) variance, radians^2, of the turns that lead from a cell's middle to its
    )
    # samples, about the tangent axes along and across the plane of incidence
    lamp: np.ndarray | None = None  # (n,) variance, radians^2, of a lamp's directions about each tangent axis
    doubt: np.ndarray | None = (
        None  # (n, c) standard error, 1/sr, of the value by stray light that is not known
    )
    peaked: bool = False  # a narrow gloss is seen: cells near the mirror direction are kept first
    robust: bool = True  # single cells that contradict the others lose their say
    canonical: bool = (
        False  # directions were turned to one incident azimuth, and folded, before they were averaged
    )
    rigid: bool = False  # dphi is that of pairs whose angle is known, and no mean over the cell

    def __len__(self) -> int:
        return len(self.theta_i)

    def take(self, keep: np.ndarray) -> Cells:
        """The cells that a mask or an index array (any, of n) names."""
        given = {name: row[keep] for name in _ROWS if (row := getattr(self, name)) is not None}
        return replace(self, **given)

    def of_channels(self, keep: np.ndarray) -> Cells:
        """With the channels alone that an index array names."""
        doubt = None if self.doubt is None else self.doubt[:, keep]
        names = tuple(self.channels[k] for k in keep)
        return replace(
            self, value=self.value[:, keep], variance=self.variance[:, keep], doubt=doubt, channels=names
        )

    def with_value(self, value: np.ndarray) -> Cells:
        """The same directions with other values (n, c)."""
        return replace(self, value=value)

    def under(self, lamps: np.ndarray | None) -> Cells:
        """The same under lamps of such variances (g,), radians^2, as ``lamp`` has them; None: small ones."""
        return self if lamps is None else replace(self, lamp=lamps[self.group])

    def with_phase(self, cos_phase: np.ndarray) -> Cells:
        """Pairs whose directions stand apart by the angles whose cosines (n,) are given, at the same polar angles.

        The normal of a ball turns from sample to sample, and the angle between lamp and camera hardly changes; that
        between means of directions that were turned to one incident azimuth does, by a degree in wide cells.
        """
        sines = np.sin(self.theta_i) * np.sin(self.theta_r)
        cosine = (cos_phase - np.cos(self.theta_i) * np.cos(self.theta_r)) / np.maximum(sines, LEAST_ANGLE)
        dphi = np.where(sines > LEAST_ANGLE, np.arccos(np.clip(cosine, -1.0, 1.0)), self.dphi)
        signed = (self.phi_r - self.phi_i + np.pi) % (2.0 * np.pi) - np.pi
        phi_r = self.phi_i + np.where(signed < 0, -dphi, dphi)
        return replace(self, dphi=dphi, phi_r=phi_r, rigid=True)

    @classmethod
    def of_angles(cls, theta_i: np.ndarray, theta_r: np.ndarray, dphi: np.ndarray) -> Cells:
        """Directions without observations, (n,) each, radians: where a model is to be evaluated."""
        return cls._bare(theta_i, np.zeros(len(theta_i)), theta_r, dphi, dphi)

    @classmethod
    def of_directions(
        cls, theta_i: np.ndarray, phi_i: np.ndarray, theta_r: np.ndarray, phi_r: np.ndarray
    ) -> Cells:
        """The same of a surface that need not be isotropic."""
        folded = np.abs((phi_r - phi_i + np.pi) % (2.0 * np.pi) - np.pi)
        return cls._bare(theta_i, phi_i, theta_r, phi_r, folded)

    @classmethod
    def _bare(cls, theta_i, phi_i, theta_r, phi_r, dphi) -> Cells:
        n = len(theta_i)
        return cls(
            theta_i=theta_i,
            phi_i=phi_i,
            theta_r=theta_r,
            phi_r=phi_r,
            dphi=dphi,
            value=np.empty((n, 0)),
            variance=np.empty((n, 0)),
            count=np.ones(n),
            group=np.zeros(n, int),
            place=np.zeros((n, 3)),
            groups=("",),
            channels=(),
            binned=False,
        )


def few_of(channels: int, most: int) -> np.ndarray:
    """Indices of at most ``most`` of so many channels: evenly taken, the first and the last among them."""
    return np.unique(np.linspace(0, channels - 1, min(channels, most)).round().astype(int))


_ROWS = (
    *("theta_i", "phi_i", "theta_r", "phi_r", "dphi", "value", "variance", "count", "group", "place"),
    *("turn", "lamp", "doubt"),
)


def tells(table: FacetTable) -> np.ndarray:
    """Which rows (n,) of a table become cells: of a binned one those of at least :data:`LEAST_SAMPLES` samples, and all
    toward the mirror direction, where facets are as fine as pixels."""
    keep = (table.weight > 0) & ((table.count >= LEAST_SAMPLES) | (table.level < 0))
    if table.finer:
        keep |= (table.weight > 0) & near_mirror(table.incident, table.exit)
    return keep


def cells_of(table: FacetTable) -> Cells:
    """Means of a table's cells, of those that :func:`tells` names."""
    keep = tells(table)
    weight = table.weight[keep, None]
    incident, exit = table.incident[keep], table.exit[keep]
    theta_i, phi_i = spherical_angles(incident)
    theta_r, phi_r = spherical_angles(exit)
    return Cells(
        theta_i=theta_i,
        phi_i=phi_i,
        theta_r=theta_r,
        phi_r=phi_r,
        dphi=np.abs(pair_angles(incident, exit)[2]),
        value=table.value[keep] / weight,
        variance=table.variance[keep] / weight**2,
        count=table.count[keep],
        group=table.group[keep],
        place=table.place[keep] / weight,
        groups=table.groups,
        channels=table.channels,
        binned=table.level >= 0,
        turn=_turn(incident / weight, exit / weight, table.isotropic) if table.level >= 0 else None,
        canonical=table.isotropic,
    )


def _turn(incident: np.ndarray, exit: np.ndarray, canonical: bool) -> np.ndarray:
    """Variances (n, 2) of the small turns, the same for both directions, that lead from a cell's middle to its samples.

    On a ball the normal turns from sample to sample, and both directions with it; on a plane they turn together too,
    if not quite alike. A mean of unit vectors falls short of 1 by half the variance of the angles between them. A turn
    about the tangent axis a moves direction d by a x d; where the incident azimuth has been taken out, a turn about
    the axis x along the plane of incidence moves the exit by x x d + cot(theta_i) z x d.
    """
    short = 2.0 * (1.0 - np.minimum(np.linalg.norm([incident, exit], axis=-1), 1.0))
    theta_i, theta_r, dphi = pair_angles(incident, exit)
    if not canonical:
        alike = (short / (1.0 + np.cos([theta_i, theta_r]) ** 2)).mean(0)
        return np.column_stack([alike, alike])
    x, y, z = np.sin(theta_r) * np.cos(dphi), np.sin(theta_r) * np.sin(dphi), np.cos(theta_r)
    cot = 1.0 / np.tan(np.maximum(theta_i, LEAST_ANGLE))
    moved = (1.0 + cot**2) * y**2 + (cot * x - z) ** 2
    rest = np.maximum(short[1] - short[0] * (1.0 - y**2), 0.0)
    along = np.minimum(rest / np.maximum(moved, LEAST_ANGLE**2), short.max(0))
    return np.column_stack([along, short[0]])
