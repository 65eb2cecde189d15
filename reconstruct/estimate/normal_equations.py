"""Penalised weighted least squares from sufficient statistics, kept a fold apart.

Whatever is tried on one design (orders, prior strengths, folds left out) costs a solve of the size of the unknowns,
not another pass over the cells. Unknowns are mode coefficients, free under a quadratic penalty, and lobe
coefficients, bounded and without penalty.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache

import numpy as np
from scipy.linalg import LinAlgError
from scipy.linalg.lapack import dpotrf, dpotrs

from photogonio.reconstruct.estimate.bounded_kernel import FREE, HIGH, LOW, bounded

RIDGE = 1e-12  # of the mean diagonal: only keeps an exactly singular matrix solvable


@dataclass(frozen=True, slots=True)
class Statistics:
    """Sums over the cells of each fold; f folds, c channels, m modes, then q lobe columns."""

    modes_gram: np.ndarray  # (f, c, m, m) A^T W A of the modes, which several sets of lobes may share
    across: np.ndarray  # (f, c, m, q) the same of modes and lobes
    lobes_gram: np.ndarray  # (f, c, q, q) the same of the lobes
    moment: np.ndarray  # (f, c, m + q) A^T W y
    square: np.ndarray  # (f, c) y^T W y
    cells: np.ndarray  # (f,) number of cells

    @property
    def modes(self) -> int:
        """m."""
        return self.modes_gram.shape[-1]

    @property
    def gram(self) -> np.ndarray:
        """(f, c, m + q, m + q) A^T W A of all columns."""
        below = np.concatenate([np.swapaxes(self.across, -1, -2), self.lobes_gram], axis=-1)
        return np.concatenate([np.concatenate([self.modes_gram, self.across], axis=-1), below], axis=-2)

    def prefix(self, modes: int) -> Statistics:
        """The same with only the first ``modes`` modes: a lower order."""
        return replace(
            self,
            modes_gram=self.modes_gram[..., :modes, :modes],
            across=self.across[..., :modes, :],
            moment=np.concatenate([self.moment[..., :modes], self.moment[..., self.modes :]], axis=-1),
        )

    def of_channels(self, some: slice) -> Statistics:
        """The same of some channels."""
        return replace(
            self,
            modes_gram=self.modes_gram[:, some],
            across=self.across[:, some],
            lobes_gram=self.lobes_gram[:, some],
            moment=self.moment[:, some],
            square=self.square[:, some],
        )

    def total(self) -> Statistics:
        """All folds as one."""
        return Statistics(*(getattr(self, each.name).sum(0, keepdims=True) for each in fields(self)))

    def without_each(self) -> Statistics:
        """For each fold, the sums over all the others."""
        return without_each((self,))[0]

    def residual(self, solution: np.ndarray) -> np.ndarray:
        """Weighted sum of squared residuals (f, c) of solutions (f, c, m + q)."""
        return residual_each((self,), (solution,))[0]


def without_each(several: Sequence[Statistics]) -> list[Statistics]:
    """For each fold, the sums over all the others, of several sets of lobes over the same modes: these once."""

    def others(sums: np.ndarray) -> np.ndarray:
        return sums.sum(0) - sums

    modes = others(several[0].modes_gram)
    return [
        Statistics(modes, *(others(getattr(one, each.name)) for each in fields(one)[1:])) for one in several
    ]


def residual_each(several: Sequence[Statistics], solutions: Sequence[np.ndarray]) -> list[np.ndarray]:
    """:meth:`Statistics.residual` of solutions for several sets of lobes over the same modes, in one product."""
    m = several[0].modes
    along = several[0].modes_gram @ np.stack([solution[..., :m] for solution in solutions], axis=-1)
    result = []
    for k, (one, solution) in enumerate(zip(several, solutions, strict=True)):
        modes, lobes = solution[..., :m], solution[..., m:, None]
        side = along[..., k] + 2.0 * (one.across @ lobes)[..., 0] - 2.0 * one.moment[..., :m]
        own = (one.lobes_gram @ lobes)[..., 0] - 2.0 * one.moment[..., m:]
        squares = one.square + np.sum(modes * side, axis=-1) + np.sum(lobes[..., 0] * own, axis=-1)
        result.append(np.maximum(squares, 0.0))
    return result


class Factors:
    """Cholesky factors of the penalised modes' blocks, (f, c) of them: what solves with any lobes share."""

    def __init__(self, gram: np.ndarray, penalty: np.ndarray):
        """``gram`` (f, c, m, m) sums of the modes alone; ``penalty`` (c, m) weighs the squared coefficients.

        One channel's factors serve any number of right-hand sides' channels.
        """
        every = np.arange(gram.shape[-1])
        diagonal = gram[..., every, every]
        diagonal += penalty + (RIDGE * diagonal.mean(-1, keepdims=True) + np.finfo(float).tiny)

        def factor(block: np.ndarray, own: np.ndarray) -> np.ndarray:
            block = block.copy()  # one at a time: it is still in the cache when it is factored
            block[every, every] = own
            return cholesky(block)

        self._factors = [
            [factor(*one) for one in zip(*fold, strict=True)] for fold in zip(gram, diagonal, strict=True)
        ]

    def __call__(self, right: np.ndarray) -> np.ndarray:
        """Solutions (f, c, m, k) for right-hand sides (f, c, m, k)."""
        folds, channels, m, k = right.shape
        if self._factors and len(self._factors[0]) == 1 < channels:  # of all channels: solved together
            side_by_side = np.moveaxis(right, 1, 2).reshape(folds, 1, m, channels * k)
            return np.moveaxis(self(side_by_side).reshape(folds, m, channels, k), 2, 1)
        solved = [
            [cholesky_solve(factor, b) for factor, b in zip(fold, fold_right, strict=True)]
            for fold, fold_right in zip(self._factors, right, strict=True)
        ]
        return np.array(solved).reshape(right.shape)


