"""How strongly each view's lamp shines: the white patch, the board's paper tied to it, lamps of known strength."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from photogonio.calib.radiometry.patch import (
    NoStrength,
    Strength,
)
from photogonio.calib.radiometry.readings import DARKER, NO_PATCH, WORST, StrengthReadings
from photogonio.calib.remarks import Remarks, listed
from photogonio.calib.setup import Light
from photogonio.capture import robust
from photogonio.capture.photoset import PhotoSet, Plane

# of the light that white paper lost to blur: what black print, which is read farther from its edges, gained at the
# least; by 2.5 pixels of blur it gained 0.08
_SPREAD = 0.03
_FEW = 4  # patches that can outvote one; with fewer the brightest counts, since shadows only darken
_WHITEST = 1.08  # reflectance above which paper cannot be: the patch that says so lies in shadow
_PAPER_VARIES = 0.01  # relative: how far paper and patch may differ from view to view at the least
_UNMEASURED = (
    0.02  # relative error of lamps that are taken as equal since what should measure them cannot be read
)
_EQUAL = 0.004  # relative scatter up to which lamps may be taken as equal
_APART = 3.0  # standard errors by which a view's lamp differs from one that all have in common
# relative scatter of patch over paper from photo to photo that is told; path-traced sets in order have 0.003 to 0.01,
# with a wrong encoding 0.04 and more
_NO_RATIO = 0.025
_REFUSED = "the patch is not believed"
_MOSTLY = 0.75  # of the photos: a patch that is too dark in as many lies in no shadow


@dataclass(frozen=True, slots=True)
class Tied:
    """The strength of one view's lamp."""

    value: np.ndarray  # (c,)
    error: np.ndarray  # (c,)
    source: str


def tie(
    photoset: PhotoSet,
    readings: dict[str, StrengthReadings],
    lights: dict[str, Light],
    given: dict[str, np.ndarray],
    remarks: Remarks,
) -> tuple[dict[str, Tied], str]:
    """Strength of every view's lamp, and whether the scale is "absolute".

    ``given`` are the manifest's relative strengths (c,) of each view's lamp.
    """
    _whiten(readings)
    _make_do(readings, remarks)
    _leave_unsharp(readings, remarks)
    _disbelieve(readings, remarks)
    _tell_scatter(readings, remarks)
    _widen(readings)
    middle = _middle(photoset)
    ratio = _paper_to_patch(readings)
    absolute = any(r.patch.value is not None for r in readings.values())
    tied: dict[str, Tied] = {}
    for name, reading in readings.items():
        options = []
        patch, paper = reading.patch, reading.paper
        if isinstance(patch, Strength):
            options.append((patch.value, _whole_error(patch, lights[name], middle), "white patch"))
        if isinstance(paper, Strength) and (ratio is not None or not absolute):
            factor, doubt = ratio if ratio is not None else (np.pi, 0.0)
            error = np.hypot(_whole_error(paper, lights[name], middle) * factor, doubt * paper.value)
            options.append((paper.value * factor, error, "board"))
        if options:
            tied[name] = _combine(options)
    if not tied or (not absolute and _explicit(given)):
        return _as_told(photoset, readings, given, remarks), "relative"
    _note_scale(readings, tied, ratio, remarks)
    _fill(readings, tied, given, remarks)
    return _equal_lamps(tied, lights, middle, remarks), "absolute" if absolute else "relative"


def _as_told(
    photoset: PhotoSet, readings: dict[str, StrengthReadings], given: dict[str, np.ndarray], remarks: Remarks
) -> dict[str, Tied]:
    """Lamps in the proportions that the manifest states, which are equal ones where it states none: more or less, if
    patches or a board's paper were there to measure them and cannot be read.

    Where paper is read they are all put on its scale, so that what shines beside them can be weighed against them.
    """
    unread = not _explicit(given) and (photoset.board is not None or bool(photoset.white_patches))
    doubt = _UNMEASURED if unread else 0.0
    _note_scale(readings, {}, None, remarks)
    if unread:
        remarks.tell(
            "lamps-unmeasured",
            "neither white patch nor paper can be read in any photo: all lamps are taken as equally strong",
        )
    lit = [np.pi * r.paper.value / given[n] for n, r in readings.items() if r.paper.value is not None]
    common, source = (np.median(lit, axis=0), "board") if lit else (1.0, "intensity")
    return {n: Tied(common * v, doubt * common * v, source) for n, v in given.items()}


