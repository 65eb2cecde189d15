"""Whether a surface is isotropic, and reciprocal: which model predicts left-out views, and whether the data could tell.

Two models that differ in nothing else are fitted: lobes and modes that do not heed how the sample is turned, and the
same with two roughnesses and with modes that turn. Each predicts views that it has not seen, under the same folds,
weights and shared errors of scale. A view's residuals hang together (geometry, texture), so that it counts as
:data:`VIEW_WORTH` values however many cells it has, and the odds of one model against another are those of the
predictions, (loss / loss')^(values / 2): a pseudo Bayes factor (Geisser and Eddy 1979) whose noise is judged from
what the predictions miss. A model that is wrong in any other way gains too by what turning lets it do; so the
rotations are dealt out among the views again and again, which changes nothing if the surface is isotropic, and the
odds must stand out from those of the shuffled sets (a permutation test, views being its blocks). Isotropy is kept
unless odds and permutations convince and the two models differ by more than calibration errors can make. Where the
sample was seen at one rotation, or unequal roughnesses would not have shown, nothing was tested, and that is said.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from photogonio.capture.errors import InputError
from photogonio.reconstruct.estimate.lobe_search import starting_shape
from photogonio.reconstruct.estimate.model import LobeSet
from photogonio.reconstruct.estimate.outlier_views import pair_places
from photogonio.reconstruct.estimate.pilot import Cleaned, clean
from photogonio.reconstruct.lobes.families import families, turned_roughness
from photogonio.reconstruct.symmetry.trials import (
    MATERIAL,
    TOLD,
    Trial,
    Tried,
    difference,
    glossy,
    turned,
)
from photogonio.reconstruct.symmetry.twins import BROKEN, HELD, UNTOLD, Twins, compare_twins
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.validity import NEAR

CONVINCING = np.log(1000.0)  # log odds
CHANCE = 0.001  # that a shuffled set has odds as high
ONE_TURN = 0.9  # mean resultant of doubled azimuths: above it the sample was seen at one rotation
START = 0.25  # roughness
TWINS = 0.05  # of the cells, that have been seen the other way round too
MATTERS = 0.03  # rms, of f, by which exchange must matter: an error of the irradiance's angle looks the same
NO_GLOSS = "there is no gloss, whose roughnesses could differ"
NO_LOBE = "the fit has no mirror lobe, whose roughnesses could differ"


@dataclass(frozen=True, slots=True)
class Verdict:
    """The symmetry, why, and by what odds."""

    symmetry: str
    reason: str
    log_odds: float | None = None  # natural, for a surface that turns against an isotropic one
    chance: float | None = None  # of odds as high where the rotations mean nothing; None: not worth asking
    could_show: float | None = (
        None  # log odds that unequal roughnesses would have had, at least; None: no gloss
    )
    reciprocity: str = UNTOLD  # HELD | BROKEN | UNTOLD
    exchanged: str = "nothing was seen with incidence and exit exchanged"  # why
    tested: str = ""  # what a test of isotropy found, whether there is a gloss or not; nothing: none was made

    def unless(self, reciprocity: str) -> Verdict:
        """The verdict with what was found of reciprocity."""
        if reciprocity != BROKEN:
            return replace(self, reciprocity=reciprocity)
        reason = f"incidence and exit cannot be exchanged; {self.reason}"
        return replace(self, symmetry="general", reason=reason, reciprocity=reciprocity)

    def beside(self, twins: Twins) -> Verdict:
        """The verdict with what readings say directly; models still have a say where those cannot tell."""
        if twins.verdict == UNTOLD and self.reciprocity == BROKEN:
            return self
        return replace(self, reciprocity=twins.verdict, exchanged=twins.reason)

    def of_matte(self) -> Verdict:
        """The verdict where the fit has no mirror lobe: nothing is claimed of what two roughnesses would show."""
        if self.symmetry != "isotropic" or not self.tested:
            return self
        return replace(self, reason=f"{self.tested}; {NO_LOBE}", could_show=None)

    def plain(self) -> dict[str, object]:
        """JSON values."""
        return {
            "chosen": self.symmetry,
            "reason": self.reason,
            "log10 odds for turning": _tens(self.log_odds),
            "p-value of isotropy": self.chance,
            "log10 odds that a ratio of roughnesses of 1.5 would show": _tens(self.could_show),
            "reciprocity": self.reciprocity,
            "reciprocity because": self.exchanged,
        }


ONE_ROTATION = Verdict(
    "isotropic", "assumed: the sample was seen at one rotation only, which cannot prove it"
)


def _tens(log_odds: float | None) -> float | None:
    return None if log_odds is None else round(float(log_odds / np.log(10.0)), 2)


def asked(symmetry: str, cells: Cells) -> Verdict | None:
    """The verdict where none is to be found: asked for, or no azimuths to judge by; None: to be judged.

    Raises:
        InputError: more was asked than the cells hold.
    """
    if symmetry not in ("auto", "isotropic") and cells.canonical:
        raise InputError(
            f"--symmetry {symmetry}", "the table was reduced as of an isotropic sample: it has no azimuths"
        )
    if cells.canonical:
        return Verdict(
            "isotropic", "assumed: azimuths against the sample are not known (a ball, or asked for)"
        )
    if symmetry != "auto":
        return Verdict(symmetry, "asked for")
    return None


def turning_kinds(lobes: int | None, absolute: bool) -> list[LobeSet]:
    """What to try on a surface that may turn: lobes of every family with two roughnesses."""
    single = [
        LobeSet((family,), (starting_shape(family, START),))
        for family in families(absolute=absolute, turning=True)
    ]
    if lobes == 0:
        return [LobeSet()]
    return single if lobes else [LobeSet(), *single]


def judge(
    cells: Cells,
    view_errors: np.ndarray,
    isotropic: Cleaned,
    *,
    absolute: bool,
) -> Verdict:
    """The symmetry of the surface that ``cells`` show; ``isotropic`` is what they are if it is isotropic.

    ``view_errors`` (g,) are relative standard errors of the views' scales.
    """
    plain = _likeliest(isotropic)
    if one_rotation(cells):
        return _of_one_rotation(Trial.of(isotropic), plain)
    kinds = [turned(lobes) for lobes in plain if len(lobes.families) < 2]
    trial = Trial.of(clean(cells, view_errors, lobes=1, absolute=absolute, kinds=kinds, rounds=1))
    still = min((trial.fitted(lobes) for lobes in plain), key=lambda one: one.loss)
    turns = min((trial.fitted(lobes, turning=True) for lobes in trial.turned), key=lambda one: one.loss)
    odds = trial.log_odds(still, turns)
    chance = None
    if odds >= CONVINCING and difference(still, turns) >= MATERIAL:
        chance = trial.chance(still, turns)
    could_show = trial.could_show(still)
    gloss = glossy(still.model, trial.cells)
    if chance is not None and chance <= CHANCE and trial.accounts(still, turns):
        symmetry, reason, best = "reciprocal", _why_turning(turns, odds, _chance(chance)), turns
        tested = ""
    else:
        tested = _tested(odds, chance)
        symmetry, reason, best = "isotropic", _why_isotropic(odds, chance, could_show, gloss), still
    reciprocity = _reciprocity(trial, best)
    told = Verdict(symmetry, reason, odds, chance, could_show if gloss else None, tested=tested)
    return told.unless(reciprocity)


def _of_one_rotation(trial: Trial, lobes: Sequence[LobeSet]) -> Verdict:
    verdict = ONE_ROTATION
    if twins(trial.cells) < TWINS:
        return verdict
    still = min((trial.fitted(one) for one in lobes), key=lambda one: one.loss)
    return verdict.unless(_reciprocity(trial, still))


def _likeliest(work: Cleaned) -> list[LobeSet]:
    """No lobe, and the likeliest pilots of each number of lobes."""
    found = [LobeSet()]
    for count in sorted({len(pilot.model.lobes.families) for pilot in work.pilots} - {0}):
        same = [pilot for pilot in work.pilots if len(pilot.model.lobes.families) == count]
        found.append(min(same, key=lambda one: one.cost).model.lobes)
    return found


def _reciprocity(trial: Trial, best: Tried) -> str:
    """Whether the surface is the same if incidence and exit are exchanged, as models say it; rows of a table that were
    read both ways say it themselves."""
    if twins(trial.cells) < TWINS:
        return UNTOLD
    if direct(trial.cells).verdict == HELD:
        return HELD
    lobes = best.model.lobes
    other = trial.fitted(lobes, swapped=True)
    broken = trial.log_odds(best, other) >= CONVINCING and difference(best, other) >= MATTERS
    return BROKEN if broken else HELD


def direct(cells: Cells) -> Twins:
    """What rows of a table that were read both ways say; cells of photos, whose errors hang together, say nothing."""
    if cells.binned:
        return Twins(UNTOLD)
    mean = np.mean(cells.value / np.maximum(np.abs(cells.value).mean(0), np.finfo(float).tiny), axis=1)
    return compare_twins(cells.theta_i, cells.theta_r, cells.phi_r - cells.phi_i, mean)


def twins(cells: Cells) -> float:
    """Share of the cells whose exchanged directions have been seen as well, but for those that are their own twins."""
    there = pair_places(cells.theta_i, cells.theta_r, cells.dphi)
    back = pair_places(cells.theta_r, cells.theta_i, cells.dphi)
    far = np.abs(cells.theta_i - cells.theta_r) > 2.0 * NEAR
    if not far.any():
        return 0.0
    distance, _ = cKDTree(there).query(back[far])
    return float(np.sum(distance <= NEAR) / len(cells))


def one_rotation(cells: Cells) -> bool:
    """Whether the camera, or the lamp, was always on the same side of the sample (or on the opposite one)."""
    for theta, phi in ((cells.theta_i, cells.phi_i), (cells.theta_r, cells.phi_r)):
        weight = np.sin(theta) + 1e-9
        if np.abs(np.sum(weight * np.exp(2j * phi))) > ONE_TURN * weight.sum():
            return True
    return False


def _why_turning(turns: Tried, odds: float, found: str) -> str:
    reason = f"what is left out is predicted better if the sample's turn matters, odds {odds_in_words(odds)}, {found}"
    for family, shape in zip(turns.model.lobes.families, turns.model.lobes.shapes, strict=True):
        if family.turning:
            most, least, azimuth = turned_roughness(shape)
            degrees = np.degrees(azimuth)
            reason += f"; roughness {most:.3g} along {degrees:.0f} degrees from x, {least:.3g} across"
    return reason


def _why_isotropic(odds: float, chance: float | None, could_show: float, gloss: bool) -> str:
    found = _tested(odds, chance)
    if not gloss:
        return f"{found}; {NO_GLOSS}"
    if could_show < CONVINCING:
        return f"assumed: roughnesses in the ratio {TOLD} would not have shown ({found})"
    return f"{found}; roughnesses in the ratio {TOLD} would have had {odds_in_words(could_show)}, at least"


def _tested(odds: float, chance: float | None) -> str:
    """What the test found of a surface that is isotropic."""
    found = f"odds for a surface that turns {odds_in_words(odds)}"
    if chance is not None:
        why = (
            "views turned at random do as well"
            if chance > CHANCE
            else "both models miss far more than errors do"
        )
        found += f", {_chance(chance)}, but {why}"
    return found


def _chance(chance: float) -> str:
    """Seven shuffled sets do not tell chances below a thousandth apart."""
    return "p < 0.001" if chance < 1e-3 else f"p = {chance:.2g}"


def odds_in_words(log_odds: float) -> str:
    """In words."""
    tens = abs(log_odds) / np.log(10.0)
    size = f"{10.0**tens:.3g}" if tens < 4 else f"10^{tens:.0f}"
    return f"{size} to 1" if log_odds >= 0.0 else f"1 to {size}"
