"""How sure a BRDF is, as the coefficient file says it: its parameters' covariance, and what no parameter says.

The variance of f at a pair of directions is J C J^T + f^2 (scale^2 + misfit^2 + unseen^2), J being the derivatives of f
by the parameters (docs/modes.md).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import RegularGridInterpolator


@dataclass(frozen=True, slots=True)
class RelativeTable:
    """A standard error relative to f over angles: bilinear between the nodes, constant outside."""

    theta_i: np.ndarray  # (i,) degrees, ascending
    theta_r: np.ndarray  # (r,)
    dphi: np.ndarray  # (d,) from 0 to 180
    relative: np.ndarray  # (i, r, d)
    extra: dict[str, object] = field(default_factory=dict)  # unknown keys of the file, kept on a round trip

    def at(self, theta_i: np.ndarray, theta_r: np.ndarray, dphi: np.ndarray) -> np.ndarray:
        """(n,) at angles (n,) in radians."""
        axes, places = [], []
        values = self.relative
        turn = np.arccos(np.clip(np.cos(dphi), -1.0, 1.0))
        for axis, (nodes, angle) in enumerate(
            zip((self.theta_i, self.theta_r, self.dphi), (theta_i, theta_r, turn), strict=True)
        ):
            if len(nodes) == 1:  # the same everywhere along it
                nodes, values = np.array([nodes[0], nodes[0] + 1.0]), np.repeat(values, 2, axis)
            axes.append(nodes)
            places.append(np.clip(np.degrees(np.abs(angle)), nodes[0], nodes[-1]))
        return RegularGridInterpolator(axes, values)(np.column_stack(places))


@dataclass(frozen=True, slots=True)
class Uncertain:
    """One standard error of everything; absolute, but for what is beyond the parameters."""

    parameters: tuple[str, ...]  # the modes, then each lobe's free numbers
    standard_errors: np.ndarray  # (p, c); NaN: not known
    covariance: np.ndarray | None = None  # (c, p, p)
    scale: float = 0.0  # relative, common to all channels
    misfit: RelativeTable | None = None  # what all photos miss alike
    unseen: RelativeTable | None = None  # what other models that predict as well say
    extra: dict[str, object] = field(default_factory=dict)  # unknown keys of "beyond", kept on a round trip
    beside: dict[str, object] = field(default_factory=dict)  # those of "covariance"
    missing: dict[str, object] | None = (
        None  # what the file names as its covariance, where that is not beside it
    )

    def spread(self) -> np.ndarray:
        """(c, p, p) the covariance; without one, of errors that know nothing of one another; NaN if it is missing."""
        if self.covariance is not None:
            return self.covariance
        if self.missing is not None:
            count, channels = self.standard_errors.shape
            return np.broadcast_to(np.nan, (channels, count, count))
        return np.stack([np.diag(np.square(one)) for one in self.standard_errors.T])

    def only(self, channels: list[int]) -> Uncertain:
        """Of some channels alone, by their places."""
        covariance = None if self.covariance is None else self.covariance[channels]
        errors = self.standard_errors[:, channels]
        missing = None if self.missing is None else {k: v for k, v in self.missing.items() if k == "file"}
        return replace(self, standard_errors=errors, covariance=covariance, missing=missing)

    def relative(self, theta_i: np.ndarray, theta_r: np.ndarray, dphi: np.ndarray) -> np.ndarray:
        """(n,) what is beyond the parameters, relative to f; angles (n,) in radians."""
        total = np.full(len(theta_i), self.scale**2)
        for table in (self.misfit, self.unseen):
            if table is not None:
                total += table.at(theta_i, theta_r, dphi) ** 2
        return np.sqrt(total)
