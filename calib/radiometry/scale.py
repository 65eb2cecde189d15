"""How strongly each view's lamp shines: the white patch, the board's paper tied to it, lamps of known strength."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from photogonio.calib.adjust.alternate import Settled
from photogonio.calib.detect.observation import Sight
from photogonio.calib.radiometry.patch import (
    LEAST_TILT,
    Stray,
    Strength,
    light_shape,
    no_strength,
    read_paper,
    read_patch,
)
from photogonio.calib.remarks import Notes, listed
from photogonio.calib.setup import Light
from photogonio.calib.shading.fit import Reading as Paper
from photogonio.calib.shading.fit import Scene
from photogonio.calib.shading.interreflection import diffuse_bounce
from photogonio.calib.shading.parameters import TILTS
from photogonio.capture.photoset import PhotoSet, Plane
from photogonio.capture.radiance import RadianceImage

_WORST = 4.0  # standard errors beyond which a patch is not believed against the others
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
_ALIKE = 0.03  # relative difference of patches in one photo
# relative scatter of patch over paper from photo to photo that is told; path-traced sets in order have 0.003 to 0.01,
# with a wrong encoding 0.04 and more
_NO_RATIO = 0.025
_REFUSED = "the patch is not believed"
_DARKER = "a patch is much darker than another: not believed"
_MOSTLY = 0.75  # of the photos: a patch that is too dark in as many lies in no shadow
_NO_PATCH = "the set has no white patch"
_SEEN = 0.999  # share of the lamp that a place must see
_FEW_SAMPLES = 300


@dataclass(frozen=True, slots=True)
class Reading:
    """One view's readings, as strengths of the lamp times what is not known of the surface."""

    patch: Strength  # the lamp's own: the patch's reflectance is known
    paper: Strength  # times the white paper's reflectance over pi
    black: Strength  # times the black print's


@dataclass(frozen=True, slots=True)
class Tied:
    """The strength of one view's lamp."""

    value: np.ndarray  # (c,)
    error: np.ndarray  # (c,)
    source: str


def read_view(
    photoset: PhotoSet, image: RadianceImage, settled: Settled, sight: Sight, light: Light
) -> Reading:
    """What patch and paper of one view say."""
    paper = sight.reading
    stray = None if paper is None else stray_light(settled, sight, paper, light)
    readings = []
    for patch in photoset.white_patches:
        one = read_patch(image, settled.camera, sight.pose, light, patch, stray)
        readings.append(_of_lamp(one, np.asarray(patch.reflectance, float)))
    good = [r for r in readings if r.value is not None]
    refused = sorted(readings, key=lambda r: r.rough is None)  # what tells something in spite of it first
    patch = _mean(good) if good else (*refused, no_strength(_NO_PATCH))[0]
    if paper is None:
        return Reading(patch, no_strength("no paper is seen"), no_strength("no print is seen"))
    shown = light_shape(paper.samples.points, light, stray)
    tones = (read_paper(paper, light, stray, white=tone, shown=shown) for tone in (True, False))
    return Reading(patch, *tones)


def _of_lamp(one: Strength, reflectance: np.ndarray) -> Strength:
    """A patch's reading without what its reflectance did to it."""
    rough = None if one.rough is None else _of_lamp(one.rough, reflectance)
    if one.value is None:
        return replace(one, rough=rough)
    factor = np.pi / np.broadcast_to(reflectance, one.value.shape)
    return Strength(one.value * factor, one.error * factor, one.pull)


def stray_light(settled: Settled, sight: Sight, paper: Paper, light: Light) -> Stray | None:
    """The light beside the direct one that shading found in this view, whose ``paper`` was read."""
    if settled.scene is None or sight.shading is None or light.kind != "point":
        return None
    points = paper.samples.points
    toward, falloff = light.toward(points)
    even = float(np.median(np.clip(toward[:, 2], 0, None) * falloff))
    tilt = aimed(settled.scene, paper, sight.shading[TILTS])
    stray = Stray(settled.scene, np.clip(sight.shading[4:7], 0.0, None), even, tilt)
    return replace(stray, amounts=_coloured(stray, paper, light))


def aimed(scene: Scene, paper: Paper, tilts: np.ndarray) -> tuple[float, float, float]:
    """The tilt of a narrow lamp's light by ``tilts`` (2,) over its paper, 1 where the lamp is taken to point: one that
    points beside it lights one side of the board more. What little tilt other lamps' light has may as well be the
    paper's or the lens's, and stays."""
    if scene.narrow == 0.0:
        return 1.0, 0.0, 0.0
    low, high = paper.span
    slope = 2 * tilts / (high - low)
    slope = slope / max(1.0 + slope @ (np.array(scene.aim[:2]) - (low + high) / 2), LEAST_TILT)
    return (float(1.0 - slope @ scene.aim[:2]), *slope.tolist())


