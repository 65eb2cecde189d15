"""Evidence of smooth models with a lobe each, on measured rows, and what they say of rows left out.

All is linear, and one eigendecomposition of the modes' Gram matrix serves every strength of the prior and every lobe,
so that the (restricted) evidence of some thirty candidates costs milliseconds (Harville 1977).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from photogonio.reconstruct.estimate.folded_design import FoldedDesign
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.model_selection import Prior, folds_of
from photogonio.reconstruct.estimate.normal_equations import Factors, Statistics, solve
from photogonio.reconstruct.estimate.weights import level
from photogonio.reconstruct.rows.smooth_ridge import DECAY
from photogonio.reconstruct.rows.unseen import steadiness, steepest
from photogonio.reconstruct.table.cells import Cells

NOISE = 10.0 ** np.arange(-6.0, 2.6, 0.25)  # variance of a row's noise over that of the modes at degree 1
TINY = 1e-9  # of a diagonal: what nothing tells stays solvable
PART = 512  # rows worked on at once
RIDGES = NOISE[:28:4]  # that the ridge's is chosen among, by rows left out


class LobeTrial(NamedTuple):
    """A candidate: a set of lobes of which some columns are used."""

    lobes: LobeSet
    used: tuple[int, ...]  # of its columns


def _trials(lobes: Sequence[LobeSet]) -> list[LobeTrial]:
    """Each set with all columns, and with each alone: none may be negative."""
    found = []
    for one in lobes:
        count = len(one.upper_bounds())
        found.append(LobeTrial(one, tuple(range(count))))
        found += [LobeTrial(one, (k,)) for k in range(count) if count > 1]
    return found


class Solved(NamedTuple):
    """A member on all rows, in units of the level."""

    modes: np.ndarray  # (m, c)
    lobes: np.ndarray  # (q, c)
    covariance: np.ndarray  # (m + q, m + q) over the noise's variance
    variance: np.ndarray  # (c,) of the noise


@dataclass(frozen=True, slots=True)
class RowEvidence:
    """What all candidates share; values in units of the level, weights of all channels alike."""

    value: np.ndarray  # (n, c)
    design: np.ndarray  # (n, m)
    weight: np.ndarray  # (n, 1)
    degree: np.ndarray  # (m,)
    basis: Basis
    fold: np.ndarray  # (n,)
    trials: tuple[LobeTrial, ...]
    columns: tuple[np.ndarray, ...]  # (n, q) each, of greatest value 1
    size: tuple[np.ndarray, ...]  # (q,) by which they were divided
    folded: FoldedDesign
    others: np.ndarray  # (f, 1, m, m) sums of the modes over all other folds, with ``beyond``
    factors: dict[float, Factors]  # of those, by ratio
    beyond: np.ndarray | float = 0.0  # (m, m) a penalty on what modes do where there are no rows

    @classmethod
    def of(
        cls, cells: Cells, deviation: np.ndarray, order: int, lobes: Sequence[LobeSet], says: float = 0.0
    ) -> RowEvidence:
        """``says`` is how much it counts, beside all rows, that modes stay beyond them as they are there."""
        basis, fold = Basis("isotropic", order), folds_of(cells)
        design, size = basis.design(cells), level(cells)
        weight = ((size / deviation) ** 2).mean(1, keepdims=True)
        weight = weight / np.median(weight)
        whole_columns = {id(one): one.columns(cells)[1] for one in lobes}
        trials = tuple(_trials(lobes))
        columns = [whole_columns[id(one.lobes)][:, list(one.used)] for one in trials]
        greatest = [np.maximum(np.abs(one).max(0), np.finfo(float).tiny) for one in columns]
        columns = [one / by for one, by in zip(columns, greatest, strict=True)]
        folded = FoldedDesign(design, weight, fold)
        beyond = says * float(weight.sum()) * steadiness(order, steepest(cells)) if says else 0.0
        others = folded.modes_gram.sum(0) - folded.modes_gram
        others += beyond
        return cls(
            cells.value / size,
            design,
            weight,
            basis.degree(),
            basis,
            fold,
            trials,
            tuple(columns),
            tuple(greatest),
            folded,
            others,
            {},
            beyond,
        )

    def prior(self, ratio: float) -> Prior:
        """That of a noise of variance 1 in units of the level, ``ratio`` times that of the modes at degree 1."""
        return Prior(float(ratio**-0.5), DECAY)

    def evidence(self, least: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """(k,) the logarithm of each candidate's evidence, and the ratio of :data:`NOISE` that it is greatest at.

        Beside the noise found there is one of ``least``, of the level: what models miss by less tells nothing."""
        root, scale = np.sqrt(self.weight), self.degree[1:] ** -DECAY
        energy, turn = np.linalg.eigh(self.folded.modes_gram.sum((0, 1))[1:, 1:] * np.outer(scale, scale))
        energy, turn = np.maximum(energy, 0.0), scale[:, None] * turn
        # with C = S S' + ratio I, x' C^-1 y = (x' y - sum_i along_xi along_yi / (energy_i + ratio)) / ratio
        share = 1.0 / (energy + NOISE[:, None])
        n, channels = self.value.shape
        size = np.log(energy + NOISE[:, None]).sum(1) + (n - len(energy)) * np.log(NOISE)
        shared, found = np.hstack([self.value, self.design[:, :1]]), np.empty((len(self.columns), len(NOISE)))

        def along_modes(columns: np.ndarray) -> np.ndarray:
            return turn.T @ (self.design[:, 1:].T @ (self.weight * columns))

        counts = np.array([one.shape[1] for one in self.columns])
        along_shared = along_modes(shared)
        squares = np.sum(self.weight * self.value**2, axis=0)
        lost = share @ along_shared[:, :channels] ** 2
        for count in np.unique(counts):
            these = np.flatnonzero(counts == count)
            flat = np.hstack([self.columns[k] for k in these])
            own = np.moveaxis(flat.reshape(n, len(these), count), 1, 0)
            along_own = np.moveaxis(along_modes(flat).reshape(len(turn), len(these), count), 1, 0)
            along = np.concatenate(
                [np.broadcast_to(along_shared, (len(these), *along_shared.shape)), along_own], axis=2
            )
            constant = np.broadcast_to(shared[:, channels:], (len(these), n, 1))
            free = root * np.concatenate([constant, own], axis=2)
            turned = np.swapaxes(free, 1, 2)
            gram = np.concatenate([turned @ (root * self.value), turned @ free], axis=2)
            across = gram - _products(along[..., channels:], along, share)
            found[these] = _restricted(
                (squares - lost) / NOISE[:, None], across / NOISE[:, None, None, None], n, size, least
            ).T
        best = found.argmax(1)
        return found[np.arange(len(found)), best], NOISE[best]

    def left_out(self, k: int, ratio: float) -> np.ndarray:
        """(n, c) what candidate ``k`` says of each row by those of all other folds."""
        return self._by_others(self._without_each(k), k, ratio)

    def _without_each(self, k: int) -> Statistics:
        """Sums over all other folds, of the modes with what is said of them beyond the rows."""
        sums = self.folded.statistics(self.value, self.columns[k])
        parts = (getattr(sums, each.name) for each in fields(sums)[1:])
        return Statistics(self.others, *(part.sum(0) - part for part in parts))

    def _by_others(self, rest: Statistics, k: int, ratio: float) -> np.ndarray:
        if ratio not in self.factors:
            self.factors[ratio] = self._factors(self.others, ratio)
        return self._said_by_others(rest, k, self.factors[ratio])

    def _said_by_others(self, rest: Statistics, k: int, factors: Factors) -> np.ndarray:
        modes, lobes = self._solve(rest, k, factors)
        return self.folded.said(modes) + np.einsum("nq,ncq->nc", self.columns[k], lobes[self.fold])

    def solved(self, k: int, ratio: float, likely: float) -> Solved:
        """Candidate ``k`` by all rows, with a prior of ``ratio``, and how sure it is with one of the ``likely`` ratio:
        what predicts best may be next to no prior, which says nothing of what was not measured."""
        sums = self.folded.statistics(self.value, self.columns[k]).total()
        every = sums.modes_gram + self.beyond
        own, other = (self._solve(sums, k, self._factors(every, one)) for one in (ratio, likely))
        across, m = sums.across[0, 0], len(self.degree)
        gram = np.block([[sums.modes_gram[0, 0], across], [across.T, sums.lobes_gram[0, 0]]])
        gram[np.arange(m), np.arange(m)] += self.prior(likely).precision(self.degree, np.ones(1))[0]
        scale = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
        covariance = np.linalg.pinv(gram / np.outer(scale, scale), rcond=1e-12, hermitian=True)
        covariance = covariance / np.outer(scale, scale)
        modes, lobes = other
        missed = self.value - self.design @ modes[0].T - self.columns[k] @ lobes[0].T
        lost = np.sum(covariance[:m, :m] * sums.modes_gram[0, 0])  # effective number of modes
        freedom = max(len(self.value) - lost, 1.0)
        variance = np.sum(self.weight * missed**2, axis=0) / freedom
        modes, lobes = own
        return Solved(modes[0].T, lobes[0].T, covariance, variance)

    def each_by_others(self, k: int, ratio: float) -> np.ndarray:
        """(n,) the logarithm of the density that candidate ``k`` by all other rows has where each row is, of all
        channels together; the size of their noise is that of what all rows are missed by so."""
        own = self.solved(k, ratio, ratio)
        every = np.hstack([self.design, self.columns[k]])
        leverage = self.weight * np.einsum("np,pq,nq->n", every, own.covariance, every)[:, None]
        free = np.maximum(1.0 - leverage, TINY)
        said = every @ np.vstack([own.modes, own.lobes])
        missed = (self.value - said) / free  # as if fitted without the row
        squares = self.weight * free * missed**2
        size = np.maximum(squares.mean(0), np.finfo(float).tiny)
        return np.sum(-0.5 * (np.log(size / free) + squares / size), axis=1)

    def ridge(self) -> tuple[float, np.ndarray]:
        """The ratio with which the ridge alone predicts rows left out best, and what (n, c) it says of them."""
        rest = self._without_each(0)
        # factors that no candidate asks for again are not kept: they fill a memory
        tried = [
            (ratio, self._said_by_others(rest, 0, self._factors(self.others, ratio)))
            for ratio in RIDGES.tolist()
        ]
        return min(tried, key=lambda one: float(np.sum(self.weight * (self.value - one[1]) ** 2)))

    def spread(self, ratio: float) -> tuple[np.ndarray, np.ndarray]:
        """(n,) variance, over the noise's, of what the ridge says of each row by those of all other folds; and each
        row's share in what it says of it by all rows."""
        penalty = np.diag(self.prior(ratio).precision(self.degree, np.ones(1))[0])
        own = self.folded.modes_gram[:, 0]
        total, left_out = own.sum(0) + penalty, np.empty(len(self.value))
        for f, part in enumerate(own):
            left_out[self.fold == f] = _quadratic(self.design[self.fold == f], total - part)
        return left_out, self.weight[:, 0] * _quadratic(self.design, total)

    def _factors(self, gram: np.ndarray, ratio: float) -> Factors:
        return Factors(gram, self.prior(ratio).precision(self.degree, np.ones(1)))

    def _solve(self, sums: Statistics, k: int, factors: Factors) -> tuple[np.ndarray, np.ndarray]:
        upper = np.full(self.columns[k].shape[1], np.inf)
        solution = solve(sums, factors, upper)
        modes, lobes = np.split(solution, [len(self.degree)], axis=-1)
        return modes, lobes


