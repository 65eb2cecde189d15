"""Measured rows as a Gaussian process whose mean may be a lobe: an average of many such, by evidence and left-out rows.

Each candidate is a smooth ridge (:mod:`reconstruct.rows.smooth_ridge`) beside a free constant and the columns of at
most one lobe of a fixed shape: the lobe is a mean from which the data may leave. All is linear, and one
eigendecomposition of the modes' Gram matrix serves every strength of the prior and every lobe, so that the evidence
(restricted, Harville 1977) of some sixty candidates costs milliseconds. No single one is believed: half of what lobes
have of the weight goes by evidence (Bayesian model averaging), half by stacking of what each says of neighbourhoods
left out (Wolpert 1992; Yao et al. 2018). How much they have of it, the left-out neighbourhoods say as well: what of the
ridge's squares they save there beyond chance. The rest is the ridge's, of the strength that predicts best, which knows
of no lobe and so makes none up where nothing was measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.optimize import nnls

from photogonio.reconstruct.estimate.model import LobeSet, Model
from photogonio.reconstruct.estimate.model_selection import Prior
from photogonio.reconstruct.estimate.weights import level
from photogonio.reconstruct.lobes.families import retro_lobe, second_lobe
from photogonio.reconstruct.rows.noise_told import FreshReading, fresh_reading, noise_told
from photogonio.reconstruct.rows.row_evidence import RowEvidence, Solved
from photogonio.reconstruct.rows.unseen import SAYS
from photogonio.reconstruct.table.cells import Cells

ROUGHNESS = (0.07, 0.1, 0.15, 0.2, 0.28, 0.38, 0.5, 0.7, 1.0)
HOPELESS = 12.0  # of the logarithm of the evidence behind the best: not tried on left-out rows
MOST = 12  # tried on left-out rows, beside none
LEAST = 0.02  # a smaller weight is dropped
MOST_RICH = 0.7  # of the weight, that others than the ridge may have
SEEN = 0.25  # of a retro-reflective peak's height, that a row must be at: the foot of a narrow one says nothing of it
CHANCE = 0.5  # standard errors, of the squares that they save, which do not count


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
    error: np.ndarray  # (n, c) one standard error of it, 1/sr
    leverage: np.ndarray  # (n,) each row's share in what all rows say of it
    fold: np.ndarray  # (n,)
    said: np.ndarray  # (n, c) by all rows, 1/sr
    fresh: FreshReading

    @property
    def name(self) -> str:
        told = [f"{one.lobes.name} {100 * one.weight:.0f} %" for one in self.members]
        return " + ".join(told)


def average_of(
    cells: Cells,
    deviation: np.ndarray,
    order: int,
    lobes: Sequence[LobeSet] | None = None,
    least: float = 0.0,
) -> Average:
    """Of measured rows whose errors are ``deviation`` (n, c) up to a factor, on isotropic modes up to ``order``;
    ``lobes`` are those to try beside none, None for a grid of shapes. They have a share of ``least``, whatever
    neighbourhoods left out say."""
    return Weighed.of(cells, deviation, order, lobes, least).average()


@dataclass(frozen=True, slots=True)
class Weighed:
    """Candidates of an average with their weights: what it says of rows left out, before all rows are fitted by it."""

    cells: Cells
    rows: RowEvidence
    tried: np.ndarray  # (k,) candidates that have a weight
    ratio: np.ndarray  # (k,) of their priors
    likely: np.ndarray  # (k,) of priors that are likeliest
    evidence: np.ndarray  # (k,)
    weight: np.ndarray  # (k,)
    each: tuple[np.ndarray, ...]  # (n, c) what each says of rows left out, in units of the level

    @classmethod
    def of(
        cls,
        cells: Cells,
        deviation: np.ndarray,
        order: int,
        lobes: Sequence[LobeSet] | None = None,
        least: float = 0.0,
    ) -> Weighed:
        """As :func:`average_of`."""
        lobes = [one for one in (grid() if lobes is None else lobes) if _seen(one, cells)]
        rows = RowEvidence.of(cells, deviation, order, (LobeSet(), *lobes), SAYS)
        evidence, ratio = rows.evidence()
        good = np.argsort(-evidence, kind="stable")[:MOST]
        likeliest = evidence[1:].max(initial=-np.inf) if least else evidence.max()
        tried = np.union1d(good[evidence[good] >= likeliest - HOPELESS], [0])
        ridge, predicted = rows.ridge()
        tried, ratio, likely = (
            np.append(0, tried),
            np.append(ridge, ratio[tried]),
            np.append(ratio[0], ratio[tried]),
        )
        left_out = [predicted, *(rows.left_out(*one) for one in zip(tried[1:], ratio[1:], strict=True))]
        missed = np.stack([(np.sqrt(rows.weight) * (rows.value - one)).ravel() for one in left_out])
        told = np.append(-np.inf, evidence[tried[1:]])
        if least and np.isfinite(likeliest):
            told[tried == 0] = -np.inf
        weight = _weights(told, missed, np.repeat(rows.fold, cells.value.shape[1]), least)
        kept = np.flatnonzero(weight > 0.0)
        each = tuple(left_out[k] for k in kept)
        tried, ratio, likely, weight = tried[kept], ratio[kept], likely[kept], weight[kept]
        return cls(cells, rows, tried, ratio, likely, evidence[tried], weight, each)

    @property
    def left_out(self) -> np.ndarray:
        """(n, c) rows by those of all other folds, 1/sr."""
        return sum(weight * one for weight, one in zip(self.weight, self.each, strict=True)) * level(
            self.cells
        )

    def average(self) -> Average:
        """By all rows."""
        rows, size, said = self.rows, level(self.cells), self.left_out
        members = tuple(
            Member(
                rows.trials[trial].lobes,
                rows.prior(ratio),
                float(evidence),
                float(weight),
                one * size,
            )
            for trial, ratio, evidence, weight, one in zip(
                self.tried, self.ratio, self.evidence, self.weight, self.each, strict=True
            )
        )
        solved = [rows.solved(*one) for one in zip(self.tried, self.ratio, self.likely, strict=True)]
        model, covariance = _mixed(rows, self.tried, members, solved, size)
        error, leverage = np.zeros_like(said), np.zeros(len(said))
        spreads = {ratio: rows.spread(ratio) for ratio in set(self.likely)}
        for likely, one, part in zip(self.likely, members, solved, strict=True):
            spread, share = spreads[likely]
            error += one.weight * (spread[:, None] * part.variance * size**2 + (one.left_out - said) ** 2)
            leverage += one.weight * share
        return _told(self.cells, model, covariance, members, (said, np.sqrt(error), leverage, rows.fold))


def between(cells: Cells, one: Average, other: Average, share: float) -> Average:
    """The mean of two averages of ``cells`` with the same modes, the first having ``share`` of the weight."""
    m, parts = len(one.model.coefficients), ((one, share), (other, 1.0 - share))
    counts = [len(each.model.lobe_coefficients) for each, _ in parts]
    starts, channels = m + np.cumsum([0, *counts]), one.said.shape[1]
    means, spread = [], np.zeros((channels, starts[-1], starts[-1]))
    for k, (each, weight) in enumerate(parts):
        place = np.r_[:m, starts[k] : starts[k + 1]]
        own = np.zeros((starts[-1], channels))
        own[place] = np.concatenate([each.model.coefficients, each.model.lobe_coefficients])
        means.append(own)
        for c, own in enumerate(each.covariance):
            spread[c][np.ix_(place, place)] += weight * own
    apart = means[0] - means[1]  # the law of total variance
    for c, own in enumerate(apart.T):
        spread[c] += share * (1.0 - share) * np.outer(own, own)
    mean = share * means[0] + (1.0 - share) * means[1]
    lobes = LobeSet(
        (*one.model.lobes.families, *other.model.lobes.families),
        (*one.model.lobes.shapes, *other.model.lobes.shapes),
    )
    left_out, square, leverage = (
        share * a + (1.0 - share) * b
        for a, b in (
            (one.left_out, other.left_out),
            (one.error**2, other.error**2),
            (one.leverage, other.leverage),
        )
    )
    square = square + share * (1.0 - share) * (one.left_out - other.left_out) ** 2
    members = tuple(
        replace(member, weight=weight * member.weight) for each, weight in parts for member in each.members
    )
    model = Model(one.model.basis, mean[:m], lobes, mean[m:])
    return _told(cells, model, spread, members, (left_out, np.sqrt(square), leverage, one.fold))


def _told(
    cells: Cells,
    model: Model,
    covariance: np.ndarray,
    members: tuple[Member, ...],
    out: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
) -> Average:
    """With what fresh readings may be, told by rows left ``out``: what is said of them, its errors, leverage, folds."""
    left_out, error, leverage, _ = out
    now = model.evaluate(cells)
    fresh = fresh_reading(cells, noise_told(cells, now, leverage), left_out, error)
    return Average(model, covariance, members, *out, now, fresh)


@lru_cache(maxsize=1)
def grid() -> tuple[LobeSet, ...]:
    """Lobes of fixed shapes that an average may have."""
    mirror = second_lobe(absolute=False)
    kinds = (mirror, mirror.with_beckmann, retro_lobe(absolute=False))
    return tuple(LobeSet((kind,), (np.array([one]),)) for kind in kinds for one in ROUGHNESS)


def _seen(lobes: LobeSet, cells: Cells) -> bool:
    """Whether rows show the top of a retro-reflective lobe; where light and camera never stand close together a wide
    peak looks as the foot of a narrow one, whose light would be made up."""
    if not any(family.retro for family in lobes.families):
        return True
    lamp = Cells.of_angles(cells.theta_i, cells.theta_i, np.zeros(len(cells)))
    there, top = (lobes.columns(one)[1] for one in (cells, lamp))
    return bool((there / np.maximum(top, np.finfo(float).tiny)).max(0).min() >= SEEN)


def _weights(evidence: np.ndarray, missed: np.ndarray, fold: np.ndarray, least: float = 0.0) -> np.ndarray:
    """(k,) of candidates with logarithms of ``evidence`` (k,) and residuals ``missed`` (k, n) of rows left out, that
    are in ``fold`` (n,); the first is the ridge. Small ones are dropped. Where all others together would have less
    than ``least``, they have that, by evidence alone."""
    believed = np.exp(evidence - evidence.max())
    rich = 0.5 * (believed / believed.sum() + _stacked(missed))
    squares = [np.bincount(fold, one**2) for one in (missed[0], rich @ missed)]
    saved = squares[0] - squares[1]
    sure = saved.sum() - CHANCE * np.sqrt(len(saved)) * saved.std(ddof=1) if len(saved) > 1 else 0.0
    share = np.sqrt(max(sure, 0.0) / max(squares[0].sum(), np.finfo(float).tiny))
    if share < least:
        share, rich = least, believed / believed.sum()
    weight = min(share, MOST_RICH) * rich
    weight[0] += 1.0 - weight.sum()
    kept = weight >= LEAST
    kept[1 + np.argmax(rich[1:])] |= least > 0.0
    weight[~kept] = 0.0
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


def _mixed(
    rows: RowEvidence,
    tried: np.ndarray,
    members: Sequence[Member],
    solved: Sequence[Solved],
    size: np.ndarray,
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
        for each, variance in zip(spread, part.variance * size**2, strict=True):
            each[np.ix_(place, place)] += member.weight * variance * covariance
    weight = np.array([one.weight for one in members])
    mean = np.einsum("k,kpc->pc", weight, own)
    apart = np.sqrt(weight)[:, None, None] * (np.array(own) - mean)
    for c, each in enumerate(spread):  # a channel at a time: hundreds of unknowns squared are not held twice
        each += apart[:, :, c].T @ apart[:, :, c]
    families = tuple(family for one in members for family in one.lobes.families)
    shapes = tuple(shape for one in members for shape in one.lobes.shapes)
    return Model(rows.basis, mean[:m], LobeSet(families, shapes), mean[m:]), spread
