"""Covariance of a penalised fit's parameters: what its units of data, its prior and the choice of model leave open.

Parameters are, in each channel, mode and lobe coefficients, and shapes of lobes that all channels share. The part of
noise is what each unit of the data (a view, or a block of neighbouring directions) pulls, which counts whatever its
residuals share (Liang and Zeger 1986), and what its residuals lack since the parameters follow them, as the weights
have it: all of the noise of a direction that one unit alone tells, next to nothing where many do. The part of the
prior is the response to prior draws, so that the sum is the Bayesian posterior, whose intervals hold on average over
the directions (Nychka 1988). The part of model choice is the spread of the models that predict as well. Things that all
units share and the fit does not seek move the parameters as they would move the data.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from photogonio.reconstruct.estimate.folded_design import Common, FoldedDesign
from photogonio.reconstruct.estimate.normal_equations import Statistics, cholesky, cholesky_solve

RIDGE = 1e-10  # of the mean diagonal
RANK = 1e-15  # of the largest eigenvalue: below it rounding
# standard deviation of a shape's logarithm before the data: about that of even odds between its bounds
SHAPE_SPREAD = 1.0
MOST_ALTERNATIVES = 12  # whose own noise is found; of more, a systematic sample by weight stands for all


Normal = tuple[np.ndarray, np.ndarray]  # (p, p) and (p,): the two sides of a channel's normal equations


@dataclass(frozen=True, slots=True)
class Problem:
    """A linearised fit: n cells, c channels, m modes of the highest order, q lobe coefficients, s shared shapes.

    The model is design @ modes + columns @ lobe coefficients + slopes @ changes of the shapes, about ``center``.
    """

    design: np.ndarray  # (n, m)
    columns: np.ndarray  # (n, q) of the lobes
    slopes: np.ndarray  # (n, s, c) derivatives of f by the shared shapes
    target: np.ndarray  # (n, c) values less the lobes' fixed parts
    weight: np.ndarray  # (n, c) precision of each cell
    unit: np.ndarray  # (n,) integers 0 .. u - 1: which part of the data is left out with the cell
    common: Common | None
    center: (
        np.ndarray
    )  # (c, m + q + s) parameters of the chosen model: 0 for modes that it has not and for shapes
    fixed: np.ndarray  # (c, q) bool: lobe coefficients at a bound, which stay there
    # (n, k, c) what k independent things that no parameter stands for do to the cells, by one standard deviation each
    considered: np.ndarray | None = None


@dataclass(frozen=True, slots=True)
class Alternative:
    """A model that may be as good as the one chosen."""

    penalty: np.ndarray  # (c, k) of the squared coefficients of the first k modes, which are all that it has
    weight: float  # how much it is believed; those of all add up to 1


def covariance(problem: Problem, alternatives: Sequence[Alternative]) -> np.ndarray:
    """(c, p, p) of all parameters about those of the chosen model, p = m + q + s."""
    sums = [_sums(problem, c) for c in range(len(problem.center))]
    whole = [_normal(part.total()) for part in sums]
    every = list(zip(alternatives, _shares(alternatives), strict=True))
    found = [_solved(problem, one, whole) for one in alternatives]
    total = np.zeros((*problem.center.shape, problem.center.shape[1]))
    for (one, share), here in zip(every, found, strict=True):
        total += one.weight * _outer(here - problem.center[:, None])
        if share:
            inverse = _inverses(problem, one, whole)
            total += share * _noise(problem, one, sums, whole, here, inverse)
            total += share * _prior(problem, one, inverse)
            if problem.considered is not None:
                total += share * _outer(_followed(problem, one, whole))
    return total


def _followed(problem: Problem, one: Alternative, whole: list[Normal]) -> np.ndarray:
    """Changes (c, k, p) of the parameters where they follow what is considered: the fit does not seek it, so that no
    data make it surer (Schmidt 1966; Bierman 1977, of considered parameters)."""
    kept, first = _kept(problem, one), problem.center.shape[1]
    return _response(problem, one, whole, [gram[kept, first:] for gram, _ in whole])


def _shares(alternatives: Sequence[Alternative]) -> np.ndarray:
    """(k,) how much each alternative's noise counts for, adding up to 1: its weight, or, of many, its part in a sample
    taken at even steps of the summed weights."""
    weight = np.array([one.weight for one in alternatives])
    if len(weight) <= MOST_ALTERNATIVES:
        return weight
    steps = (np.arange(MOST_ALTERNATIVES) + 0.5) / MOST_ALTERNATIVES
    chosen = np.searchsorted(np.cumsum(weight) / weight.sum(), steps)
    return np.bincount(chosen, minlength=len(weight)) * (weight.sum() / MOST_ALTERNATIVES)


def _outer(changes: np.ndarray) -> np.ndarray:
    """(c, p, p) sums of outer products of changes (c, r, p)."""
    return np.swapaxes(changes, 1, 2) @ changes


def _sums(problem: Problem, c: int) -> Statistics:
    """Of channel ``c``, a unit apart."""
    common = problem.common
    if common is not None:
        pieces = np.column_stack([problem.unit, common.unit])
        pieces = np.unique(pieces, axis=0, return_inverse=True)[1].ravel()
        common = Common(pieces, common.pattern[:, c : c + 1])
    folded = FoldedDesign(problem.design, problem.weight[:, c : c + 1], problem.unit, common)
    m, q = problem.design.shape[1], problem.columns.shape[1]
    held = np.where(problem.fixed[c], problem.center[c, m : m + q], 0.0)
    target = problem.target[:, c] - problem.columns @ held
    columns = np.hstack([np.where(problem.fixed[c], 0.0, problem.columns), problem.slopes[:, :, c]])
    if problem.considered is not None:
        columns = np.hstack([columns, problem.considered[:, :, c]])
    return folded.statistics(target[:, None], columns)


def _noise(
    problem: Problem,
    one: Alternative,
    sums: list[Statistics],
    whole: list[Normal],
    found: np.ndarray,
    inverse: list[np.ndarray],
) -> np.ndarray:
    """(c, p, p) of a model's parameters ``found`` (c, 1, p) by the noise of the units.

    With M the normal matrix, G that of a unit and s what the unit pulls, the parameters follow it by e = M^-1 s. Where
    noise is as the weights say, the covariance of s is G - G M^-1 G; the second part, M^-1 G M^-1 G M^-1, is added, so
    that all adds up to M^-1 in the mean.
    """
    kept = _kept(problem, one)
    parts, size = [part.prefix(one.penalty.shape[1]) for part in sums], len(kept)
    grams = [part.gram[:, 0, :size, :size] for part in parts]  # without what is considered
    pulls = [
        (gram @ own[kept] - part.moment[:, 0, :size]).T
        for gram, part, own in zip(grams, parts, found[:, 0], strict=True)
    ]
    total = _outer(_response(problem, one, whole, pulls))
    for c, units in enumerate(grams):
        own = inverse[c][c][:, kept]
        followed = sum(gram @ own @ gram for gram in units)
        total += np.swapaxes(inverse[c], 1, 2) @ followed @ inverse[c]
    return total


def _normal(sums: Statistics) -> Normal:
    """Of sums of one fold and channel."""
    return sums.gram[0, 0], sums.moment[0, 0]


def _solved(problem: Problem, one: Alternative, sums: list[Normal]) -> np.ndarray:
    """(c, 1, p) solutions of the channels' normal equations."""
    kept = _kept(problem, one)
    solution = _solve(sums, [moment[kept, None] for _, moment in sums], kept, one, problem.slopes.shape[1])
    return _embedded(problem, one, np.swapaxes(solution, 1, 2))


