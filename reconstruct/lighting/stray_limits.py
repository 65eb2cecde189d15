"""Stray light that nothing tells of: how much it may be in each pixel of a ball, and which pixels it may spoil.

To first order what shines on the ball besides the lamp is diffuse surroundings. A ground without end fills the share
(1 - n_z) / 2 of what a point with normal n faces, weighted by the cosine (form factor of a wedge); half, the mean over
all directions, where nobody knows on which side the ground lies. Over the lamp's light at the point that is

    share = brightness (1 - n_z) / 2 / cos_i,    brightness = pi radiance of the surroundings / irradiance by the lamp

for a diffuse sample of any reflectance. What is the same share of all pixels is an error of scale, which leaving some
out would not mend; what stands out from it, toward the terminator and the foot, bends the shape: there the pixels are
left out. The others are believed less the more of them it may be.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.setup import Light, Setup
from photogonio.capture.photoset import Sphere
from photogonio.reconstruct.estimate.weights import level
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.table.facet_table import LEFT_OUT, SUMS, FacetTable

TOLERANCE = 0.1  # of the value, beyond the middle pixel's
MOST = 0.25  # of the pixels: leaving out more costs more than it saves
PAPER = 0.8  # brightness of surroundings that no photo shows: of paper that faces the lamp
EVEN = 12.0**-0.5  # standard deviation of what may be anything from nothing to a bound, over the bound
LEAST_COSINE = 1e-3


@dataclass(frozen=True, slots=True)
class UnknownStray:
    """How bright the surroundings of a ball are at most in each view; call it with cells."""

    sample: Sphere
    lights: Mapping[str, Light]  # by view
    brightness: Mapping[str, float]  # by view
    grounded: bool  # the ball stands on the frame's z = 0

    def __call__(self, cells: Cells) -> np.ndarray:
        """Standard error (n, c), 1/sr, of the cells' values."""
        return EVEN * self.shares(cells.place, cells.group, cells.groups)[:, None] * level(cells)

    def shares(self, place: np.ndarray, group: np.ndarray, groups: Sequence[str]) -> np.ndarray:
        """(n,) of the value at world points ``place`` (n, 3), seen in ``groups[group]``, that stray light may be."""
        normal = place - self.sample.center
        normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        share = 0.5 * (1.0 - normal[:, 2]) if self.grounded else np.full(len(place), 0.5)
        for k, name in enumerate(groups):
            rows, light = group == k, self.lights[name]
            toward, falloff = light.toward(place[rows])
            cosine = np.maximum(np.einsum("ij,ij->i", toward, normal[rows]), LEAST_COSINE)
            middle = light.toward(self.sample.center[None])[1][0]
            share[rows] *= self.brightness[name] * middle / (cosine * falloff)
        return share


@dataclass(frozen=True, slots=True)
class Spoilt:
    """What was left out for stray light that is not known."""

    pixels: int
    of: int
    beyond: float  # share of the value that stray light may be in what was left out, at the least
    typical: float  # in the middle one of all pixels


def unknown_stray(
    table: FacetTable, setup: Setup, seen: np.ndarray, *, grounded: bool, measured: bool
) -> UnknownStray:
    """Of surroundings whose mean radiance each view's photo shows as ``seen`` (g, c), NaN where it shows none.

    Where the lamps' strengths are not ``measured``, but mere proportions, they are at least so large that the sample
    is no whiter than white. Nor are the surroundings: they are no brighter than white that faces the lamp.
    """
    views = {view.name: view for view in setup.views}
    ball = setup.ball
    channels = [setup.channels.index(name) for name in table.channels]
    whitest = float(np.median(table.value / table.weight[:, None], axis=0).max())
    least = 1.0 if measured else np.pi * whitest
    brightness = {}
    for name, radiance in zip(table.groups, seen, strict=True):
        falloff = views[name].light.toward(ball.center[None])[1][0]
        lamp = float(views[name].strength[channels].mean() * falloff * least)
        found = np.pi * max(float(radiance[channels].mean()), 0.0) / lamp
        brightness[name] = min(found, 1.0) if np.isfinite(radiance).all() else PAPER
    lights = {name: views[name].light for name in table.groups}
    return UnknownStray(ball, lights, brightness, grounded)


def without_spoilt(table: FacetTable, unknown: UnknownStray) -> tuple[FacetTable, Spoilt]:
    """``table`` without the cells that stray light may spoil, whose pixels it counts as left out."""
    share = unknown.shares(table.place / table.weight[:, None], table.group, table.groups)
    typical, most = _quantiles(share, table.count, (0.5, 1.0 - MOST))
    limit = max(typical + TOLERANCE, most)
    keep = share <= limit
    lost = np.bincount(table.group[~keep], table.count[~keep], len(table.groups)).astype(np.int64)
    left_out = table.left_out.copy()
    left_out[:, LEFT_OUT.index("stray")] += lost
    rows = {name: getattr(table, name)[keep] for name in ("group", "facet_i", "facet_r", *SUMS)}
    spoilt = Spoilt(int(lost.sum()), round(table.count.sum()), limit, typical)
    return replace(table, left_out=left_out, **rows), spoilt


def _quantiles(values: np.ndarray, count: np.ndarray, at: Sequence[float]) -> list[float]:
    """Of values that each count ``count`` times."""
    order = np.argsort(values, kind="stable")
    below = np.cumsum(count[order])
    return [float(values[order[np.searchsorted(below, q * below[-1])]]) for q in at]