def _coloured(stray: Stray, reading: Paper, light: Light) -> np.ndarray:
    """The amounts (3, c) channel by channel: a coloured sample throws coloured light.

    Shading was fitted to the mean of the channels. Each channel over that fit is one constant but for the diffuse
    bounce's share, in which channels may differ; what all of them have in common is a misfit, and stays out of it.
    """
    channels = reading.samples.value.shape[1]
    amounts = np.repeat(stray.amounts[:, None], channels, axis=1)
    if channels == 1 or stray.scene.sample is None:
        return amounts
    ball, points = stray.scene.sample, reading.samples.points
    shape, share = light_shape(points, light, stray)
    good = reading.samples.white & (share > _SEEN) & (shape[:, 0] > 0)
    if good.sum() < _FEW_SAMPLES:
        return amounts
    shape = shape[good, 0]
    thrown = diffuse_bounce(points[good], light.place, ball.center, ball.radius) / shape
    design = np.column_stack([np.ones(len(thrown)), thrown])
    ratio = reading.samples.value[good] / shape[:, None]
    ratio /= np.median(ratio, axis=0)
    off = np.zeros(channels)
    for c in range(channels):
        values = _robust_line(design, ratio[:, c])
        off[c] = values[1] / values[0]
    amounts[0] = np.clip(amounts[0] + off - off.mean(), 0.0, 1.0)
    return amounts