def _inverses(problem: Problem, one: Alternative, whole: list[Normal]) -> list[np.ndarray]:
    """Of each channel, (c, k, p) changes of all parameters by a unit of each of its moments in turn."""
    kept = _kept(problem, one)
    parts, inner, outer = _eliminated(whole, [np.eye(len(kept))] * len(whole), kept, one, _shapes(problem))
    found = []
    for c, moved in enumerate(outer):  # other channels know of its moments by the shapes alone
        shared = _shared(inner, moved)
        change = np.stack([np.vstack([-across @ shared, shared]) for _, across in parts])
        free = parts[c][0]
        change[c, : len(free)] += free
        found.append(_of_all(problem, kept, change))
    return found


def _prior(problem: Problem, one: Alternative, inverse: list[np.ndarray]) -> np.ndarray:
    """(c, p, p) by the prior of the modes, and of the shapes."""
    modes = one.penalty.shape[1]
    total = sum(
        _outer(np.sqrt(penalty)[:, None] * here[:, :modes])
        for penalty, here in zip(one.penalty, inverse, strict=True)
    )
    shapes = inverse[0][:, inverse[0].shape[1] - problem.slopes.shape[1] :]  # the same of every channel
    return total + _outer(shapes) / SHAPE_SPREAD**2


def _response(
    problem: Problem, one: Alternative, whole: list[Normal], moments: list[np.ndarray]
) -> np.ndarray:
    """(c, r, p) changes of all parameters by changes of the channels' ``moments`` (k, r)."""
    kept = _kept(problem, one)
    return _of_all(problem, kept, _solve(whole, moments, kept, one, _shapes(problem)))


