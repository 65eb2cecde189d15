"""Penalised weighted least squares from sufficient statistics, kept a fold apart.

Whatever is tried on one design (orders, prior strengths, folds left out) costs a solve of the size of the unknowns,
not another pass over the cells. Unknowns are mode coefficients, free under a quadratic penalty, and lobe
coefficients, bounded and without penalty.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import cho_factor, cho_solve

KKT_SLACK = 1e-10  # of the largest moment: rounding
NARROW = 8  # columns: of fewer, sums by units come cheaper all at once than unit by unit
PART = 2048  # rows of the design that are weighed at once
RIDGE = 1e-12  # of the mean diagonal: only keeps an exactly singular matrix solvable


@dataclass(frozen=True, slots=True)
class Statistics:
    """Sums over the cells of each fold; f folds, c channels, m modes, then q lobe columns."""

    gram: np.ndarray  # (f, c, m + q, m + q) A^T W A
    moment: np.ndarray  # (f, c, m + q) A^T W y
    square: np.ndarray  # (f, c) y^T W y
    cells: np.ndarray  # (f,) number of cells
    modes: int  # m

    def prefix(self, modes: int) -> Statistics:
        """The same with only the first ``modes`` modes: a lower order."""
        keep = np.r_[0:modes, self.modes : self.gram.shape[-1]]
        return Statistics(
            self.gram[..., keep[:, None], keep], self.moment[..., keep], self.square, self.cells, modes
        )

    def total(self) -> Statistics:
        """All folds as one."""
        return Statistics(
            self.gram.sum(0, keepdims=True),
            self.moment.sum(0, keepdims=True),
            self.square.sum(0, keepdims=True),
            self.cells.sum(keepdims=True),
            self.modes,
        )

    def without_each(self) -> Statistics:
        """For each fold, the sums over all the others."""
        return Statistics(
            self.gram.sum(0) - self.gram,
            self.moment.sum(0) - self.moment,
            self.square.sum(0) - self.square,
            self.cells.sum() - self.cells,
            self.modes,
        )

    @property
    def modes_gram(self) -> np.ndarray:
        """(f, c, m, m) sums of the modes alone."""
        return self.gram[..., : self.modes, : self.modes]

    def residual(self, solution: np.ndarray) -> np.ndarray:
        """Weighted sum of squared residuals (f, c) of solutions (f, c, m + q)."""
        across = (self.gram @ solution[..., None])[..., 0]
        return np.maximum(self.square + np.sum(solution * (across - 2.0 * self.moment), axis=-1), 0.0)


@dataclass(frozen=True, slots=True)
class Common:
    """Errors that the cells of a unit (a view) share, beside their own: independent multiples of a pattern.

    The residuals of unit u have covariance diag(1 / weight) + pattern pattern^T, whose inverse differs from
    diag(weight) by one outer product (Sherman and Morrison 1950).
    """

    unit: np.ndarray  # (n,) integers 0 .. u - 1; a unit lies in one fold
    pattern: np.ndarray  # (n, c) one standard deviation of the shared error

    def take(self, keep: np.ndarray) -> Common:
        return Common(self.unit[keep], self.pattern[keep])

    def shared(self, residual: np.ndarray, weight: np.ndarray) -> np.ndarray:
        """(n, c) the likeliest share of ``residual`` (n, c) that is the units' common error."""
        scaled = weight * self.pattern
        share = self.sums(scaled * residual) / (1.0 + self.sums(scaled * self.pattern))
        return self.pattern * share[self.unit]

    def sums(self, rows: np.ndarray) -> np.ndarray:
        """(u, k) sums of ``rows`` (n, k) over the cells of each unit."""
        return np.stack([np.bincount(self.unit, row) for row in rows.T], axis=-1)