def cholesky(matrix: np.ndarray) -> np.ndarray:
    """Factor of a symmetric positive matrix (k, k), which is overwritten, for :func:`cholesky_solve`. Without the
    checks of scipy's own, which cost more than systems of some ten unknowns.

    Raises:
        LinAlgError: the matrix is not positive.
    """
    factor, failed = dpotrf(matrix.T, lower=True, clean=False, overwrite_a=True)
    if failed:
        raise LinAlgError(f"leading minor {failed} is not positive")
    return factor


def cholesky_solve(factor: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solutions (k, r) for right-hand sides (k, r)."""
    return dpotrs(factor, right, lower=True)[0] if right.size else right


def solve(statistics: Statistics, factors: Factors, upper: np.ndarray) -> np.ndarray:
    """Solutions (f, c, m + q) of least penalised residual for each fold's sums.

    ``factors`` are those of the modes' own block under the same penalty; lobe coefficients stay in [0, ``upper``]
    (q,). The modes are eliminated first (Schur's complement), so that bounds cost a problem of q unknowns.
    """
    return solve_each((statistics,), factors, (upper,))[0]


def solve_each(
    several: Sequence[Statistics], factors: Factors, uppers: Sequence[np.ndarray]
) -> list[np.ndarray]:
    """:func:`solve` for several sets of lobes over the same modes, which are eliminated for all of them at once."""
    m = several[0].modes
    right = [np.concatenate([one.moment[..., :m, None], one.across], axis=-1) for one in several]
    eliminated = factors(right[0] if len(right) == 1 else np.concatenate(right, axis=-1))
    ends = itertools.accumulate((part.shape[-1] for part in right), initial=0)
    return [
        _with_lobes(one, eliminated[..., start:stop], upper)
        for one, (start, stop), upper in zip(several, itertools.pairwise(ends), uppers, strict=True)
    ]


def _with_lobes(statistics: Statistics, eliminated: np.ndarray, upper: np.ndarray) -> np.ndarray:
    free, across = eliminated[..., 0], eliminated[..., 1:]
    if not len(upper):
        return free
    below = np.swapaxes(statistics.across, -1, -2)
    gram = statistics.lobes_gram - below @ across
    moment = statistics.moment[..., statistics.modes :] - (below @ free[..., None])[..., 0]
    lobe = _bounded_all(gram, moment, upper)
    return np.concatenate([free - (across @ lobe[..., None])[..., 0], lobe], axis=-1)


def _bounded_all(gram: np.ndarray, moment: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """The x (f, c, q) in [0, ``upper``] of least x^T gram x - 2 x^T moment for each fold and channel: of the set of
    active bounds that meets the conditions of Karush, Kuhn and Tucker, fewest bounds first. There are at most a few
    lobe coefficients."""
    every, q = np.arange(len(upper)), len(upper)
    gram = gram.copy()
    gram[..., every, every] *= 1.0 + RIDGE
    gram[..., every, every] += np.finfo(float).tiny
    lobe = np.empty((*gram.shape[:-2], q))
    patterns = _patterns(tuple(np.isfinite(upper).tolist()))
    bounded(
        gram.reshape(-1, q, q),
        np.ascontiguousarray(moment).reshape(-1, q),
        upper,
        patterns,
        lobe.reshape(-1, q),
    )
    return lobe


@lru_cache(maxsize=64)
def _patterns(limited: tuple[bool, ...]) -> np.ndarray:
    """(p, q) the sets of active bounds of coefficients that have an upper one or not, fewest bounds first."""
    choices = [(FREE, LOW, HIGH) if one else (FREE, LOW) for one in limited]
    every = sorted(itertools.product(*choices), key=lambda states: len(limited) - states.count(FREE))
    return np.array(every, np.int64)