def _of_all(problem: Problem, kept: np.ndarray, change: np.ndarray) -> np.ndarray:
    """(c, r, p) of solutions (c, k, r) of the ``kept`` parameters (k,)."""
    every = np.zeros((len(change), change.shape[2], problem.center.shape[1]))
    every[..., kept] = np.swapaxes(change, 1, 2)
    return every


def _solve(
    sums: list[Normal], moments: list[np.ndarray], kept: np.ndarray, one: Alternative, shapes: int
) -> np.ndarray:
    """(c, k, r) solutions of the channels' penalised normal equations, of the ``kept`` parameters (k,), with
    ``moments`` (k, r) on the right. The last ``shapes`` unknowns are shared.

    Each channel's own unknowns are eliminated first.
    """
    eliminated, inner, outer = _eliminated(sums, moments, kept, one, shapes)
    shared = _shared(inner, sum(outer, np.zeros_like(outer[0])))
    return np.stack([np.vstack([free - across @ shared, shared]) for free, across in eliminated])


def _eliminated(
    sums: list[Normal], moments: list[np.ndarray], kept: np.ndarray, one: Alternative, shapes: int
) -> tuple[list[tuple[np.ndarray, np.ndarray]], np.ndarray, list[np.ndarray]]:
    """Each channel's own unknowns (k - shapes, r) without the shared ones, and (k - shapes, shapes) by how much they
    fall with those; the normal matrix of the shared ones, and each channel's part (shapes, r) of their moments."""
    own = len(kept) - shapes
    eliminated, inner, outer = [], np.eye(shapes) / SHAPE_SPREAD**2, []
    every = np.arange(own)
    for (whole, _), moment, penalty in zip(sums, moments, one.penalty, strict=True):
        gram = whole[np.ix_(kept, kept)]
        block = gram[:own, :own].copy()
        block[every[: len(penalty)], every[: len(penalty)]] += penalty
        block[every, every] += RIDGE * np.trace(block) / own + np.finfo(float).tiny
        solved = cholesky_solve(cholesky(block), np.hstack([moment[:own], gram[:own, own:]]))
        free, across = solved[:, : moment.shape[1]], solved[:, moment.shape[1] :]
        inner += gram[own:, own:] - gram[own:, :own] @ across
        outer.append(moment[own:] - gram[own:, :own] @ free)
        eliminated.append((free, across))
    return eliminated, inner, outer


def _shared(inner: np.ndarray, outer: np.ndarray) -> np.ndarray:
    """(shapes, r) the shared unknowns."""
    return _regular(inner, outer) if len(inner) else outer


def _shapes(problem: Problem) -> int:
    """How many unknowns are shared: shapes of lobes."""
    return problem.slopes.shape[1]


def _regular(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution of a symmetric system; 0 for unknowns that nothing depends on, as the shape of a lobe of no weight."""
    size = np.sqrt(np.maximum(np.diagonal(matrix), 0.0))
    inverse = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)
    energy, turn = np.linalg.eigh(matrix * np.outer(inverse, inverse))
    told = np.abs(energy) > RANK * np.abs(energy).max()
    share = np.divide(1.0, energy, out=np.zeros_like(energy), where=told)
    return inverse[:, None] * (turn @ (share[:, None] * (turn.T @ (inverse[:, None] * right))))


def _kept(problem: Problem, one: Alternative) -> np.ndarray:
    """(k,) which of all parameters a model has, that may have fewer modes."""
    return np.r_[0 : one.penalty.shape[1], problem.design.shape[1] : problem.center.shape[1]]


def _embedded(problem: Problem, one: Alternative, solution: np.ndarray) -> np.ndarray:
    """(c, r, p) of solutions (c, r, k) of a model with fewer modes; coefficients at a bound are put back."""
    m, q = problem.design.shape[1], problem.columns.shape[1]
    whole = np.zeros((*solution.shape[:2], problem.center.shape[1]))
    whole[..., _kept(problem, one)] = solution
    held = np.where(problem.fixed, problem.center[:, m : m + q], 0.0)
    whole[..., m : m + q] += held[:, None]
    return whole
