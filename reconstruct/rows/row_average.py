"""Measured rows as a Gaussian process whose mean may be a lobe: an average of many such, by evidence and left-out rows.

Each candidate is a smooth ridge (:mod:`reconstruct.rows.smooth_ridge`) beside a free constant and the columns of at
most one lobe of a fixed shape: the lobe is a mean from which the data may leave. All is linear, and one
eigendecomposition of the modes' Gram matrix serves every strength of the prior and every lobe, so that the evidence
(restricted, Harville 1977) of some thirty candidates costs milliseconds. No single one is believed: half of what lobes
have of the weight goes by evidence (Bayesian model averaging), half by stacking of what each says of neighbourhoods
left out (Wolpert 1992; Yao et al. 2018). How much they have of it, the left-out neighbourhoods say as well: what of the
ridge's squares they save there beyond chance. The rest is the ridge's, of the strength that predicts best, which knows
of no lobe and so makes none up where nothing was measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

from photogonio.reconstruct.estimate.folded_design import FoldedDesign
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.model_selection import Prior, folds_of
from photogonio.reconstruct.estimate.normal_equations import Factors, Statistics, solve
from photogonio.reconstruct.estimate.weights import level
from photogonio.reconstruct.lobes.families import retro_lobe, second_lobe
from photogonio.reconstruct.rows.smooth_ridge import DECAY
from photogonio.reconstruct.table.cells import Cells

ROUGHNESS = (0.07, 0.1, 0.15, 0.2, 0.28, 0.38, 0.5, 0.7, 1.0)
NOISE = 10.0 ** np.arange(-6.0, 2.6, 0.25)  # variance of a row's noise over that of the modes at degree 1
HOPELESS = 12.0  # of the logarithm of the evidence behind the best: not tried on left-out rows
MOST = 12  # tried on left-out rows, beside none
LEAST = 0.02  # a smaller weight is dropped
MOST_RICH = 0.7  # of the weight, that others than the ridge may have
CHANCE = 0.5  # standard errors, of the squares that they save, which do not count
RIDGES = NOISE[:28:4]  # that the ridge's is chosen among, by rows left out


@dataclass(frozen=True, slots=True)
class Member:
    """One model of the average."""

    lobes: LobeSet
    prior: Prior
    evidence: float  # logarithm, but for a constant
    weight: float
    left_out: np.ndarray  # (n, c) rows by those of all other folds, 1/sr


@dataclass(frozen=True, slots=True)
class Average:
    """A weighted mean of models, which is a model again: of modes and of all their lobes."""

    model: Model
    covariance: np.ndarray  # (c, p, p) of modes and lobe coefficients, between the members and of each
    members: tuple[Member, ...]
    left_out: np.ndarray  # (n, c) 1/sr
    fold: np.ndarray  # (n,)
    noise: np.ndarray  # (c,) standard deviation of a row, over its stated one

    @property
    def name(self) -> str:
        told = [f"{one.lobes.name} {100 * one.weight:.0f} %" for one in self.members]
        return " + ".join(told)


def average_of(
    cells: Cells, deviation: np.ndarray, order: int, lobes: Sequence[LobeSet] | None = None
) -> Average:
    """Of measured rows whose errors are ``deviation`` (n, c) up to a factor, on isotropic modes up to ``order``;
    ``lobes`` are those to try beside none, None for a grid of shapes."""
    lobes = _grid() if lobes is None else lobes
    rows = _Rows.of(cells, deviation, order, (LobeSet(), *lobes))
    evidence, ratio = rows.evidence()
    good = np.argsort(-evidence, kind="stable")[:MOST]
    tried = np.union1d(good[evidence[good] >= evidence.max() - HOPELESS], [0])
    ridge, predicted = rows.ridge()
    tried, ratio = np.append(0, tried), np.append(ridge, ratio[tried])
    left_out = [predicted, *(rows.left_out(*one) for one in zip(tried[1:], ratio[1:], strict=True))]
    missed = np.stack([(np.sqrt(rows.weight) * (rows.value - one)).ravel() for one in left_out])
    told = np.append(-np.inf, evidence[tried[1:]])
    weight = _weights(told, missed, np.repeat(rows.fold, cells.value.shape[1]))
    kept = np.flatnonzero(weight > 0.0)
    size = level(cells)
    members = tuple(
        Member(
            rows.trials[tried[k]].lobes,
            rows.prior(ratio[k]),
            float(evidence[tried[k]]),
            float(weight[k]),
            left_out[k] * size,
        )
        for k in kept
    )
    solved = [rows.solved(tried[k], ratio[k]) for k in kept]
    said = sum(weight[k] * left_out[k] for k in kept) * size
    model, covariance = _mixed(rows, tried[kept], members, solved, size)
    sigma = np.sqrt(sum(one.weight * part.variance for one, part in zip(members, solved, strict=True)))
    return Average(model, covariance, members, said, rows.fold, sigma)


def _grid() -> tuple[LobeSet, ...]:
    mirror = second_lobe(absolute=False)
    kinds = (mirror, mirror.with_beckmann, retro_lobe(absolute=False))
    return tuple(LobeSet((kind,), (np.array([one]),)) for kind in kinds for one in ROUGHNESS)


def _weights(evidence: np.ndarray, missed: np.ndarray, fold: np.ndarray) -> np.ndarray:
    """(k,) of candidates with logarithms of ``evidence`` (k,) and residuals ``missed`` (k, n) of rows left out, that
    are in ``fold`` (n,); the first is the ridge. Small ones are dropped."""
    believed = np.exp(evidence - evidence.max())
    rich = 0.5 * (believed / believed.sum() + _stacked(missed))
    squares = [np.bincount(fold, one**2) for one in (missed[0], rich @ missed)]
    saved = squares[0] - squares[1]
    sure = saved.sum() - CHANCE * np.sqrt(len(saved)) * saved.std(ddof=1) if len(saved) > 1 else 0.0
    share = np.sqrt(max(sure, 0.0) / max(squares[0].sum(), np.finfo(float).tiny))
    weight = min(share, MOST_RICH) * rich
    weight[0] += 1.0 - weight.sum()
    weight[weight < LEAST] = 0.0
    return weight / weight.sum()


def _stacked(missed: np.ndarray) -> np.ndarray:
    """(k,) weights, none negative and of sum 1, of the mean whose residuals have the least squares."""
    gram = missed @ missed.T
    size = np.trace(gram) / len(gram)
    energy, turn = np.linalg.eigh(gram / max(size, np.finfo(float).tiny))
    root = (
        np.sqrt(np.maximum(energy, 0.0))[:, None] * turn.T
    )  # as many equations as candidates, of the same squares
    large = 1e3
    found, _ = nnls(np.vstack([root, np.full(len(root), large)]), np.append(np.zeros(len(root)), large))
    return found / found.sum()


class _Trial(NamedTuple):
    """A candidate: a set of lobes of which some columns are used."""

    lobes: LobeSet
    used: tuple[int, ...]  # of its columns


def _trials(lobes: Sequence[LobeSet]) -> list[_Trial]:
    """Each set with all columns, and with each alone: none may be negative."""
    found = []
    for one in lobes:
        count = len(one.upper_bounds())
        found.append(_Trial(one, tuple(range(count))))
        found += [_Trial(one, (k,)) for k in range(count) if count > 1]
    return found


class _Solved(NamedTuple):
    """A member on all rows, in units of the level."""

    modes: np.ndarray  # (m, c)
    lobes: np.ndarray  # (q, c)
    covariance: np.ndarray  # (m + q, m + q) over the noise's variance
    variance: np.ndarray  # (c,) of the noise


@dataclass(frozen=True, slots=True)
class _Rows:
    """What all candidates share; values in units of the level, weights of all channels alike."""

    value: np.ndarray  # (n, c)
    design: np.ndarray  # (n, m)
    weight: np.ndarray  # (n, 1)
    degree: np.ndarray  # (m,)
    basis: Basis
    fold: np.ndarray  # (n,)
    trials: tuple[_Trial, ...]
    columns: tuple[np.ndarray, ...]  # (n, q) each, of greatest value 1
    size: tuple[np.ndarray, ...]  # (q,) by which they were divided
    folded: FoldedDesign
    whole: FoldedDesign
    factors: dict[float, Factors]  # of the folds' complements, by ratio

    @classmethod
    def of(cls, cells: Cells, deviation: np.ndarray, order: int, lobes: tuple[LobeSet, ...]) -> _Rows:
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
        whole = FoldedDesign(design, weight, np.zeros(len(cells), int))
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
            whole,
            {},
        )

    def prior(self, ratio: float) -> Prior:
        """That of a noise of variance 1 in units of the level, ``ratio`` times that of the modes at degree 1."""
        return Prior(float(ratio**-0.5), DECAY)

    def evidence(self) -> tuple[np.ndarray, np.ndarray]:
        """(k,) the logarithm of each candidate's evidence, and the ratio of :data:`NOISE` that it is greatest at."""
        root = np.sqrt(self.weight)
        smooth = root * self.design[:, 1:] * self.degree[1:] ** -DECAY
        energy, turn = np.linalg.eigh(smooth.T @ smooth)
        energy = np.maximum(energy, 0.0)
        place = np.cumsum([0, self.value.shape[1], 1, *(one.shape[1] for one in self.columns)])
        every = root * np.hstack([self.value, self.design[:, :1], *self.columns])
        along = turn.T @ (smooth.T @ every)
        gram = every.T @ every
        # with C = S S' + ratio I, x' C^-1 y = (x' y - sum_i along_xi along_yi / (energy_i + ratio)) / ratio
        share = 1.0 / (energy + NOISE[:, None])
        inverse = (gram - np.einsum("ix,ri,iy->rxy", along, share, along, optimize=True)) / NOISE[
            :, None, None
        ]
        n, logs = len(self.value), np.log(energy + NOISE[:, None]).sum(1)
        size = logs + (n - len(energy)) * np.log(NOISE)
        y = slice(0, place[1])
        found = []
        for k in range(len(self.columns)):
            found.append(_restricted(inverse, y, np.r_[place[1], place[k + 2] : place[k + 3]], n, size))
        best = np.array([int(np.argmax(one)) for one in found])
        return np.array([one[b] for one, b in zip(found, best, strict=True)]), NOISE[best]

    def left_out(self, k: int, ratio: float) -> np.ndarray:
        """(n, c) what candidate ``k`` says of each row by those of all other folds."""
        rest = self.folded.statistics(self.value, self.columns[k]).without_each()
        if ratio not in self.factors:
            self.factors[ratio] = self._factors(rest, ratio)
        modes, lobes = self._solve(rest, k, self.factors[ratio])
        result = np.empty_like(self.value)
        for f, (own, lobe) in enumerate(zip(modes, lobes, strict=True)):
            here = self.fold == f
            result[here] = self.design[here] @ own.T + self.columns[k][here] @ lobe.T
        return result

    def solved(self, k: int, ratio: float) -> _Solved:
        """Candidate ``k`` by all rows."""
        sums = self.whole.statistics(self.value, self.columns[k])
        modes, lobes = self._solve(sums, k, self._factors(sums, ratio))
        across, m = sums.across[0, 0], len(self.degree)
        gram = np.block([[sums.modes_gram[0, 0], across], [across.T, sums.lobes_gram[0, 0]]])
        penalty = self.prior(ratio).precision(self.degree, np.ones(1))[0]
        gram[np.arange(m), np.arange(m)] += penalty
        scale = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
        covariance = np.linalg.pinv(gram / np.outer(scale, scale), rcond=1e-12, hermitian=True)
        missed = self.value - self.design @ modes[0].T - self.columns[k] @ lobes[0].T
        covariance = covariance / np.outer(scale, scale)
        lost = np.sum(covariance[:m, :m] * sums.modes_gram[0, 0])  # effective number of modes
        freedom = max(len(self.value) - lost, 1.0)
        variance = np.sum(self.weight * missed**2, axis=0) / freedom
        return _Solved(modes[0].T, lobes[0].T, covariance, variance)

    def ridge(self) -> tuple[float, np.ndarray]:
        """The ratio with which the ridge alone predicts rows left out best, and what (n, c) it says of them."""
        tried = [(ratio, self.left_out(0, ratio)) for ratio in RIDGES.tolist()]
        return min(tried, key=lambda one: float(np.sum(self.weight * (self.value - one[1]) ** 2)))

    def _factors(self, sums: Statistics, ratio: float) -> Factors:
        return Factors(sums.modes_gram, self.prior(ratio).precision(self.degree, np.ones(1)))

    def _solve(self, sums: Statistics, k: int, factors: Factors) -> tuple[np.ndarray, np.ndarray]:
        upper = np.full(self.columns[k].shape[1], np.inf)
        solution = solve(sums, factors, upper)
        modes, lobes = np.split(solution, [len(self.degree)], axis=-1)
        return modes, lobes


