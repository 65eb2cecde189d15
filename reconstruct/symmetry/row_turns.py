"""Do measured rows show that the surface turns? By the evidence of lobes that are stretched along an axis.

Smooth isotropic modes follow whatever an isotropic surface may do between the rows, so that a lobe of two roughnesses
gains by the sample's turn alone, not by a misfit of another kind: its evidence beside that of the same lobe of one
roughness, both with the same modes and noise. The shapes tried are a grid, over which evidence is averaged, so that
trying many costs what it should.
"""

from __future__ import annotations

import numpy as np
from scipy.special import logsumexp

from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.weights import error_model
from photogonio.reconstruct.lobes.families import turned_roughness
from photogonio.reconstruct.rows.row_average import Average, average_of, between, grid
from photogonio.reconstruct.rows.row_evidence import RowEvidence
from photogonio.reconstruct.symmetry.trials import turned
from photogonio.reconstruct.symmetry.verdict import ONE_ROTATION, Verdict, odds_in_words, one_rotation
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


def judge_rows(cells: Cells, average: Average) -> tuple[Verdict, Average]:
    """The symmetry that measured rows show, and their average: with lobes that turn if they do.

    Evidence must be for it, with the noise that grows as ``average`` tells, and so must rows predicted by all others.
    What an average with such lobes and the one without say is averaged once more: where a peak was left out lobes that
    turn go astray as others do, and the two err otherwise.
    """
    if one_rotation(cells):
        return ONE_ROTATION, average
    odds, gain, stretched = _compared(cells, average.fresh.noise.at(cells, average.said))
    said = f"odds for a lobe that turns {odds_in_words(odds)}"
    if odds >= LIKELIER:
        said += f"; rows predicted by all others gain {gain:.1f} standard errors by it"
    if odds < LIKELIER or gain < SURE:
        return Verdict("isotropic", said, odds), average
    turning = average_of(cells, error_model(cells), average.model.basis.order, (*grid(), *stretched))
    if not turning.model.turning:
        return Verdict("isotropic", f"{said}; neighbourhoods left out gain nothing", odds), average
    kept = [one for one in turning.members if one.lobes.turning]
    most, least, azimuth = turned_roughness(max(kept, key=lambda one: one.weight).lobes.shapes[0])
    axes = f"roughness {most:.2g} along {np.degrees(azimuth):.0f} degrees from x, {least:.2g} across"
    return Verdict("reciprocal", f"{said}; {axes}", odds), between(cells, turning, average, SHARE)


def _compared(cells: Cells, deviation: np.ndarray) -> tuple[float, float, list[LobeSet]]:
    """Of rows whose errors are ``deviation`` (n, c): the logarithm of the odds for a lobe of two roughnesses, what rows
    predicted by all others gain by the likeliest, in standard errors, and the lobes that were tried."""
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
    odds = _mean(evidence[turning]) - _mean(evidence[~turning])
    if odds < LIKELIER:
        return odds, 0.0, stretched
    best = [np.flatnonzero(kind)[np.argmax(evidence[kind])] for kind in (turning, ~turning)]
    gain = np.subtract(*(both.each_by_others(int(k), float(ratio[k])) for k in best))
    error = np.sqrt(len(gain)) * gain.std(ddof=1)
    return odds, float(gain.sum() / max(error, TINY)), stretched


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
