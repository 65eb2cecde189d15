"""Values of one rig over many sets: what all share, how much it changes from set to set, and who contradicts.

A random-effects model (Laird and Ware, Biometrics 38, 1982): the values of set j are mu + e_j, e_j normal with a
covariance T = sum of s_g^2 U_g U_g', one size s_g for each group of directions in which rigs change together (zoom,
centre, lens). Photos tell each set's values with information A_j, which may be singular. mu and e_j are integrated in
closed form; of each size the mean square is taken under a half-Cauchy prior (Gelman, Bayesian Analysis 1, 2006), so
that few sets, which cannot tell whether a rig is steady, are not believed to say that it is.

Sets that agree better than their errors allow have errors in common, as where one camera stood in one place for all of
them: that share of the errors does not shrink with their number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc, chdtri

from photogonio.calib.rig.gaussian import RigExpected, RigTold
from photogonio.capture import robust

FEWEST = 3  # sets that make a pool
CONTRADICTS = 1e-4  # chance below which a set of the rig is none
_AGAIN = 1e-3  # and above which one that first looked otherwise is taken in
_STEADY = 0.01  # of the directions' natural size: median of a size before any set tells
_SIZES = np.concatenate([[0.0], np.geomspace(1e-5, 1.0, 26)])
_SWEEPS = 3
_ASTRAY, _LEAST = (
    6.0,
    1e-3,
)  # scatters at which a set is doubted at first, and the least scatter, of natural size
_CHANCE = 0.95  # that sets without common errors scatter by more than what is told of
_STRONG = 1e-9  # of the largest: directions of a set's information that count


@dataclass(frozen=True, slots=True)
class Pool:
    """Values over sets."""

    name: str
    value: np.ndarray  # (d,) what the sets share
    covariance: np.ndarray  # (d, d) of that
    between: np.ndarray  # (d, d) covariance of what changes from set to set
    used: tuple[bool, ...]  # by set
    chance: tuple[float, ...]  # by set: of one as far from the others

    @property
    def sets(self) -> int:
        return sum(self.used)


def pooled(told: Sequence[RigTold], changes: Sequence[np.ndarray]) -> Pool | None:
    """What sets say together. ``changes`` are the groups' directions (d, m), of natural size. None: too few sets, or no
    more than half of them agree."""
    if len(told) < FEWEST:
        return None
    sums = _Sums(told, changes)
    used = _near(sums)
    for again in (True, False):
        while True:
            sizes = sums.sizes(used)
            chance = np.array([sums.chance(k, used, sizes) for k in range(len(told))])
            joined = used | (chance >= _AGAIN) if again else used
            worst = int(np.argmin(np.where(joined, chance, np.inf)))
            if chance[worst] < CONTRADICTS and not again:
                joined = joined.copy()
                joined[worst] = False
            if (joined == used).all():
                break
            used = joined
            if used.sum() < FEWEST or 2 * used.sum() <= len(told):
                return None
    if used.sum() < FEWEST or 2 * used.sum() <= len(told):
        return None
    value, covariance = sums.common(used, sizes)
    covariance = covariance + sums.alike(used, value, covariance)
    return Pool(
        told[0].name,
        sums.back(value),
        sums.unit[:, None] * covariance * sums.unit,
        sums.unit[:, None] * sums.between(sizes) * sums.unit,
        tuple(map(bool, used)),
        tuple(map(float, chance)),
    )


def expected_of(
    told: Sequence[RigTold], changes: Sequence[np.ndarray], pool: Pool, number: int
) -> RigExpected:
    """What the other sets of a pool lead one to expect of set ``number`` of ``told``; -1: of a new set."""
    sums, used = _Sums(told, changes), np.array(pool.used)
    if number >= 0:
        used[number] = False
    between = pool.between / sums.unit / sums.unit[:, None]
    value, covariance = sums.common_with(used, between)
    covariance = covariance + sums.alike(used, value, covariance)
    whole = sums.unit[:, None] * (covariance + between) * sums.unit
    return RigExpected(pool.name, sums.back(value), (whole + whole.T) / 2, int(used.sum()))


class _Sums:
    """The sets in units in which rigs' values are near one."""

    def __init__(self, told: Sequence[RigTold], changes: Sequence[np.ndarray]):
        self.origin = np.median([one.value for one in told], axis=0)
        self.unit = np.max([np.abs(group).max(1) for group in changes], axis=0)
        self.groups = [group / self.unit[:, None] for group in changes]
        across = self.unit[:, None] * self.unit
        self.information = np.array([one.information * across for one in told])
        self.value = np.array([(one.value - self.origin) / self.unit for one in told])
        self.pull = np.einsum("kij,kj->ki", self.information, self.value)
        self.usual = np.mean([one.usual for one in told], axis=0) * across
        before = np.mean([one.before for one in told], axis=0)
        self.toward = self.usual @ ((before - self.origin) / self.unit)
        self.own = np.linalg.inv(
            self.information + self.usual
        )  # (k, d, d) of each by itself, and what it finds:
        self.alone = np.einsum("kij,kj->ki", self.own, self.pull + self.toward)

    def back(self, value: np.ndarray) -> np.ndarray:
        return self.origin + self.unit * value

    def between(self, sizes: np.ndarray) -> np.ndarray:
        return sum(size**2 * group @ group.T for size, group in zip(sizes, self.groups, strict=True))

    def sizes(self, used: np.ndarray) -> np.ndarray:
        """Root mean squares (g,) of the sizes, each with the others as they are, in turns."""
        prior = 1.0 / (1.0 + (_SIZES / _STEADY) ** 2) * np.gradient(_SIZES)
        found = np.full(len(self.groups), _STEADY)
        for _ in range(_SWEEPS):
            for g in range(len(found)):
                trials = np.broadcast_to(found, (len(_SIZES), len(found))).copy()
                trials[:, g] = _SIZES
                likely = self.likelihood(used, np.array([self.between(trial) for trial in trials]))
                weight = prior * np.exp(likely - likely.max())
                found[g] = np.sqrt((weight @ _SIZES**2) / weight.sum())
        return found

    def shrunk(self, used: np.ndarray, between: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What the sets say of what they share, for some ``between`` (..., 1, d, d): information (..., k, d, d), pull
        (..., k, d) and log density (..., k) at 0."""
        information, pull = self.information[used], self.pull[used]
        loose = np.eye(self.unit.size) + between @ information
        widened = np.linalg.solve(loose, np.broadcast_to(between, loose.shape))  # (1 + T A)^-1 T
        inner = np.einsum("...kij,kj->...ki", widened, pull)
        left = information - information @ widened @ information
        density = 0.5 * (np.einsum("ki,...ki->...k", pull, inner) - np.linalg.slogdet(loose)[1])
        return left, pull - np.einsum("kij,...kj->...ki", information, inner), density

    def likelihood(self, used: np.ndarray, between: np.ndarray) -> np.ndarray:
        """Logarithms (s,) for ``between`` (s, d, d), up to a constant."""
        information, pull, density = self.shrunk(used, between[:, None])
        whole, toward = self.usual + information.sum(1), self.toward + pull.sum(1)
        along = np.linalg.solve(whole, toward[..., None])[..., 0]
        return density.sum(1) - 0.5 * np.linalg.slogdet(whole)[1] + 0.5 * (toward * along).sum(1)

    def common(self, used: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return self.common_with(used, self.between(sizes))

    def common_with(self, used: np.ndarray, between: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What the sets share (d,) and its covariance (d, d)."""
        information, pull, _ = self.shrunk(used, between[None])
        covariance = np.linalg.inv(self.usual + information.sum(0))
        return covariance @ (self.toward + pull.sum(0)), covariance

    def alike(self, used: np.ndarray, value: np.ndarray, covariance: np.ndarray) -> np.ndarray:
        """What errors that sets have in common add to the ``covariance`` (d, d) of what they share: of each value what
        they scatter less than chance alone would let them."""
        own, count = self.own[used], int(used.sum())
        square = ((self.alone[used] - value) ** 2 / np.diagonal(own, axis1=1, axis2=2)).sum(0)
        share = np.sqrt(np.clip(1.0 - square / chdtri(max(count - 1, 1), _CHANCE), 0.0, 1.0))
        return share[:, None] * (own.mean(0) - covariance) * share

    def chance(self, number: int, used: np.ndarray, sizes: np.ndarray) -> float:
        """Of a set as far as this one from what the others say, chi-square in the directions that it tells."""
        others, between = used.copy(), self.between(sizes)
        others[number] = False
        value, covariance = self.common_with(others, between)
        size, axes = np.linalg.eigh(self.information[number])
        strong = size > _STRONG * max(size.max(), 1e-300)
        root = axes[:, strong] * np.sqrt(size[strong])
        off = root.T @ (self.value[number] - value)
        spread = np.eye(int(strong.sum())) + root.T @ (covariance + between) @ root
        return float(chdtrc(int(strong.sum()), off @ np.linalg.solve(spread, off)))


def _near(sums: _Sums) -> np.ndarray:
    """Sets (k,) that lie with most others in every value, as far as they tell it."""
    error = np.sqrt(np.diagonal(sums.own, axis1=1, axis2=2))
    off = np.abs(sums.value - np.median(sums.value, axis=0))
    scatter = robust.deviation(off, axis=0)
    near = (off <= _ASTRAY * np.hypot(np.maximum(error, scatter), _LEAST)).all(1)
    return near if 2 * near.sum() > len(near) else np.ones(len(near), bool)
