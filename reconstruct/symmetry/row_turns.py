"""Do measured rows show that the surface turns? By the evidence of lobes that are stretched along an axis.

Smooth isotropic modes follow whatever an isotropic surface may do between the rows, so that a lobe of two roughnesses
gains by the sample's turn alone, not by a misfit of another kind: its evidence beside that of the same lobe of one
roughness, both with the same modes and noise. The shapes tried are a grid, over which evidence is averaged, so that
trying many costs what it should. Where they tell nothing it is asked what they would have told of the same surface
with a lobe that turns. The verdict does not hang on what an average of models makes of it, whose weights are those of
neighbourhoods left out: where a peak was left out all lobes go astray.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.weights import error_model
from photogonio.reconstruct.lobes.families import turned_roughness
from photogonio.reconstruct.rows.row_average import Average, average_of, between, grid
from photogonio.reconstruct.rows.row_evidence import RowEvidence
from photogonio.reconstruct.symmetry.trials import MATERIAL, TOLD, turned
from photogonio.reconstruct.symmetry.verdict import (
    NO_GLOSS,
    ONE_ROTATION,
    Verdict,
    odds_in_words,
    one_rotation,
)
from photogonio.reconstruct.table.cells import Cells

ORDER = 8
RATIOS = (1.4, 2.0, 3.0)  # of the roughnesses
AZIMUTHS = np.pi * np.arange(8) / 8  # of the rougher axis
ROUGHEST = 1.0  # along an axis
LIKELIEST = 3  # lobes of one roughness, that are stretched
TINY = np.finfo(float).tiny
MOST_ROWS = 1500  # evenly taken of more
LIKELIER = np.log(100.0)  # log odds, and
SURE = 2.0  # standard errors of what rows predicted by all others gain
SHARE = 0.6  # of the weight, that an average which turns has beside the one that does not
LEAST_SHARE = (
    0.3  # of the first one's, that lobes have whatever neighbourhoods left out say, if rows surely turn
)


def judge_rows(cells: Cells, average: Average) -> tuple[Verdict, Average]:
    """The symmetry that measured rows show, and their average: with lobes that turn if they do.

    Evidence must be for it, with the noise that grows as ``average`` tells, and so must rows predicted by all others.
    What an average with such lobes and the one without say is averaged once more: where a peak was left out lobes that
    turn go astray as others do, and the two err otherwise.
    """
    if one_rotation(cells):
        return ONE_ROTATION, average
    found = _compared(cells, average.fresh.noise.at(cells, average.said))
    odds, gain = found.odds, found.gain
    said = f"odds for a lobe that turns {odds_in_words(odds)}"
    if odds < LIKELIER:
        reason = _why_isotropic(said, found.could_show)
        return Verdict("isotropic", reason, odds, None, found.could_show, tested=said), average
    said += f"; rows predicted by all others gain {gain:.1f} standard errors by it"
    if gain < SURE:
        return Verdict("isotropic", said, odds), average
    order, error = average.model.basis.order, error_model(cells)
    turning = average_of(cells, error, order, (*grid(), *found.stretched))
    if not turning.model.turning:
        turning = average_of(cells, error, order, found.stretched, LEAST_SHARE)
        said += "; neighbourhoods left out gain nothing"
    if not turning.model.turning:
        return Verdict("isotropic", said, odds), average
    kept = [one for one in turning.members if one.lobes.turning]
    most, least, azimuth = turned_roughness(max(kept, key=lambda one: one.weight).lobes.shapes[0])
    axes = f"roughness {most:.2g} along {np.degrees(azimuth):.0f} degrees from x, {least:.2g} across"
    return Verdict("reciprocal", f"{said}; {axes}", odds), between(cells, turning, average, SHARE)


def _why_isotropic(said: str, could_show: float | None) -> str:
    if could_show is None:
        return f"{said}; {NO_GLOSS}"
    if could_show < LIKELIER:
        return f"assumed: roughnesses in the ratio {TOLD} would not have shown ({said})"
    return f"{said}; roughnesses in the ratio {TOLD} would have had {odds_in_words(could_show)}, at least"


@dataclass(frozen=True, slots=True)
class _Compared:
    """Lobes of two roughnesses beside those of one."""

    odds: float  # logarithm
    gain: (
        float  # of rows predicted by all others, by the likeliest, in standard errors; 0 where odds are small
    )
    stretched: list[LobeSet]  # that were tried
    could_show: float | None  # log odds that unequal roughnesses would have had, at least, if odds are small


def _compared(cells: Cells, deviation: np.ndarray) -> _Compared:
    """Of rows whose errors are ``deviation`` (n, c)."""
    few = np.arange(0, len(cells), -(-len(cells) // MOST_ROWS))
    cells, deviation = cells.take(few), deviation[few]
    mirrors = [one for one in grid() if not one.families[0].retro and _rough(one, RATIOS[0]) <= ROUGHEST]
    still = RowEvidence.of(cells, deviation, ORDER, mirrors)
    likeliest: list[LobeSet] = []
    for k in np.argsort(-still.evidence()[0], kind="stable"):
        one = still.trials[k].lobes
        if len(likeliest) < LIKELIEST and not any(one is other for other in likeliest):
            likeliest.append(one)
    pairs = [(one, ratio) for one in likeliest for ratio in RATIOS if _rough(one, ratio) <= ROUGHEST]
    stretched = [_stretched(*pair, a) for pair in pairs for a in AZIMUTHS]
    both = RowEvidence.of(cells, deviation, ORDER, (*likeliest, *stretched))
    turning, (evidence, ratio) = np.array([one.lobes.turning for one in both.trials]), both.evidence()
    odds = _odds(evidence, turning)
    best = [int(np.flatnonzero(kind)[np.argmax(evidence[kind])]) for kind in (turning, ~turning)]
    if odds < LIKELIER:
        return _Compared(
            odds, 0.0, stretched, _could_show(cells, both, best[1], float(ratio[best[1]]), turning)
        )
    gain = np.subtract(*(both.each_by_others(k, float(ratio[k])) for k in best))
    error = np.sqrt(len(gain)) * gain.std(ddof=1)
    return _Compared(odds, float(gain.sum() / max(error, TINY)), stretched, None)


def _could_show(cells: Cells, both: RowEvidence, k: int, ratio: float, turning: np.ndarray) -> float | None:
    """Least log odds, over the azimuths of its axes, that the rows would have had if lobe ``k`` were stretched in the
    ratio :data:`TOLD` and they missed what they miss; None where that would change next to nothing."""
    lobes, used = both.trials[k]
    weight = both.solved(k, ratio, ratio).lobes / both.size[k][:, None]
    here, found = lobes.columns(cells)[1][:, used], []
    for azimuth in AZIMUTHS[::2]:
        change = (_stretched(lobes, TOLD, azimuth).columns(cells)[1][:, used] - here) @ weight
        if np.mean(change**2) < MATERIAL**2 * np.mean(both.value**2):
            return None
        found.append(_odds(replace(both, value=both.value + change).evidence()[0], turning))
    return min(found)


def _odds(evidence: np.ndarray, turning: np.ndarray) -> float:
    """The logarithm of the odds for a lobe of two roughnesses."""
    return _mean(evidence[turning]) - _mean(evidence[~turning])


def _rough(lobes: LobeSet, ratio: float) -> float:
    """The larger roughness of the lobe, stretched so that they are in ``ratio``."""
    return float(lobes.shapes[0][0] * np.sqrt(ratio))


def _mean(logs: np.ndarray) -> float:
    return float(logsumexp(logs) - np.log(len(logs)))


def _stretched(lobes: LobeSet, ratio: float, azimuth: float) -> LobeSet:
    """The same with roughnesses in ``ratio``, the larger along ``azimuth``."""
    lobes, size = turned(lobes), 0.5 * np.log(ratio)
    shape = lobes.shapes[0].copy()
    shape[-2:] = np.exp(size * np.array([np.cos(2.0 * azimuth), np.sin(2.0 * azimuth)]))
    return LobeSet(lobes.families, (shape,))
