"""Which readings of white patches and paper are believed, and what is told of those that are not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from photogonio.calib.radiometry.patch import NoStrength, Strength
from photogonio.calib.radiometry.readings import DARKER, NO_PATCH, WORST, StrengthReadings
from photogonio.calib.remarks import Remarks, listed
from photogonio.capture import robust

Readings = dict[str, StrengthReadings]  # by view

# of the light that white paper lost to blur: what black print, which is read farther from its edges, gained at the
# least; by 2.5 pixels of blur it gained 0.08
_SPREAD = 0.03
_FEW = 4  # patches that can outvote one; with fewer the brightest counts, since shadows only darken
_WHITEST = 1.08  # reflectance above which paper cannot be: the patch that says so lies in shadow
_PAPER_VARIES = 0.01  # relative: how far paper and patch may differ from view to view at the least
# relative scatter of patch over paper from photo to photo that is told; path-traced sets in order have 0.003 to 0.01,
# with a wrong encoding 0.04 and more
_NO_RATIO = 0.025
_REFUSED = "the patch is not believed"
_MOSTLY = 0.75  # of the photos: a patch that is too dark in as many lies in no shadow


def believed(readings: Mapping[str, StrengthReadings], remarks: Remarks) -> Readings:
    """The readings without those that contradict the others, their errors as large as they scatter."""
    left = _with_uneven(_with_black_print(readings), remarks)
    left = _without_false(_without_unsharp(left, remarks), remarks)
    both = _log_ratios(left)
    if len(both) < _FEW:
        return left
    ratio = np.array(list(both.values()))
    _tell_scatter(ratio, remarks)
    stated = np.array([_relative_error(left[name]) for name in both])
    factor = max(1.0, float(robust.deviation((ratio - np.median(ratio, axis=0)) / stated)))
    return {
        n: StrengthReadings(*(_wider(one, factor) for one in (r.patch, r.paper, r.black)))
        for n, r in left.items()
    }


def _log_ratios(readings: Mapping[str, StrengthReadings]) -> dict[str, np.ndarray]:
    """Logarithm (c,) of the patch over the paper in views where both are read."""
    told = {n: r.both for n, r in readings.items() if r.both is not None}
    return {n: np.log(patch.value / paper.value) for n, (patch, paper) in told.items()}


def _relative_error(reading: StrengthReadings) -> np.ndarray:
    """Error (c,) of the logarithm of the patch over the paper."""
    assert reading.both is not None
    patch, paper = reading.both
    return np.hypot(patch.error / patch.value, paper.error / paper.value)


def _wider(one: Strength | NoStrength, factor: float) -> Strength | NoStrength:
    return replace(one, error=factor * one.error) if isinstance(one, Strength) else one


def _with_black_print(readings: Mapping[str, StrengthReadings]) -> Readings:
    """Where the white paper is clipped the black print stands in for it, by their ratio in the other views."""
    both = [
        r.black.value / r.paper.value
        for r in readings.values()
        if r.black.value is not None and r.paper.value is not None
    ]
    left = dict(readings)
    if not both:
        return left
    ratio = np.median(both, axis=0)
    spread = robust.deviation(np.array(both) / ratio - 1, axis=0)
    for name, r in readings.items():
        if isinstance(r.paper, NoStrength) and isinstance(r.black, Strength):
            value = r.black.value / ratio
            error = np.hypot(r.black.error / ratio, spread * value)
            left[name] = replace(r, paper=Strength(value, error, r.black.pull))
    return left


def _with_uneven(readings: Readings, remarks: Remarks) -> Readings:
    """Unevenly lit patches for a set that has no others: a rough scale is better than none."""
    if any(isinstance(r.patch, Strength) for r in readings.values()):
        return readings
    refused = {n: r.patch for n, r in readings.items() if isinstance(r.patch, NoStrength)}
    rough = {n: one.rough for n, one in refused.items() if one.rough is not None}
    if not rough:
        return readings
    doubt = float(np.median([(one.error / one.value).max() for one in rough.values()]))
    remarks.residuals["uneven_patches_error"] = doubt
    remarks.tell(
        "patches-uneven",
        f"no white patch is evenly lit in any photo: the scale is by {len(rough)} that are not, by {doubt:.0%} in "
        "themselves, and as unsure; keep shadows, reflections and the edge of the lamp's beam off them",
        amount=doubt,
    )
    return {n: replace(r, patch=rough[n]) if n in rough else r for n, r in readings.items()}


def _without_unsharp(readings: Readings, remarks: Remarks) -> Readings:
    """Without paper whose white has spread over black print: it is darker than the patch has it, which is larger,
    and the black is lighter. A patch that is brighter than it should be leaves black as it is."""
    told = {
        n: (*r.both, r.black)
        for n, r in readings.items()
        if r.both is not None and isinstance(r.black, Strength)
    }
    names, left = list(told), dict(readings)
    if len(names) < _FEW:
        return left
    lost = np.array([float(np.log(patch.value / paper.value).mean()) for patch, paper, _ in told.values()])
    gained = np.array([float((black.value / paper.value).mean()) for _, paper, black in told.values()])
    lost, gained = lost - np.median(lost), gained - np.median(gained)
    scatter, chance = (float(robust.deviation(one)) for one in (lost, gained))
    blurred = (lost > WORST * max(scatter, _PAPER_VARIES)) & (
        gained > np.maximum(_SPREAD * lost, WORST * chance)
    )
    for k in np.flatnonzero(blurred):
        remarks.tell(
            "paper-unsharp",
            f"{names[k]}: its paper is not believed: beside the patch it is {-np.expm1(-lost[k]):.0%} darker than in "
            f"the other photos, and black print {gained[k]:.1%} of white lighter; out of focus, or shaken?",
            views=(names[k],),
            amount=float(lost[k]),
        )
        unsharp = NoStrength("the print is not sharp")
        left[names[k]] = replace(left[names[k]], paper=unsharp, black=unsharp)
    return left


def _without_false(readings: Readings, remarks: Remarks) -> Readings:
    """Without patches that contradict the paper as the others see it, or make it whiter than white."""
    both = {n: float(ratio.mean()) for n, ratio in _log_ratios(readings).items()}
    least = np.log(np.pi / _WHITEST)  # pi over the paper's reflectance: the patch's value over the paper's
    possible = [v for v in both.values() if v > least]
    refused = {
        n: f"it makes the paper {np.pi / np.exp(v):.2f} times as bright as a perfect white; does it lie in shadow?"
        for n, v in both.items()
        if v <= least
    }
    if possible:
        many = len(possible) >= _FEW
        middle = float(np.median(possible)) if many else max(possible)
        spread = float(robust.deviation(np.array(possible) - middle)) if many else 0.0
        refused |= {
            n: f"it is {100 * np.expm1(v - middle):+.0f} % off what the paper says"
            for n, v in both.items()
            if v > least and abs(v - middle) > WORST * max(spread, _PAPER_VARIES)
        }
    left = dict(readings)
    for name, why in refused.items():
        problem = f"{_REFUSED}: {why}"
        remarks.tell("patch-not-believed", f"{name}: {problem}", views=(name,))
        left[name] = replace(left[name], patch=NoStrength(problem))
    return left


def _tell_scatter(ratio: np.ndarray, remarks: Remarks) -> None:
    """Patch and paper lie under one lamp, and keep one ``ratio`` (n, c), of which this is the logarithm: where they do
    not, photos are not what they are taken for."""
    scatter = float(robust.scatter(ratio, axis=0).max())
    if scatter > _NO_RATIO:
        remarks.tell(
            "patch-and-paper-scatter",
            f"the white patch is not always as bright beside the board's paper: their ratio scatters by {scatter:.0%} "
            "from photo to photo. So it does if photos are not encoded as the manifest says (JPEG, and PNG of 8 bits, "
            "mostly are sRGB), if the paper is glossy or not flat, or if lights are not where they are taken to be",
            amount=scatter,
            least=_NO_RATIO,
        )


def tell_unused(readings: Mapping[str, StrengthReadings], remarks: Remarks) -> None:
    """One warning for each reason why a patch was not used; those not believed have theirs."""
    problems = {
        n: r.patch.problem for n, r in readings.items() if r.patch.problem and r.patch.problem != NO_PATCH
    }
    if problems:
        remarks.residuals["patches_not_used"] = problems
    for why in sorted({p for p in problems.values() if not p.startswith(_REFUSED)}):
        code, names = "patches-not-used", [n for n, p in problems.items() if p == why]
        if why == DARKER and len(names) >= max(_MOSTLY * len(readings), _FEW):
            code = "patches-contradict"
            why = "white patches contradict one another, and the brightest for its reflectance is believed: check them"
        remarks.tell(
            code,
            f"{why}, in {len(names)} of {len(readings)} photos ({listed(names)})",
            views=tuple(names),
            amount=len(names),
        )