def _restricted(inverse: np.ndarray, y: slice, free: np.ndarray, n: int, size: np.ndarray) -> np.ndarray:
    """(r,) restricted log likelihood of all channels, their noise profiled out, for each ratio.

    ``inverse`` (r, x, x) holds products by the inverse covariance, ``free`` the places of the free columns, and
    ``size`` (r,) the logarithm of the covariance's determinant.
    """
    a = inverse[:, free][:, :, free]
    scale = np.sqrt(np.maximum(np.einsum("rxx->rx", a), np.finfo(float).tiny))
    a = a / (scale[:, :, None] * scale[:, None, :]) + 1e-9 * np.eye(len(free))
    b = inverse[:, free, y] / scale[:, :, None]
    coefficients = np.linalg.solve(a, b)
    rest = np.einsum("rcc->rc", inverse[:, y, y]) - np.sum(b * coefficients, axis=1)
    freedom, channels = n - len(free), b.shape[2]
    rest = np.maximum(rest, np.finfo(float).tiny)
    determinant = np.linalg.slogdet(a)[1] + 2.0 * np.log(scale).sum(1)
    told = -0.5 * freedom * np.log(rest / freedom).sum(1) - 0.5 * channels * (size + determinant)
    # a lobe that would have to take light away is none
    negative = (coefficients[:, 1:] / scale[:, 1:, None]).sum(2) < 0.0
    return np.where(negative.any(1), -np.inf, told)