class FoldedDesign:
    """The modes' design matrix with its weights and folds; its own Gram matrices are formed once.

    With a :class:`Common` error all sums are those of generalised least squares, each unit's rows weighed by its
    whole inverse covariance.
    """

    def __init__(
        self, design: np.ndarray, weight: np.ndarray, fold: np.ndarray, common: Common | None = None
    ):
        """``design`` (n, m), ``weight`` (n, c), or (n, 1) for all channels, ``fold`` (n,) integers 0 .. f - 1."""
        order = np.lexsort((np.zeros_like(fold) if common is None else common.unit, fold))
        self._rows = order
        self._design = design[order]
        self._weight = weight[order]
        self._bounds = np.searchsorted(fold[order], np.arange(fold.max(initial=0) + 2))
        self._common = common.take(order) if common is not None else None
        self._gram = np.stack([self._fold_gram(s) for s in self._slices()])
        if self._common is not None:
            self._starts = np.flatnonzero(
                np.diff(self._common.unit, prepend=-1)
            )  # each unit's rows are together
            self._unit_fold = fold[order][self._starts]
            self._scaled = self._weight * self._common.pattern
            self._size = np.sqrt(1.0 + np.add.reduceat(self._scaled * self._common.pattern, self._starts))
            self._modes_along = self._along(self._design)
            self._gram -= self._products(self._modes_along, self._modes_along)

    def _slices(self) -> list[slice]:
        return [slice(a, b) for a, b in zip(self._bounds[:-1], self._bounds[1:], strict=True)]

    def _fold_gram(self, rows: slice) -> np.ndarray:
        """(c, m, m) of one fold, by parts that stay in the cache; numpy forms half of a symmetric product."""
        x, root = self._design[rows], np.sqrt(self._weight[rows])
        gram = np.zeros((root.shape[1], x.shape[1], x.shape[1]))
        for start in range(0, len(x), PART):
            part, roots = x[start : start + PART], root[start : start + PART]
            for c in range(root.shape[1]):
                weighed = part * roots[:, c, None]
                gram[c] += weighed.T @ weighed
        return gram

    def _along(self, rows: np.ndarray) -> np.ndarray:
        """(u, c, k) parts of ``rows`` (n, k) or (n, c, k) along each unit's pattern, scaled for the outer products."""
        if rows.ndim == 3:
            sums = np.add.reduceat(self._scaled[..., None] * rows, self._starts)
        elif rows.shape[1] <= NARROW:
            sums = (
                np.stack(
                    [np.add.reduceat(self._scaled * row[:, None], self._starts) for row in rows.T], axis=-1
                )
                if rows.shape[1]
                else np.empty((len(self._starts), self._scaled.shape[1], 0))
            )
        else:
            ends = np.append(self._starts[1:], len(rows))
            sums = np.stack(
                [self._scaled[a:b].T @ rows[a:b] for a, b in zip(self._starts, ends, strict=True)]
            )
        return sums / self._size[..., None]

    def _products(self, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        """(f, c, k, k') sums over the units of each fold of outer products."""
        total = np.zeros((len(self._bounds) - 1, *left.shape[1:], right.shape[-1]))
        bounds = np.searchsorted(self._unit_fold, np.arange(len(total) + 1))  # rows lie fold by fold
        for f, (a, b) in enumerate(pairwise(bounds)):
            total[f] = left[a:b].transpose(1, 2, 0) @ right[a:b].transpose(1, 0, 2)
        return total

    @property
    def modes_gram(self) -> np.ndarray:
        """(f, c, m, m) sums of the modes alone."""
        return self._gram

    def statistics(self, target: np.ndarray, columns: np.ndarray) -> Statistics:
        """Sums for ``target`` (n, c) with lobe ``columns`` (n, q) beside the modes."""
        target, columns = target[self._rows], columns[self._rows]
        m, q = self._design.shape[1], columns.shape[1]
        folds, channels = len(self._bounds) - 1, target.shape[1]
        gram = np.empty((folds, channels, m + q, m + q))
        gram[..., :m, :m] = self._gram
        moment = np.empty((folds, channels, m + q))
        square = np.empty((folds, channels))
        for f, rows in enumerate(self._slices()):
            x, w, y, lobe = self._design[rows], self._weight[rows], target[rows], columns[rows]
            weighed = np.empty((len(x), q + 1, channels))  # lobes, and the target: one product for all
            np.multiply(lobe[:, :, None], w[:, None, :], out=weighed[:, :q])
            np.multiply(w, y, out=weighed[:, q])
            square[f] = np.sum(weighed[:, q] * y, axis=0)
            for own, k in ((x, np.s_[:m]), (lobe, np.s_[m:])):
                sums = (own.T @ weighed.reshape(len(x), -1)).reshape(-1, q + 1, channels)
                gram[f, :, k, m:] = sums[:, :q].transpose(2, 0, 1)
                moment[f, :, k] = sums[:, q].T
        if self._common is not None:
            self._take_away_shared(target, columns, gram, moment, square)
        gram[..., m:, :m] = np.swapaxes(gram[..., :m, m:], -1, -2)
        return Statistics(gram, moment, square, np.diff(self._bounds), m)

    def _take_away_shared(self, target, columns, gram, moment, square) -> None:
        m = self._design.shape[1]
        lobes, values = self._along(columns), self._along(target[..., None])
        gram[..., :m, m:] -= self._products(self._modes_along, lobes)
        gram[..., m:, m:] -= self._products(lobes, lobes)
        moment[..., :m] -= self._products(self._modes_along, values)[..., 0]
        moment[..., m:] -= self._products(lobes, values)[..., 0]
        square -= self._products(values, values)[..., 0, 0]


class Factors:
    """Cholesky factors of the penalised modes' blocks, (f, c) of them: what solves with any lobes share."""

    def __init__(self, gram: np.ndarray, penalty: np.ndarray):
        """``gram`` (f, c, m, m) sums of the modes alone; ``penalty`` (c, m) weighs the squared coefficients.

        One channel's factors serve any number of right-hand sides' channels.
        """
        blocks = gram.copy()
        every = np.arange(blocks.shape[-1])
        ridge = RIDGE * blocks[..., every, every].mean(-1, keepdims=True) + np.finfo(float).tiny
        blocks[..., every, every] += penalty + ridge
        self._factors = [[cho_factor(block, check_finite=False) for block in fold] for fold in blocks]

    def __call__(self, right: np.ndarray) -> np.ndarray:
        """Solutions (f, c, m, k) for right-hand sides (f, c, m, k)."""
        channels = right.shape[1]
        solved = [
            [
                cho_solve(factor, b, check_finite=False)
                for factor, b in zip(fold if len(fold) > 1 else fold * channels, fold_right, strict=True)
            ]
            for fold, fold_right in zip(self._factors, right, strict=True)
        ]
        return np.array(solved).reshape(right.shape)


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
    right = [np.concatenate([one.moment[..., :m, None], one.gram[..., :m, m:]], axis=-1) for one in several]
    ends = np.cumsum([part.shape[-1] for part in right])
    eliminated = np.split(factors(np.concatenate(right, axis=-1)), ends[:-1], axis=-1)
    return [_with_lobes(*rest) for rest in zip(several, eliminated, uppers, strict=True)]


def _with_lobes(statistics: Statistics, eliminated: np.ndarray, upper: np.ndarray) -> np.ndarray:
    m = statistics.modes
    free, across = eliminated[..., 0], eliminated[..., 1:]
    below = np.swapaxes(statistics.gram[..., :m, m:], -1, -2)
    gram = statistics.gram[..., m:, m:] - below @ across
    moment = statistics.moment[..., m:] - (below @ free[..., None])[..., 0]
    lobe = _bounded_all(gram, moment, upper)
    return np.concatenate([free - (across @ lobe[..., None])[..., 0], lobe], axis=-1)


def _bounded_all(gram: np.ndarray, moment: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """:func:`_bounded` for each fold and channel; most have no active bound, and one batched solve serves them."""
    if not len(upper):
        return moment
    every = np.arange(len(upper))
    gram = gram.copy()
    gram[..., every, every] *= 1.0 + RIDGE
    gram[..., every, every] += np.finfo(float).tiny
    lobe = np.linalg.solve(gram, moment[..., None])[..., 0]
    outside = ((lobe < 0.0) | (lobe > upper)).any(-1)
    for index in zip(*np.nonzero(outside), strict=True):
        lobe[index] = _bounded(gram[index], moment[index], upper)
    return lobe


def _bounded(gram: np.ndarray, moment: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """The x in [0, upper] of least x^T gram x - 2 x^T moment: the set of active bounds that meets the conditions of
    Karush, Kuhn and Tucker, fewest bounds first. There are at most a few lobe coefficients."""
    q = len(upper)
    choices = [(_FREE, _LOW, _HIGH) if np.isfinite(u) else (_FREE, _LOW) for u in upper]
    for pattern in sorted(itertools.product(*choices), key=lambda states: q - states.count(_FREE)):
        free = [k for k in range(q) if pattern[k] == _FREE]
        x = np.array([upper[k] if pattern[k] == _HIGH else 0.0 for k in range(q)])
        if free:
            right = moment[free] - gram[free] @ x
            x[free] = np.linalg.solve(gram[free][:, free], right)
        uphill = gram @ x - moment
        slack = KKT_SLACK * np.abs(moment).max()
        if all(
            0.0 <= x[k] <= upper[k]
            if s == _FREE
            else uphill[k] >= -slack
            if s == _LOW
            else uphill[k] <= slack
            for k, s in enumerate(pattern)
        ):
            return x
    return np.clip(x, 0.0, upper)


_FREE, _LOW, _HIGH = range(3)
