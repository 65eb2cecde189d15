"""What is believed of f, as a linear model with a covariance: the one that photos narrow.

Relative departures of f are a sum of features whose weights are independent and of unit variance before any further
photo: what the parameters of a BRDF leave open, by their covariance, and a smooth function of the pair of directions
of which nothing is known but how large it may be. A photo reads f at its pairs, each with a noise of its own and all
with one error of the lamp's strength; what it leaves of the covariance follows by a rank update (Rasmussen and
Williams 2006, ch. 2; Chaloner and Verdinelli 1995 on design by the trace of what is left).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.brdf.parameters import slopes
from photogonio.reconstruct.design.pairs import SeenPairs

NODES = 7  # polar angles of the region's grid, either way
TURNS = 6  # differences of azimuths
WIDTHS = (
    0.55,
    0.75,
    0.55,
)  # of the smooth function along the sum, the difference, and their product: of orders up to 4,
# which is what traced sets of paint and lacquer asked for beside their lobes
TURNED_WIDTHS = (0.55, 0.75, 0.75)
NOISE = 0.007  # relative, of one of a photo's pairs: photos of traced sets differ so much at the same pairs
STRENGTH = 0.003  # relative, of a lamp's strength in a photo, as calibrations of such sets state it
FAINT = 0.02  # of the mean of f: smaller counts as this
JITTER = 1e-6

Amplitude = Callable[[SeenPairs], np.ndarray]


@dataclass(frozen=True, slots=True)
class Belief:
    """f with what is not known of it."""

    brdf: Brdf  # of one channel
    spread: np.ndarray  # (p, p) covariance of its parameters
    parameters: tuple[str, ...]
    amplitude: Amplitude  # standard deviation of the smooth departure at pairs, relative to f
    turning: bool  # whether the surface may change when it is turned
    region: SeenPairs  # where f is to be known
    weight: np.ndarray  # (m,) of the region's pairs, adding up to 1
    floor: float = 0.0  # relative variance in the mean that no photo lowers
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))  # of the features
    _whitened: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    @classmethod
    def of(
        cls,
        brdf: Brdf,
        amplitude: Amplitude,
        *,
        turning: bool = False,
        limit: float = 80.0,
        floor: Amplitude | None = None,
    ) -> Belief:
        """Of a BRDF of one channel that knows its errors, up to ``limit`` degrees from the normal."""
        known = brdf.uncertainty
        names = () if known is None else known.parameters
        spread = np.zeros((0, 0)) if known is None else known.spread()[0]
        region, weight = region_pairs(limit, turning=turning)
        flat = 0.0 if floor is None else float(weight @ floor(region) ** 2)
        start = cls(brdf, spread, names, amplitude, turning, region, weight, flat)
        inner = _kernel(region, region, turning)
        values, vectors = np.linalg.eigh(inner)
        keep = values > JITTER * values[-1]
        whitened = vectors[:, keep] / np.sqrt(values[keep])
        start = replace(start, _whitened=whitened)
        return replace(start, covariance=np.eye(start.features(region).shape[1]))

    def features(self, pairs: SeenPairs) -> np.ndarray:
        """(n, k) of relative departures of f at pairs."""
        smooth = _kernel(pairs, self.region, self.turning) @ self._whitened
        parts = [self.amplitude(pairs)[:, None] * smooth]
        if len(self.parameters):
            values, vectors = np.linalg.eigh(self.spread)
            root = vectors * np.sqrt(np.maximum(values, 0.0))
            f = self.brdf.evaluate(*pairs.angles)[:, 0]
            least = FAINT * float(np.mean(np.abs(f))) if len(f) else 0.0
            change = slopes(self.brdf, pairs.angles, self.parameters)[:, :, 0]
            parts.append((change @ root) / np.maximum(np.abs(f), max(least, 1e-9))[:, None])
        return np.hstack(parts)

    def mean_variance(self) -> float:
        """Of f over the region, relative to its square."""
        rows = self.features(self.region)
        return float(self.weight @ np.einsum("nk,kl,nl->n", rows, self.covariance, rows)) + self.floor

    def criterion(self) -> np.ndarray:
        """(k, k) whose product with the covariance has the mean variance, but for the floor, as its trace."""
        rows = self.features(self.region)
        return rows.T @ (self.weight[:, None] * rows)

    def seen(self, pairs: SeenPairs) -> Belief:
        """What a photo leaves of it that reads f at ``pairs``."""
        if not len(pairs):
            return self
        return replace(self, covariance=updated(self.covariance, self.features(pairs), noise(pairs)))


def noise(pairs: SeenPairs) -> np.ndarray:
    """(n, n) covariance of a photo's relative readings: a dimmer pair has more, and all share the lamp's strength."""
    lit = np.cos(pairs.theta_i) * np.cos(pairs.theta_r)
    return np.diag(NOISE**2 / np.clip(lit, 0.02, 1.0)) + STRENGTH**2


def updated(covariance: np.ndarray, rows: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Covariance (k, k) of weights after readings ``rows`` (n, k) with errors ``noise`` (n, n)."""
    across = rows @ covariance
    gain = np.linalg.solve(noise + across @ rows.T, across)
    left = covariance - across.T @ gain
    return 0.5 * (left + left.T)