def _robust_line(design: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Least squares without what lies three scatters off, three times."""
    kept = np.ones(len(values), bool)
    for _ in range(3):
        found = np.linalg.lstsq(design[kept], values[kept], rcond=None)[0]
        miss = np.abs(values - design @ found)
        kept = miss <= 3 * 1.4826 * float(np.median(miss)) + 1e-12
    return found


def _mean(readings: list[Strength]) -> Strength:
    """Several patches of one view: those much darker than the brightest lie in shadow, or are hidden."""
    best = max(readings, key=lambda r: float(np.log(r.value).mean()))
    alike = [r for r in readings if (r.value > best.value * (1 - _ALIKE) - _WORST * r.error).all()]
    weight = np.array([r.error**-2.0 for r in alike])
    total = weight.sum(0)
    value = sum(w * r.value for w, r in zip(weight, alike, strict=True)) / total
    pull = np.mean([r.pull for r in alike], axis=0)
    dropped = len(readings) - len(alike)
    return Strength(value, np.sqrt(1 / total), pull, _DARKER if dropped else "")


def tie(
    photoset: PhotoSet,
    readings: dict[str, Reading],
    lights: dict[str, Light],
    given: dict[str, np.ndarray],
    notes: Notes,
) -> tuple[dict[str, Tied], str]:
    """Strength of every view's lamp, and whether the scale is "absolute".

    ``given`` are the manifest's relative strengths (c,) of each view's lamp.
    """
    _whiten(readings)
    _make_do(readings, notes)
    _leave_unsharp(readings, notes)
    _disbelieve(readings, notes)
    _tell_scatter(readings, notes)
    _widen(readings)
    middle = _middle(photoset)
    ratio = _paper_to_patch(readings)
    absolute = any(r.patch.value is not None for r in readings.values())
    tied: dict[str, Tied] = {}
    for name, reading in readings.items():
        options = []
        if reading.patch.value is not None:
            options.append(
                (reading.patch.value, _whole_error(reading.patch, lights[name], middle), "white patch")
            )
        if reading.paper.value is not None and (ratio is not None or not absolute):
            factor, doubt = ratio if ratio is not None else (np.pi, 0.0)
            error = np.hypot(
                _whole_error(reading.paper, lights[name], middle) * factor, doubt * reading.paper.value
            )
            options.append((reading.paper.value * factor, error, "board"))
        if options:
            tied[name] = _combine(options)
    if not tied or (not absolute and _explicit(given)):
        return _as_told(photoset, readings, given, notes), "relative"
    _note_scale(readings, tied, ratio, notes)
    _fill(readings, tied, given, notes)
    return _equal_lamps(tied, lights, middle, notes), "absolute" if absolute else "relative"


def _as_told(
    photoset: PhotoSet, readings: dict[str, Reading], given: dict[str, np.ndarray], notes: Notes
) -> dict[str, Tied]:
    """Lamps in the proportions that the manifest states, which are equal ones where it states none: more or less, if
    patches or a board's paper were there to measure them and cannot be read.

    Where paper is read they are all put on its scale, so that what shines beside them can be weighed against them.
    """
    unread = not _explicit(given) and (photoset.board is not None or bool(photoset.white_patches))
    doubt = _UNMEASURED if unread else 0.0
    _note_scale(readings, {}, None, notes)
    if unread:
        notes.warnings.append(
            "neither white patch nor paper can be read in any photo: all lamps are taken as equally strong"
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


def _paper_to_patch(readings: dict[str, Reading]) -> tuple[np.ndarray, np.ndarray] | None:
    """pi over the paper's reflectance (c,) as the good patches tell it, and its standard error."""
    ratios = np.array(
        [
            r.patch.value / r.paper.value
            for r in readings.values()
            if r.patch.value is not None and r.paper.value is not None
        ]
    )
    if len(ratios) == 0:
        return None
    middle = np.median(ratios, axis=0)
    spread = 1.4826 * np.median(np.abs(ratios - middle), axis=0)
    return middle, np.maximum(1.2533 * spread, 0.003 * middle) / np.sqrt(len(ratios))


def _make_do(readings: dict[str, Reading], notes: Notes) -> None:
    """Unevenly lit patches for a set that has no others: a rough scale is better than none."""
    rough = {n: r.patch.rough for n, r in readings.items() if r.patch.rough is not None}
    if not rough or any(r.patch.value is not None for r in readings.values()):
        return
    doubt = float(np.median([(one.error / one.value).max() for one in rough.values()]))
    notes.residuals["uneven_patches_error"] = doubt
    notes.warnings.append(
        f"no white patch is evenly lit in any photo: the scale is by {len(rough)} that are not, by {doubt:.0%} in "
        "themselves, and as unsure; keep shadows, reflections and the edge of the lamp's beam off them"
    )
    for name, one in rough.items():
        readings[name] = replace(readings[name], patch=one)


def _leave_unsharp(readings: dict[str, Reading], notes: Notes) -> None:
    """Leave out paper whose white has spread over black print: it is darker than the patch has it, which is larger,
    and the black is lighter. A patch that is brighter than it should be leaves black as it is."""
    known = [
        r.patch.value is not None and r.paper.value is not None and r.black.value is not None
        for r in readings.values()
    ]
    names = [name for name, all_told in zip(readings, known, strict=True) if all_told]
    if len(names) < _FEW:
        return
    told = [readings[name] for name in names]
    lost = np.array([float(np.log(r.patch.value / r.paper.value).mean()) for r in told])
    gained = np.array([float((r.black.value / r.paper.value).mean()) for r in told])
    lost, gained = lost - np.median(lost), gained - np.median(gained)
    scatter, chance = (1.4826 * float(np.median(np.abs(one))) for one in (lost, gained))
    blurred = (lost > _WORST * max(scatter, _PAPER_VARIES)) & (
        gained > np.maximum(_SPREAD * lost, _WORST * chance)
    )
    for k in np.flatnonzero(blurred):
        notes.warnings.append(
            f"{names[k]}: its paper is not believed: beside the patch it is {-np.expm1(-lost[k]):.0%} darker than in "
            f"the other photos, and black print {gained[k]:.1%} of white lighter; out of focus, or shaken?"
        )
        unsharp = no_strength("the print is not sharp")
        readings[names[k]] = replace(readings[names[k]], paper=unsharp, black=unsharp)


def _disbelieve(readings: dict[str, Reading], notes: Notes) -> None:
    """Leave out patches that contradict the paper as the others see it, or make it whiter than white."""
    both = {
        n: float(np.log(r.patch.value / r.paper.value).mean())
        for n, r in readings.items()
        if r.patch.value is not None and r.paper.value is not None
    }
    least = np.log(np.pi / _WHITEST)  # pi over the paper's reflectance: the patch's value over the paper's
    possible = [v for v in both.values() if v > least]
    for name, value in both.items():
        if value <= least:
            white = np.pi / np.exp(value)
            what = (
                f"it makes the paper {white:.2f} times as bright as a perfect white; does it lie in shadow?"
            )
            _refuse(readings, name, what, notes)
    if not possible:
        return
    middle = float(np.median(possible)) if len(possible) >= _FEW else max(possible)
    spread = 1.4826 * float(np.median(np.abs(np.array(possible) - middle))) if len(possible) >= _FEW else 0.0
    for name, value in both.items():
        if value > least and abs(value - middle) > _WORST * max(spread, _PAPER_VARIES):
            _refuse(
                readings,
                name,
                f"it is {100 * np.expm1(value - middle):+.0f} % off what the paper says",
                notes,
            )


def _tell_scatter(readings: dict[str, Reading], notes: Notes) -> None:
    """Patch and paper lie under one lamp, and keep one ratio: where they do not, photos are not what they are taken
    for."""
    both = [r for r in readings.values() if r.patch.value is not None and r.paper.value is not None]
    if len(both) < _FEW:
        return
    log = np.array([np.log(r.patch.value / r.paper.value) for r in both])
    scatter = 1.4826 * float(np.median(np.abs(log - np.median(log, axis=0)), axis=0).max())
    if scatter > _NO_RATIO:
        notes.warnings.append(
            f"the white patch is not always as bright beside the board's paper: their ratio scatters by {scatter:.0%} "
            "from photo to photo. So it does if photos are not encoded as the manifest says (JPEG, and PNG of 8 bits, "
            "mostly are sRGB), if the paper is glossy or not flat, or if lights are not where they are taken to be"
        )


def _widen(readings: dict[str, Reading]) -> None:
    """Larger errors where patch and paper scatter against one another by more than theirs explain."""
    both = [r for r in readings.values() if r.patch.value is not None and r.paper.value is not None]
    if len(both) < _FEW:
        return
    log = np.array([np.log(r.patch.value / r.paper.value) for r in both])
    stated = np.array([np.hypot(r.patch.error / r.patch.value, r.paper.error / r.paper.value) for r in both])
    factor = 1.4826 * float(np.median(np.abs(log - np.median(log, axis=0)) / stated))
    if factor <= 1.0:
        return
    for name, r in readings.items():
        readings[name] = Reading(*(_wider(one, factor) for one in (r.patch, r.paper, r.black)))


def _wider(one: Strength, factor: float) -> Strength:
    return one if one.value is None else replace(one, error=factor * one.error)


def _refuse(readings: dict[str, Reading], name: str, why: str, notes: Notes) -> None:
    problem = f"{_REFUSED}: {why}"
    notes.warnings.append(f"{name}: {problem}")
    readings[name] = replace(readings[name], patch=no_strength(problem))


def _whiten(readings: dict[str, Reading]) -> None:
    """Where the white paper is clipped the black print stands in for it, by their ratio in the other views."""
    both = [
        r.black.value / r.paper.value
        for r in readings.values()
        if r.black.value is not None and r.paper.value is not None
    ]
    if not both:
        return
    ratio = np.median(both, axis=0)
    spread = 1.4826 * np.median(np.abs(np.array(both) / ratio - 1), axis=0)
    for name, r in readings.items():
        if r.paper.value is None and r.black.value is not None:
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
    readings: dict[str, Reading], tied: dict[str, Tied], given: dict[str, np.ndarray], notes: Notes
) -> None:
    """Lamps that nothing measures: as strong as the others, in the proportions the manifest states."""
    missing = [n for n in readings if n not in tied]
    if not missing:
        return
    factors = np.array([t.value / given[n] for n, t in tied.items()])
    middle = np.median(factors, axis=0)
    spread = np.maximum(1.4826 * np.median(np.abs(factors - middle), axis=0), _UNMEASURED * middle)
    for name in missing:
        reading = readings[name]
        notes.warnings.append(
            f"{name}: {reading.patch.problem}; {reading.paper.problem}: its lamp is taken as the others"
        )
        tied[name] = Tied(middle * given[name], spread * given[name], "intensity")