def _quadratic(rows: np.ndarray, gram: np.ndarray) -> np.ndarray:
    """(k,) x' gram^-1 x of rows x (k, m)."""
    scale = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    factor = np.linalg.cholesky(gram / np.outer(scale, scale) + TINY * np.eye(len(gram)))
    result = np.empty(len(rows))
    for start in range(0, len(rows), PART):  # of which arrays stay in the cache
        part = (rows[start : start + PART] / scale).T
        part = solve_triangular(factor, part, lower=True, overwrite_b=True, check_finite=False)
        with np.errstate(over="ignore"):  # of what the other rows do not tell at all: infinite
            result[start : start + PART] = np.sum(np.square(part, out=part), axis=0)
    return result


def _products(one: np.ndarray, other: np.ndarray, share: np.ndarray) -> np.ndarray:
    """(r, k, x, y) sums over i of products of ``one`` (k, i, x) and ``other`` (k, i, y), times ``share`` (r, i)."""
    (k, i, x), y = one.shape, other.shape[2]
    products = np.moveaxis(one[:, :, :, None] * other[:, :, None, :], 1, 0)
    return (share @ products.reshape(i, -1)).reshape(-1, k, x, y)


def _restricted(
    squares: np.ndarray, across: np.ndarray, n: int, size: np.ndarray, least: float = 0.0
) -> np.ndarray:
    """(r, k) restricted log likelihood of all channels, their noise profiled out, for each ratio and candidate.

    Products by the inverse covariance are ``squares`` (r, c), of the channels' values, and ``across`` (r, k, x, c + x),
    of the constant and the columns with all values and with one another. ``size`` (r,) is the logarithm of the
    covariance's determinant, ``least`` a noise beside the one found.
    """
    channels = squares.shape[1]
    a = across[..., channels:]
    scale = np.sqrt(np.maximum(np.diagonal(a, axis1=2, axis2=3), np.finfo(float).tiny))
    a = a / (scale[..., :, None] * scale[..., None, :]) + TINY * np.eye(a.shape[-1])
    b = across[..., :channels] / scale[..., None]
    coefficients = np.linalg.solve(a, b)
    rest = squares[:, None] - np.sum(b * coefficients, axis=2)
    freedom = n - a.shape[-1]
    rest = np.maximum(rest, np.finfo(float).tiny) + freedom * least**2
    determinant = np.linalg.slogdet(a)[1] + 2.0 * np.log(scale).sum(2)
    told = -0.5 * freedom * np.log(rest / freedom).sum(2)
    told -= 0.5 * channels * (size[:, None] + determinant)
    # a lobe that would have to take light away is none
    negative = (coefficients[..., 1:, :] / scale[..., 1:, None]).sum(3) < 0.0
    return np.where(negative.any(2), -np.inf, told)