def _mixed(
    rows: _Rows, tried: np.ndarray, members: Sequence[Member], solved: Sequence[_Solved], size: np.ndarray
) -> tuple[Model, np.ndarray]:
    """The weighted mean, 1/sr, and its covariance (c, p, p): of each member, and of what they differ by."""
    m, counts = len(rows.degree), [len(one.lobes.upper_bounds()) for one in members]
    starts = m + np.cumsum([0, *counts])
    own, spread = [], np.zeros((len(size), starts[-1], starts[-1]))
    for k, (trial, member, part) in enumerate(zip(tried, members, solved, strict=True)):
        place = np.r_[:m, starts[k] + np.array(rows.trials[trial].used, int)]
        unit = np.concatenate([np.ones(m), 1.0 / rows.size[trial]])
        whole = np.zeros((starts[-1], len(size)))
        whole[place] = np.concatenate([part.modes, part.lobes]) * unit[:, None] * size
        own.append(whole)
        covariance = part.covariance * np.outer(unit, unit)
        spread[np.ix_(range(len(size)), place, place)] += (
            member.weight * (part.variance * size**2)[:, None, None] * covariance
        )
    weight = np.array([one.weight for one in members])
    mean = np.einsum("k,kpc->pc", weight, own)
    apart = np.array(own) - mean
    spread += np.einsum("k,kpc,kqc->cpq", weight, apart, apart, optimize=True)
    families = tuple(family for one in members for family in one.lobes.families)
    shapes = tuple(shape for one in members for shape in one.lobes.shapes)
    return Model(rows.basis, mean[:m], LobeSet(families, shapes), mean[m:]), spread
