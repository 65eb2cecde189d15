"""How much each model tried deserves to be believed: stacking weights from the folds.

The weight of a model is how often it predicts best when the folds are drawn again, softened by the likelihood: pseudo
Bayesian model averaging with the Bayesian bootstrap (Yao, Vehtari, Simpson and Gelman 2018, section 3.4).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from photogonio.reconstruct.estimate.model_selection import Candidate

DRAWS = 400
LEAST = 0.01  # a smaller weight is dropped
NOTABLE = 0.1  # of the loss: more lobes that lower it by less follow what calibration and stray light leave


def believed(
    candidates: Sequence[Candidate], observations: float, *, seed: int = 0
) -> list[tuple[Candidate, float]]:
    """Models with their weights, which add up to 1; those of no weight are left out.

    ``observations`` is how many independent values the losses were taken on. The noise's size is judged from the best
    model's loss.
    """
    loss = np.stack([one.loss for one in candidates])
    folds = loss.shape[1]
    least = max(float(loss.mean(1).min()), np.finfo(float).tiny)
    density = -0.5 * observations * loss / least
    draws = np.random.default_rng(seed).dirichlet(np.ones(folds), DRAWS)
    total = density @ draws.T  # (k, draws) expected log density of new folds of the same kind
    share = np.exp(total - total.max(0))
    weight = (share / share.sum(0)).mean(1)
    weight = np.where(weight >= min(LEAST, weight.max()), weight, 0.0)
    return [
        (one, w / float(weight.sum())) for one, w in zip(candidates, weight.tolist(), strict=True) if w > 0.0
    ]


def rivals_of(
    chosen: Candidate, candidates: Sequence[Candidate], observations: float
) -> list[tuple[Candidate, float]]:
    """The best model of every other set of lobes than that of ``chosen``, with its weight among the best of all.

    More lobes than the chosen are a rival only if they predict notably better: else they are the same with a lobe for
    which the data have little use, and which may do anything where there are none.
    """
    best: dict[int, Candidate] = {}
    for one in candidates:
        before = best.setdefault(id(one.lobes), one)
        best[id(one.lobes)] = one if one.mean < before.mean else before
    few = [one for one in best.values() if _lobes_of(one) <= _lobes_of(chosen)]
    least = (1.0 - NOTABLE) * min(one.mean for one in few)
    more = [one for one in best.values() if _lobes_of(one) > _lobes_of(chosen) and one.mean < least]
    return [
        (one, weight) for one, weight in believed(few + more, observations) if one.lobes is not chosen.lobes
    ]


def _lobes_of(candidate: Candidate) -> int:
    return len(candidate.lobes.families)