def _explicit(given: dict[str, np.ndarray]) -> bool:
    """Whether the manifest states strengths that differ."""
    return float(np.ptp(np.concatenate(list(given.values())))) > 0


def _middle(photoset: PhotoSet) -> np.ndarray:
    sample = photoset.sample
    if isinstance(sample, Plane):
        return np.append(np.asarray(sample.outline, float).mean(0), sample.height)
    return np.asarray(sample.center, float)


def _whole_error(strength: Strength, light: Light, middle: np.ndarray) -> np.ndarray:
    """The reading's error and what the lamp's place adds to the light at the sample."""
    geometry = _by_place(light, middle, strength.pull)
    return np.hypot(strength.error, geometry * strength.value)


def _by_place(light: Light, middle: np.ndarray, pull: np.ndarray | float = 0.0) -> float:
    """Relative error of the light at the sample's ``middle`` by the lamp's place; ``pull`` is what a reading of its
    strength changes with the place, relative: both mostly make up for one another."""
    if light.kind != "point":
        return 0.0
    offset = light.place - middle
    slope = -2 * offset / (offset @ offset) - pull
    return float(np.sqrt(max(slope @ light.covariance @ slope, 0.0)))


def _paper_to_patch(readings: dict[str, StrengthReadings]) -> tuple[np.ndarray, np.ndarray] | None:
    """pi over the paper's reflectance (c,) as the good patches tell it, and its standard error."""
    both = [r.both for r in readings.values() if r.both is not None]
    ratios = np.array([patch.value / paper.value for patch, paper in both])
    if len(ratios) == 0:
        return None
    middle = np.median(ratios, axis=0)
    spread = robust.deviation(ratios - middle, axis=0)
    return middle, np.maximum(robust.OF_MEDIAN * spread, 0.003 * middle) / np.sqrt(len(ratios))


def _make_do(readings: dict[str, StrengthReadings], remarks: Remarks) -> None:
    """Unevenly lit patches for a set that has no others: a rough scale is better than none."""
    if any(isinstance(r.patch, Strength) for r in readings.values()):
        return
    refused = {n: r.patch for n, r in readings.items() if isinstance(r.patch, NoStrength)}
    rough = {n: one.rough for n, one in refused.items() if one.rough is not None}
    if not rough:
        return
    doubt = float(np.median([(one.error / one.value).max() for one in rough.values()]))
    remarks.residuals["uneven_patches_error"] = doubt
    remarks.tell(
        "patches-uneven",
        f"no white patch is evenly lit in any photo: the scale is by {len(rough)} that are not, by {doubt:.0%} in "
        "themselves, and as unsure; keep shadows, reflections and the edge of the lamp's beam off them",
        amount=doubt,
    )
    for name, one in rough.items():
        readings[name] = replace(readings[name], patch=one)


def _leave_unsharp(readings: dict[str, StrengthReadings], remarks: Remarks) -> None:
    """Leave out paper whose white has spread over black print: it is darker than the patch has it, which is larger,
    and the black is lighter. A patch that is brighter than it should be leaves black as it is."""
    told = {
        n: (*r.both, r.black)
        for n, r in readings.items()
        if r.both is not None and isinstance(r.black, Strength)
    }
    names = list(told)
    if len(names) < _FEW:
        return
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
        readings[names[k]] = replace(readings[names[k]], paper=unsharp, black=unsharp)


