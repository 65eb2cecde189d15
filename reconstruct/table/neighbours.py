"""What the rows about a pair of directions say of it: local fits, without any model of the surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from photogonio.capture import robust

NEIGHBOURS = 14
ALIKE = 1e-4  # radians between pairs of directions that are one
UNTURNED = 1e-3  # radians from the normal, within which an azimuth means nothing
RIDGE = 1e-3  # of the spread of places, so that a direction in which none differ has no slope
_RIDGES = RIDGE * np.array([0.0, 1.0, 1.0, 1.0])
ROUNDS = 4  # of weighing neighbours by how far they are from the others
_BATCH = 20000


@dataclass(frozen=True, slots=True)
class Expected:
    """What neighbours say of each of q places: of a value above zero."""

    value: np.ndarray  # (q,) by logarithms that are linear over the neighbourhood
    spread: np.ndarray  # (q,) standard error of its logarithm, by what the neighbours miss
    straight: np.ndarray  # (q,) by values that are linear
    rough: np.ndarray  # (q,) standard error of that

    @property
    def least(self) -> np.ndarray:
        """(q,) what a value can hardly be below."""
        return self.value * np.exp(-3.0 * np.minimum(self.spread, 200.0))


def places(theta_i: np.ndarray, theta_r: np.ndarray, dphi: np.ndarray) -> np.ndarray:
    """(n, 4) points of an isotropic surface's pairs, whose distance is about the angle between directions; ``dphi`` of
    either sign."""
    dphi = np.abs((dphi + np.pi) % (2.0 * np.pi) - np.pi)
    sine = np.sin(theta_r)
    return np.column_stack([theta_i, sine * np.cos(dphi), sine * np.sin(dphi), np.cos(theta_r)])


def numbered(at: np.ndarray) -> np.ndarray:
    """(n, 4) of places (n, 4) as whole numbers, the same for pairs at which an isotropic surface is the same: light
    from the normal has no azimuth."""
    same = at.copy()
    normal = at[:, 0] < UNTURNED
    same[normal, 1], same[normal, 2] = np.hypot(at[normal, 1], at[normal, 2]), 0.0
    return np.rint(same / ALIKE)


def apart(value: np.ndarray, number: np.ndarray) -> np.ndarray:
    """(k,) ascending values (n,), each once for every place it comes at, whose whole numbers (n, 4) are given: the same
    value at the same place is not repeated."""
    low = number.min(axis=0)
    width = (number.max(axis=0) - low + 1.0).astype(np.int64)
    key = np.zeros(len(number), np.int64)  # a number alone sorts ten times as fast as four of them
    for column, wide in zip((number - low).astype(np.int64).T, width, strict=True):
        key = key * wide + column
    order = np.lexsort((key, value))
    value, key = value[order], key[order]
    return value[np.r_[True, (np.diff(value) != 0.0) | (np.diff(key) != 0)]]


def expected(
    at: np.ndarray, value: np.ndarray, where: np.ndarray, *, own: bool = False, tree: cKDTree | None = None
) -> Expected:
    """What rows at places ``at`` (n, 4) with ``value`` (n,) above zero say of places ``where`` (q, 4).

    ``own``: ``where`` are the rows themselves, each to be judged by the others. The fit is linear in the places,
    weighted by nearness; its error is that of a fresh reading. ``tree`` is that of ``at``, for who asks more than once.
    """
    count = min(NEIGHBOURS + own, len(at))
    tree = cKDTree(at) if tree is None else tree
    parts = []
    for start in range(0, len(where), _BATCH):
        here = where[start : start + _BATCH]
        distance, row = tree.query(here, k=[*range(1 + own, count + 1)])
        parts.append(_fitted(at[row] - here[:, None], distance, value[row]))
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    return Expected(*columns)


def _fitted(offset: np.ndarray, distance: np.ndarray, value: np.ndarray) -> tuple[np.ndarray, ...]:
    """Value and error (q,) of logarithms and of plain values at the origin, of neighbours (q, k)."""
    scale = np.median(distance, axis=1, keepdims=True) + 1e-6
    near = 1.0 / (1.0 + (distance / scale) ** 2)
    design = np.concatenate([np.ones_like(distance)[..., None], offset[..., :3] / scale[..., None]], axis=2)
    logs, spread, weight = _line(design, near, np.log(value), near, rounds=ROUNDS)
    straight, rough, _ = _line(design, weight, value, near, rounds=0)
    most = np.log(value).max(1) + 1.0  # a slope leads anywhere
    return np.exp(np.clip(logs, -700.0, most)), spread, straight, rough


def _line(
    design: np.ndarray, weight: np.ndarray, readings: np.ndarray, near: np.ndarray, *, rounds: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """At the origin the value (q,) and error (q,) of planes through readings (q, k), and the weights (q, k) that
    readings far from the others, a peak in the corner, have lost."""
    free = readings.shape[1] / max(readings.shape[1] - 4.0, 1.0)
    across, corner = np.ascontiguousarray(np.swapaxes(design, 1, 2)), np.arange(4)
    sides = np.zeros((len(design), 4, 2))
    sides[:, 0, 0] = 1.0  # for the inverse's first row: how much each reading counts at the origin
    for left in range(rounds, -1, -1):
        weighed = across * weight[:, None]
        gram = weighed @ design
        gram[:, corner, corner] += _RIDGES * weight.sum(1)[:, None] + 1e-12
        sides[:, :, 1] = (weighed @ readings[..., None])[..., 0]
        found = np.linalg.solve(gram, sides)
        missed = np.abs(readings - (design @ found[..., 1:])[..., 0])
        if left:
            typical = robust.deviation(missed, axis=1, keepdims=True) + 1e-9
            weight = near / (1.0 + (missed / (2.0 * typical)) ** 2) ** 2
    counts = (found[:, None, :, 0] @ weighed)[:, 0]
    variance = free * (weight * missed**2).sum(1) / np.maximum(weight.sum(1), 1e-300)
    return found[:, 0, 1], np.sqrt(variance * (1.0 + np.sum(counts**2, axis=1))), weight
