"""Covariance of a penalised fit's parameters: what its units of data, its prior and the choice of model leave open.

Parameters are, in each channel, mode and lobe coefficients, and shapes of lobes that all channels share. The part of
noise is the jackknife's: every unit (a view, or a block of neighbouring directions) is left out once, which counts
whatever the residuals of a unit share, less the leverage of the units, by which it is too wide where they are few
(MacKinnon and White 1985, HC2 beside HC3; Bell and McCaffrey 2002). The part of the prior is the response to prior
draws, so that the sum is the Bayesian posterior, whose intervals hold on average over the directions (Nychka 1988).
The part of model choice is the spread of the models that predict as well.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
    without = iter(_without_each(problem, [one for one, share in every if share], sums))
    total = np.zeros((*problem.center.shape, problem.center.shape[1]))
    for (one, share), here in zip(every, found, strict=True):
        total += one.weight * _outer(here - problem.center[:, None])
        if share:
            total += share * _noise(problem, one, sums, whole, here, next(without))
            total += share * sum(map(_outer, _prior_draws(problem, one, whole)))
    return total


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
    return folded.statistics(target[:, None], columns)


def _noise(
    problem: Problem,
    one: Alternative,
    sums: list[Statistics],
    whole: list[Normal],
    found: np.ndarray,
    without: np.ndarray,
) -> np.ndarray:
    """(c, p, p) of a model's parameters ``found`` (c, 1, p) by the noise of the units; (c, u, p) ``without`` each.

    With M the normal matrix, G that of a unit and s what the unit pulls, its being left out changes the parameters by
    d = -(M - G)^-1 s, and to first order by e = -M^-1 s. Where noise is as the weights say, the covariance of s is
    (M - G) M^-1 G, so that d e^T has the mean M^-1 G M^-1, which adds up to M^-1; d d^T alone is too large by the
    unit's leverage.
    """
    if without.shape[1] < 2:
        return np.zeros((*problem.center.shape, problem.center.shape[1]))
    kept = _kept(problem, one)
    parts = [part.prefix(one.penalty.shape[1]) for part in sums]
    pulls = [
        (part.gram[:, 0] @ own[kept] - part.moment[:, 0]).T
        for part, own in zip(parts, found[:, 0], strict=True)
    ]
    first = _response(problem, one, whole, pulls)
    product = np.swapaxes(without - found, 1, 2) @ first
    energy, turn = np.linalg.eigh(0.5 * (product + np.swapaxes(product, 1, 2)))
    return (turn * np.maximum(energy, 0.0)[:, None]) @ np.swapaxes(turn, 1, 2)  # by chance some are below 0


def _without_each(
    problem: Problem, several: Sequence[Alternative], sums: list[Statistics]
) -> list[np.ndarray]:
    """(c, u, p) the parameters of ``several`` models without each unit in turn. The sums of a unit are taken away for
    all models at once; those of all units at once would fill a memory."""
    whole, found = [part.total() for part in sums], []
    for f in range(len(sums[0].cells)):
        rest = [_normal(total.less(part, f)) for total, part in zip(whole, sums, strict=True)]
        found.append([_solved(problem, one, rest) for one in several])
    return [np.concatenate(each, axis=1) for each in zip(*found, strict=True)]


def _normal(sums: Statistics) -> Normal:
    """Of sums of one fold and channel."""
    return sums.gram[0, 0], sums.moment[0, 0]


def _solved(problem: Problem, one: Alternative, sums: list[Normal]) -> np.ndarray:
    """(c, 1, p) solutions of the channels' normal equations."""
    kept = _kept(problem, one)
    solution = _solve(sums, [moment[kept, None] for _, moment in sums], kept, one, problem.slopes.shape[1])
    return _embedded(problem, one, np.swapaxes(solution, 1, 2))


def _prior_draws(problem: Problem, one: Alternative, whole: list[Normal]) -> Iterator[np.ndarray]:
    """The response (c, r, p) to one standard deviation of the prior of each mode, a channel at a time, and of each
    shape."""
    modes, shapes = one.penalty.shape[1], problem.slopes.shape[1]
    size = len(_kept(problem, one))
    for c, penalty in enumerate(one.penalty):
        moments = [np.zeros((size, modes)) for _ in whole]
        moments[c][:modes] = np.diag(np.sqrt(penalty))
        yield _response(problem, one, whole, moments)
    if shapes:
        moments = [np.zeros((size, shapes)) for _ in whole]
        moments[0][-shapes:] = np.eye(shapes) / SHAPE_SPREAD
        yield _response(problem, one, whole, moments)


def _response(
    problem: Problem, one: Alternative, whole: list[Normal], moments: list[np.ndarray]
) -> np.ndarray:
    """(c, r, p) changes of all parameters by changes of the channels' ``moments`` (k, r)."""
    kept = _kept(problem, one)
    change = np.swapaxes(_solve(whole, moments, kept, one, problem.slopes.shape[1]), 1, 2)
    every = np.zeros((*change.shape[:2], problem.center.shape[1]))
    every[..., kept] = change
    return every


def _solve(
    sums: list[Normal], moments: list[np.ndarray], kept: np.ndarray, one: Alternative, shapes: int
) -> np.ndarray:
    """(c, k, r) solutions of the channels' penalised normal equations, of the ``kept`` parameters (k,), with
    ``moments`` (k, r) on the right. The last ``shapes`` unknowns are shared.

    Each channel's own unknowns are eliminated first.
    """
    own = len(kept) - shapes
    eliminated, inner, outer = [], np.eye(shapes) / SHAPE_SPREAD**2, np.zeros((shapes, moments[0].shape[1]))
    every = np.arange(own)
    for (whole, _), moment, penalty in zip(sums, moments, one.penalty, strict=True):
        gram = whole[np.ix_(kept, kept)]
        block = gram[:own, :own].copy()
        block[every[: len(penalty)], every[: len(penalty)]] += penalty
        block[every, every] += RIDGE * np.trace(block) / own + np.finfo(float).tiny
        solved = cholesky_solve(cholesky(block), np.hstack([moment[:own], gram[:own, own:]]))
        free, across = solved[:, : moment.shape[1]], solved[:, moment.shape[1] :]
        inner += gram[own:, own:] - gram[own:, :own] @ across
        outer += moment[own:] - gram[own:, :own] @ free
        eliminated.append((free, across))
    shared = _regular(inner, outer) if shapes else outer
    return np.stack([np.vstack([free - across @ shared, shared]) for free, across in eliminated])


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