def _disbelieve(readings: dict[str, StrengthReadings], remarks: Remarks) -> None:
    """Leave out patches that contradict the paper as the others see it, or make it whiter than white."""
    told = {n: r.both for n, r in readings.items() if r.both is not None}
    both = {n: float(np.log(patch.value / paper.value).mean()) for n, (patch, paper) in told.items()}
    least = np.log(np.pi / _WHITEST)  # pi over the paper's reflectance: the patch's value over the paper's
    possible = [v for v in both.values() if v > least]
    for name, value in both.items():
        if value <= least:
            white = np.pi / np.exp(value)
            what = (
                f"it makes the paper {white:.2f} times as bright as a perfect white; does it lie in shadow?"
            )
            _refuse(readings, name, what, remarks)
    if not possible:
        return
    middle = float(np.median(possible)) if len(possible) >= _FEW else max(possible)
    spread = float(robust.deviation(np.array(possible) - middle)) if len(possible) >= _FEW else 0.0
    for name, value in both.items():
        if value > least and abs(value - middle) > WORST * max(spread, _PAPER_VARIES):
            _refuse(
                readings,
                name,
                f"it is {100 * np.expm1(value - middle):+.0f} % off what the paper says",
                remarks,
            )


def _tell_scatter(readings: dict[str, StrengthReadings], remarks: Remarks) -> None:
    """Patch and paper lie under one lamp, and keep one ratio: where they do not, photos are not what they are taken
    for."""
    both = [r.both for r in readings.values() if r.both is not None]
    if len(both) < _FEW:
        return
    log = np.array([np.log(patch.value / paper.value) for patch, paper in both])
    scatter = float(robust.scatter(log, axis=0).max())
    if scatter > _NO_RATIO:
        remarks.tell(
            "patch-and-paper-scatter",
            f"the white patch is not always as bright beside the board's paper: their ratio scatters by {scatter:.0%} "
            "from photo to photo. So it does if photos are not encoded as the manifest says (JPEG, and PNG of 8 bits, "
            "mostly are sRGB), if the paper is glossy or not flat, or if lights are not where they are taken to be",
            amount=scatter,
            least=_NO_RATIO,
        )


def _widen(readings: dict[str, StrengthReadings]) -> None:
    """Larger errors where patch and paper scatter against one another by more than theirs explain."""
    both = [r.both for r in readings.values() if r.both is not None]
    if len(both) < _FEW:
        return
    log = np.array([np.log(patch.value / paper.value) for patch, paper in both])
    stated = np.array([np.hypot(*(one.error / one.value for one in pair)) for pair in both])
    factor = float(robust.deviation((log - np.median(log, axis=0)) / stated))
    if factor <= 1.0:
        return
    for name, r in readings.items():
        readings[name] = StrengthReadings(*(_wider(one, factor) for one in (r.patch, r.paper, r.black)))


def _wider(one: Strength | NoStrength, factor: float) -> Strength | NoStrength:
    return replace(one, error=factor * one.error) if isinstance(one, Strength) else one


def _refuse(readings: dict[str, StrengthReadings], name: str, why: str, remarks: Remarks) -> None:
    problem = f"{_REFUSED}: {why}"
    remarks.tell("patch-not-believed", f"{name}: {problem}", views=(name,))
    readings[name] = replace(readings[name], patch=NoStrength(problem))


def _whiten(readings: dict[str, StrengthReadings]) -> None:
    """Where the white paper is clipped the black print stands in for it, by their ratio in the other views."""
    both = [
        r.black.value / r.paper.value
        for r in readings.values()
        if r.black.value is not None and r.paper.value is not None
    ]
    if not both:
        return
    ratio = np.median(both, axis=0)
    spread = robust.deviation(np.array(both) / ratio - 1, axis=0)
    for name, r in readings.items():
        if isinstance(r.paper, NoStrength) and isinstance(r.black, Strength):
            value = r.black.value / ratio
            error = np.hypot(r.black.error / ratio, spread * value)
            readings[name] = replace(r, paper=Strength(value, error, r.black.pull))


def _combine(options: list[tuple[np.ndarray, np.ndarray, str]]) -> Tied:
    if len(options) == 1:
        return Tied(*options[0])
    weight = [1 / np.maximum(e, 1e-12) ** 2 for _, e, _ in options]
    total = sum(weight)
    value = sum(w * v for w, (v, _, _) in zip(weight, options, strict=True)) / total
    apart = np.abs(options[0][0] - options[1][0]) / 2
    return Tied(value, np.maximum(np.sqrt(1 / total), 0.3 * apart), options[0][2])