def _equal_lamps(
    tied: dict[str, Tied], lights: dict[str, Light], middle: np.ndarray, notes: Notes
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
    scatter = float((1.4826 * np.median(np.abs(values / common - 1), axis=0)).max())
    expected = float(np.median(errors / values))
    notes.residuals["lamp_strength_scatter"] = scatter
    if scatter > max(1.2 * expected, _EQUAL) or scatter > 0.02:
        return tied
    notes.residuals["lamps_taken_as_equal"] = True
    error = np.maximum(1.2533 * scatter * common / np.sqrt(len(values)), 0.002 * common)
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
    readings: dict[str, Reading],
    tied: dict[str, Tied],
    ratio: tuple[np.ndarray, np.ndarray] | None,
    notes: Notes,
) -> None:
    problems = {
        n: r.patch.problem for n, r in readings.items() if r.patch.problem and r.patch.problem != _NO_PATCH
    }
    if problems:
        notes.residuals["patches_not_used"] = problems
        _tell_problems(problems, len(readings), notes)
    if ratio is not None:
        notes.residuals["paper_reflectance"] = (np.pi / ratio[0]).tolist()
        notes.residuals["paper_reflectance_error"] = (np.pi / ratio[0] ** 2 * ratio[1]).tolist()


def _tell_problems(problems: dict[str, str], total: int, notes: Notes) -> None:
    """One warning for each reason why a patch was not used; those not believed have theirs."""
    for why in sorted({p for p in problems.values() if not p.startswith(_REFUSED)}):
        names = [n for n, p in problems.items() if p == why]
        if why == _DARKER and len(names) >= max(_MOSTLY * total, _FEW):
            why = "white patches contradict one another, and the brightest for its reflectance is believed: check them"
        notes.warnings.append(f"{why}, in {len(names)} of {total} photos ({listed(names)})")