def lowered(covariance: np.ndarray, criterion: np.ndarray, rows: np.ndarray, noise: np.ndarray) -> float:
    """By how much a photo's readings lower the trace of ``criterion`` times the covariance."""
    across = rows @ covariance
    gain = np.linalg.solve(noise + across @ rows.T, across)
    return float(np.einsum("nk,nk->", gain @ criterion, across))


def region_pairs(limit: float, *, turning: bool = False) -> tuple[SeenPairs, np.ndarray]:
    """Pairs up to ``limit`` degrees and their weights by projected solid angle, adding up to 1. Reciprocal twins are
    one pair; of a turning surface the pairs are turned too, one after the other."""
    theta = np.radians(limit) * (np.arange(NODES) + 0.5) / NODES
    dphi = np.pi * (np.arange(TURNS) + 0.5) / TURNS
    i, r, d = (a.ravel() for a in np.meshgrid(theta, theta, dphi, indexing="ij"))
    once = i <= r + 1e-9
    i, r, d = i[once], r[once], d[once]
    weight = np.sin(2 * i) * np.sin(2 * r) * np.where(np.isclose(i, r), 1.0, 2.0)
    start = np.zeros_like(i)
    if turning:
        start = 2.399963 * np.arange(len(i))  # the golden angle: no two turns alike
    return SeenPairs(i, start, r, start + d), weight / weight.sum()


def _kernel(one: SeenPairs, other: SeenPairs, turning: bool) -> np.ndarray:
    """(n, m) correlation of the smooth departure between pairs."""
    a, b = places(one, turning), places(other, turning)
    return np.exp(-0.5 * ((a[:, None] - b[None]) ** 2).sum(2))


def places(pairs: SeenPairs, turning: bool) -> np.ndarray:
    """(n, 3 or 5) coordinates in which pairs are near that f should be alike at, and a pair is at its reciprocal twin;
    without ``turning`` also at all that are turned or mirrored."""
    disc = [
        np.sqrt(2) * np.sin(t / 2)[:, None] * np.column_stack([np.cos(p), np.sin(p)])
        for t, p in ((pairs.theta_i, pairs.phi_i), (pairs.theta_r, pairs.phi_r))
    ]
    total, apart = disc[0] + disc[1], disc[0] - disc[1]
    length = np.hypot(*apart.T)
    if not turning:
        product = np.abs((total * apart).sum(1))
        return np.column_stack([np.hypot(*total.T), length, product]) / WIDTHS
    doubled = np.column_stack([apart[:, 0] ** 2 - apart[:, 1] ** 2, 2 * apart[:, 0] * apart[:, 1]])
    doubled /= np.maximum(length, 1e-9)[:, None]
    sums, differences, turns = TURNED_WIDTHS
    return np.column_stack([total / sums, length / differences, doubled / turns])