def _fill(
    readings: dict[str, StrengthReadings],
    tied: dict[str, Tied],
    given: dict[str, np.ndarray],
    remarks: Remarks,
) -> None:
    """Lamps that nothing measures: as strong as the others, in the proportions the manifest states."""
    missing = [n for n in readings if n not in tied]
    if not missing:
        return
    factors = np.array([t.value / given[n] for n, t in tied.items()])
    middle = np.median(factors, axis=0)
    spread = np.maximum(robust.deviation(factors - middle, axis=0), _UNMEASURED * middle)
    for name in missing:
        reading = readings[name]
        remarks.tell(
            "lamp-taken-as-others",
            f"{name}: {reading.patch.problem}; {reading.paper.problem}: its lamp is taken as the others",
            views=(name,),
        )
        tied[name] = Tied(middle * given[name], spread * given[name], "intensity")


def _equal_lamps(
    tied: dict[str, Tied], lights: dict[str, Light], middle: np.ndarray, remarks: Remarks
) -> dict[str, Tied]:
    """If all lamps agree as far as they are measured they are one lamp, and each view takes the mean along.

    A view whose own reading contradicts the mean keeps it: its lamp shone otherwise, or stands elsewhere than is
    thought, of which the reading in the same photo makes up for most.
    """
    values = np.array([t.value for t in tied.values()])
    errors = np.array([t.error for t in tied.values()])
    if len(values) < 5:
        return tied
    common = np.median(values, axis=0)
    scatter = float(robust.deviation(values / common - 1, axis=0).max())
    expected = float(np.median(errors / values))
    remarks.residuals["lamp_strength_scatter"] = scatter
    if scatter > max(1.2 * expected, _EQUAL) or scatter > 0.02:
        return tied
    remarks.residuals["lamps_taken_as_equal"] = True
    error = np.maximum(robust.median_error(scatter * common, len(values)), 0.002 * common)
    return {name: _joined(one, common, error, _by_place(lights[name], middle)) for name, one in tied.items()}


def _joined(own: Tied, common: np.ndarray, error: np.ndarray, geometry: float) -> Tied:
    """A view's own reading and the strength that all have in common, if they agree."""
    doubt = np.hypot(error, geometry * common)
    if (np.abs(own.value - common) > _APART * np.hypot(own.error, doubt)).any():
        return own
    weight, other = np.maximum(own.error, 1e-12 * common) ** -2.0, doubt**-2.0
    value = (weight * own.value + other * common) / (weight + other)
    return Tied(value, np.maximum((weight + other) ** -0.5, error), own.source)


def _note_scale(
    readings: dict[str, StrengthReadings],
    tied: dict[str, Tied],
    ratio: tuple[np.ndarray, np.ndarray] | None,
    remarks: Remarks,
) -> None:
    problems = {
        n: r.patch.problem for n, r in readings.items() if r.patch.problem and r.patch.problem != NO_PATCH
    }
    if problems:
        remarks.residuals["patches_not_used"] = problems
        _tell_problems(problems, len(readings), remarks)
    if ratio is not None:
        remarks.residuals["paper_reflectance"] = (np.pi / ratio[0]).tolist()
        remarks.residuals["paper_reflectance_error"] = (np.pi / ratio[0] ** 2 * ratio[1]).tolist()


def _tell_problems(problems: dict[str, str], total: int, remarks: Remarks) -> None:
    """One warning for each reason why a patch was not used; those not believed have theirs."""
    for why in sorted({p for p in problems.values() if not p.startswith(_REFUSED)}):
        code, names = "patches-not-used", [n for n, p in problems.items() if p == why]
        if why == DARKER and len(names) >= max(_MOSTLY * total, _FEW):
            code = "patches-contradict"
            why = "white patches contradict one another, and the brightest for its reflectance is believed: check them"
        remarks.tell(
            code,
            f"{why}, in {len(names)} of {total} photos ({listed(names)})",
            views=tuple(names),
            amount=len(names),
        )
