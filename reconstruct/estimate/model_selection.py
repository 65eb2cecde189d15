"""Choice of order, prior strength and lobes: the simplest model that predicts left-out views as well as the best.

Folds are whole views where there are several, else blocks of neighbouring cells with reciprocal twins kept together,
since random folds flatter (Roberts et al. 2017). Among models whose mean loss on the folds lies within one standard
error of the best's, the simplest is taken (Breiman et al. 1984, the one-standard-error rule, on paired differences).
Views enter with the error of scale that they share, so that it is not taken for structure of the surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from photogonio.reconstruct.estimate.folded_design import Common, FoldedDesign
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.normal_equations import Factors, residual_each, solve_each, without_each
from photogonio.reconstruct.estimate.weights import independence, level
from photogonio.reconstruct.modes.angles import half_difference, unit_vectors
from photogonio.reconstruct.table.cells import Cells

FOLDS = 10
LEAST_VIEWS = 4  # fewer cannot be left out one by one
IMMATERIAL = 0.005  # of the loss: a gain of less is not worth a higher order
WORTH_A_LOBE = 0.25  # of the loss: every lobe must lower it by as much
FEW_ORDERS = 2  # the last of which has few modes, and more than a Lambertian
SAVED = 0.2  # of the modes: or make do with as few
CROSSED = np.radians(3.0)  # spread of the angle of difference at the same half angle
BLOCK = np.radians(15.0)
TOGETHER = 3  # channels of which matrices of all folds are held at once


@dataclass(frozen=True, slots=True)
class Prior:
    """Gaussian prior of the modes' coefficients: standard deviation ``strength * level / degree^decay``.

    A standard deviation that falls with the squared spatial frequency (decay 1) asks for a small mean squared
    Laplacian, as the smoothing spline does (Wahba 1990); decay 2 for a small bilaplacian, which leaves broad
    modes free and all but forbids fine ones. The Lambertian mode is free.
    """

    strength: float  # at degree 1, of the channel's level
    decay: float

    def precision(self, degree: np.ndarray, level: np.ndarray) -> np.ndarray:
        """Inverse variances (c, m) of coefficients of ``degree`` (m,) in channels of ``level`` (c,)."""
        return degree ** (2.0 * self.decay) / (self.strength * level[:, None]) ** 2


PRIORS = (
    *(Prior(strength, 1.0) for strength in (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)),
    *(Prior(strength, 2.0) for strength in (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)),
)
NO_PRIOR = Prior(np.inf, 1.0)  # least squares alone


@dataclass(frozen=True, slots=True)
class Candidate:
    """One model tried."""

    order: int
    prior: Prior
    lobes: LobeSet
    loss: (
        np.ndarray
    )  # (f,) mean weighted squared residual a cell that counts, each fold predicted from all others
    mean: float = field(init=False)  # of the loss, which choices ask for again and again

    def __post_init__(self):
        object.__setattr__(self, "mean", float(self.loss.mean()))


def folds_of(cells: Cells, *, seed: int = 0) -> np.ndarray:
    """Fold (n,) of each cell: of its view, or of its block of neighbouring directions."""
    unit = cells.group if len(np.unique(cells.group)) >= LEAST_VIEWS else blocks_of(cells)
    _, unit = np.unique(unit, return_inverse=True)
    count = unit.max(initial=0) + 1
    shuffled = np.random.default_rng(seed).permutation(count)
    return shuffled[unit] % min(FOLDS, count)


def blocks_of(cells: Cells) -> np.ndarray:
    """(n,) a number for each block of neighbouring directions, the same for reciprocal twins."""
    low, high = np.minimum(cells.theta_i, cells.theta_r), np.maximum(cells.theta_i, cells.theta_r)
    sine = np.sin(low) + 1e-3  # blocks of about equal size: azimuth means less near the normal
    around = np.floor(cells.dphi * np.clip(sine, 0.2, 1.0) / BLOCK)
    return (np.floor(low / BLOCK) * 64 + np.floor(high / BLOCK)) * 64 + around


def try_all(
    cells: Cells,
    weight: np.ndarray,
    symmetry: str,
    orders: Sequence[int],
    lobes: Sequence[LobeSet],
    common: Common | None = None,
    priors: Sequence[Prior] = PRIORS,
) -> list[Candidate]:
    """Every order, prior and set of lobes, each judged on folds.

    ``weight`` (n, c), which knows that cells of a view are not independent, and the views' ``common`` errors are the
    same for all of them.
    """
    fold = folds_of(cells)
    if common is not None:  # folds of blocks cut views apart
        unit = np.unique(np.column_stack([fold, common.unit]), axis=0, return_inverse=True)[1].ravel()
        common = Common(unit, common.pattern)
    folded = FoldedDesign(Basis(symmetry, max(orders)).design(cells), weight, fold, common)
    sums = []
    for one in lobes:
        fixed, columns = one.columns(cells)
        sums.append(folded.statistics(cells.value - fixed[:, None], columns))
    uppers = [one.upper_bounds() for one in lobes]
    counts = weight.shape[1] * np.maximum(np.bincount(fold, independence(cells)[:, 0]), 1e-9)
    models = [(order, prior) for order in orders for prior in (priors if order else priors[:1])]
    typical, missed = level(cells), np.zeros((len(models), len(lobes), len(counts)))
    for start in range(0, weight.shape[1], TOGETHER):
        some = slice(start, start + TOGETHER)
        whole = [one.of_channels(some) for one in sums]
        others = without_each(whole)
        for k, (order, prior) in enumerate(models):
            basis = Basis(symmetry, order)
            parts, rests = ([one.prefix(len(basis.modes)) for one in each] for each in (whole, others))
            factors = Factors(rests[0].modes_gram, prior.precision(basis.degree(), typical[some]))
            missed[k] += [one.sum(1) for one in residual_each(parts, solve_each(rests, factors, uppers))]
    return [
        Candidate(*model, one, loss / counts)
        for model, losses in zip(models, missed, strict=True)
        for one, loss in zip(lobes, losses, strict=True)
    ]


def crosses(cells: Cells) -> bool:
    """Whether cells of the same half angle are seen at different angles of difference (Rusinkiewicz 1998).

    Only then do data tell a lobe's Fresnel term and masking from its distribution: not where all light comes from the
    normal, nor where lamp and camera stand side by side.
    """
    half, difference, _ = half_difference(
        unit_vectors(cells.theta_i, 0.0), unit_vectors(cells.theta_r, cells.dphi)
    )
    smooth = np.vander(half, 4)
    rest = difference - smooth @ np.linalg.lstsq(smooth, difference, rcond=None)[0]
    return bool(rest.std() > CROSSED)


def choose(
    candidates: list[Candidate], tolerated: float = 0.0, *, thrifty: bool = True
) -> tuple[Candidate, Candidate]:
    """The simplest candidate that predicts as well as the best, and the best.

    A lobe must pay: fewer lobes are kept unless more lower the loss by :data:`WORTH_A_LOBE` and by more than its
    standard error, or, if ``thrifty``, do as well with a share :data:`SAVED` of the modes, of which fewer lobes would
    lack as much. Losses that differ by less than ``tolerated`` count as equal: calibration and stray light leave
    misfits of that size, and a mode bought to follow them goes astray where no photo holds it. Among lobes that
    predict equally well with as many modes, those are taken that need the modes least: whose loss is least with few
    of them and with as many as help, in the product.
    """
    best = min(candidates, key=lambda one: one.mean)
    simple: list[Candidate] = []
    for count in sorted({len(one.lobes.families) for one in candidates}):
        more = [one for one in candidates if len(one.lobes.families) == count]
        if not simple or _pays(more, simple, best, tolerated, thrifty):
            simple = more
    good = _simplest(simple, tolerated)
    alone = {id(one.lobes): _alone(simple, one.lobes) for one in good}
    lobes = min((one.lobes for one in good), key=lambda lobes: alone[id(lobes)])
    return min((one for one in good if one.lobes is lobes), key=lambda one: one.mean), best


def _pays(
    more: list[Candidate], fewer: list[Candidate], best: Candidate, tolerated: float, thrifty: bool
) -> bool:
    """Whether models with more lobes are worth it, in loss or in modes."""
    least, with_more = (min(some, key=lambda one: one.mean) for some in (fewer, more))
    gain = least.loss - with_more.loss
    if gain.mean() > tolerated + WORTH_A_LOBE * best.mean and not _within_one_error(
        least.loss, with_more.loss
    ):
        return True
    enough = [one for one in more if one.mean <= least.mean]
    if not (thrifty and enough):
        return False
    spare = min(enough, key=lambda one: (_modes_of(one), one.mean))
    saved = _modes_of(_simplest(fewer, tolerated)[0])
    lacking = min((one.mean for one in fewer if one.order <= spare.order), default=np.inf)
    return _modes_of(spare) <= SAVED * saved and lacking > (1.0 + WORTH_A_LOBE) * spare.mean


def _simplest(candidates: list[Candidate], tolerated: float) -> list[Candidate]:
    """Those of the lowest order that predict as well as the best."""
    least = min(candidates, key=lambda one: one.mean)
    good = [one for one in candidates if _as_good(one, least, tolerated)]
    order = min(one.order for one in good)
    return [one for one in good if one.order == order]


def _modes_of(candidate: Candidate) -> int:
    return len(Basis("isotropic", candidate.order).modes)


def _alone(candidates: list[Candidate], lobes: LobeSet) -> float:
    """Least loss of ``lobes`` with the fewest modes tried but one order, times that with any.

    Shapes were found beside modes; with a Lambertian alone the loss is more of what they lack than of the lobes. With
    any modes it is what the lobes miss for good, where those take up what is theirs as well.
    """
    same = [one for one in candidates if one.lobes is lobes]
    few = sorted({one.order for one in same})[:FEW_ORDERS][-1]
    least = [one.mean for one in same]
    return min(least) * min(loss for loss, one in zip(least, same, strict=True) if one.order == few)


def _as_good(one: Candidate, least: Candidate, tolerated: float) -> bool:
    excess = one.mean - least.mean
    return excess <= max(IMMATERIAL * least.mean, tolerated) or _within_one_error(one.loss, least.loss)


def _within_one_error(loss: np.ndarray, least: np.ndarray) -> bool:
    """Whether losses of the same folds differ by no more than chance: on their logarithms, since folds differ much in
    how hard they are and one hard fold would hide what all the others say."""
    tiny = np.finfo(float).tiny
    ratio = np.log(np.maximum(loss, tiny)) - np.log(np.maximum(least, tiny))
    error = ratio.std(ddof=1) / np.sqrt(len(ratio)) if len(ratio) > 1 else 0.0
    return bool(ratio.mean() <= error + 1e-12)
