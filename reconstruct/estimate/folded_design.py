"""A design's sums by fold, formed once: the sufficient statistics of least squares, whatever is tried on them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from photogonio.reconstruct.estimate.normal_equations import Statistics

PART = 2048  # rows of the design that are weighed at once


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
        self._weight = _by_channel(weight[order])
        self._bounds = np.searchsorted(fold[order], np.arange(fold.max(initial=0) + 2))
        m = design.shape[1]
        self._gram = np.zeros((len(self._bounds) - 1, len(self._weight), m, m))
        for gram, rows in zip(self._gram, self._slices(), strict=True):
            self._add_gram(gram, rows)
        self._common = common is not None
        if common is not None:
            unit, pattern = common.unit[order], _by_channel(common.pattern[order])
            self._starts = np.flatnonzero(np.diff(unit, prepend=-1))  # each unit's rows are together
            self._scaled = self._weight * pattern
            self._size = np.sqrt(1.0 + np.add.reduceat(self._scaled * pattern, self._starts, axis=-1))
            # units of each fold: rows lie fold by fold
            self._unit_bounds = np.searchsorted(self._starts, self._bounds)
            self._modes_along = self._modes_along_units()
            self._gram -= self._products(self._modes_along, self._modes_along)

    def _slices(self) -> list[slice]:
        return [slice(a, b) for a, b in zip(self._bounds[:-1], self._bounds[1:], strict=True)]

    def _add_gram(self, gram: np.ndarray, rows: slice) -> None:
        """Add (c, m, m) of one fold to ``gram``, by parts that stay in the cache; numpy forms half of a symmetric
        product."""
        x, root = self._design[rows], np.sqrt(self._weight[:, rows])
        for start in range(0, len(x), PART):
            part = x[start : start + PART]
            for c, roots in enumerate(root[:, start : start + PART]):
                weighed = part * roots[:, None]
                gram[c] += weighed.T @ weighed

    def _modes_along_units(self) -> np.ndarray:
        """(c, m, u) parts of the modes along each unit's pattern, scaled for the outer products."""
        ends = np.append(self._starts[1:], len(self._design))
        sums = [self._scaled[:, a:b] @ self._design[a:b] for a, b in zip(self._starts, ends, strict=True)]
        return np.ascontiguousarray(np.transpose(sums, (1, 2, 0))) / self._size[:, None]

    def _along(self, rows: np.ndarray) -> np.ndarray:
        """The same (c, k, u) of ``rows`` (k, n), or (k, c, n) of each channel's own."""
        rows = rows if rows.ndim == 3 else rows[:, None]
        if not len(rows):
            return np.empty((len(self._size), 0, self._size.shape[1]))
        return np.swapaxes(np.add.reduceat(self._scaled * rows, self._starts, axis=-1) / self._size, 0, 1)

    def _products(self, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        """(f, c, k, k') sums over the units of each fold of outer products."""
        return np.stack(
            [left[..., a:b] @ np.swapaxes(right[..., a:b], 1, 2) for a, b in pairwise(self._unit_bounds)]
        )

    def said(self, coefficients: np.ndarray) -> np.ndarray:
        """(n, c) sums of modes, rows of each fold with its own ``coefficients`` (f, c, m)."""
        result = np.empty((len(self._design), coefficients.shape[1]))
        for rows, own in zip(self._slices(), coefficients, strict=True):
            result[self._rows[rows]] = self._design[rows] @ own.T
        return result

    @property
    def modes_gram(self) -> np.ndarray:
        """(f, c, m, m) sums of the modes alone."""
        return self._gram

    def statistics(self, target: np.ndarray, columns: np.ndarray) -> Statistics:
        """Sums for ``target`` (n, c) with lobe ``columns`` (n, q) beside the modes."""
        target, columns = _by_channel(target[self._rows]), _by_channel(columns[self._rows])
        m, q, channels = self._design.shape[1], len(columns), len(target)
        across, lobes_gram, moment, square = [], [], [], []
        for rows in self._slices():
            w, y, lobe = self._weight[:, rows], target[:, rows], columns[:, rows]
            weighed = np.empty((q + 1, channels, y.shape[1]))  # lobes, and the target: one product for all
            np.multiply(lobe[:, None], w, out=weighed[:q])
            np.multiply(w, y, out=weighed[q])
            square.append(np.sum(weighed[q] * y, axis=-1))
            flat = weighed.reshape((q + 1) * channels, -1)
            sums = np.concatenate([flat @ self._design[rows], flat @ lobe.T], axis=-1)
            sums = sums.reshape(q + 1, channels, m + q)
            across.append(np.transpose(sums[:q, :, :m], (1, 2, 0)))
            lobes_gram.append(np.transpose(sums[:q, :, m:], (1, 2, 0)))
            moment.append(sums[q])
        parts = (np.stack(across), np.stack(lobes_gram), np.stack(moment), np.stack(square))
        if self._common:
            self._take_away_shared(target, columns, *parts)
        return Statistics(self._gram, *parts, np.diff(self._bounds))

    def own_products(self, rows: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sums over all cells of ``rows`` (k, n, c), which are each channel's own, with the modes and lobe ``columns``
        (n, q), (c, m + q, k), and with one another, (c, k, k)."""
        rows = np.ascontiguousarray(np.transpose(rows[:, self._rows], (0, 2, 1)))
        weighed, columns = rows * self._weight, _by_channel(columns[self._rows])
        flat = weighed.reshape(-1, weighed.shape[-1])
        across = np.concatenate([flat @ self._design, flat @ columns.T], axis=-1)
        across = np.transpose(across.reshape(*rows.shape[:2], -1), (1, 2, 0))
        own = np.swapaxes(weighed, 0, 1) @ np.transpose(rows, (1, 2, 0))
        if self._common:
            along = self._along(rows)
            every = np.concatenate([self._modes_along, self._along(columns)], axis=1)
            across = across - every @ np.swapaxes(along, 1, 2)
            own -= along @ np.swapaxes(along, 1, 2)
        return across, own

    def _take_away_shared(self, target, columns, across, lobes_gram, moment, square) -> None:
        lobes, values = self._along(columns), self._along(target[None])
        across -= self._products(self._modes_along, lobes)
        lobes_gram -= self._products(lobes, lobes)
        every = np.concatenate([self._modes_along, lobes], axis=1)
        moment -= self._products(every, values)[..., 0]
        square -= self._products(values, values)[..., 0, 0]


def _by_channel(rows: np.ndarray) -> np.ndarray:
    """(k, n) of ``rows`` (n, k): long inner loops."""
    return np.ascontiguousarray(rows.T)
