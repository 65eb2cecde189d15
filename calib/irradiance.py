"""How strongly each view's lamp shines: the white patch, the board's paper tied to it, lamps of known strength."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from calib.notes import Notes
from calib.patch import Stray, Strength, no_strength, read_paper, read_patch
from calib.setup import Light
from calib.sight import Sight
from calib.together import Settled
from capture.photoset import PhotoSet, Plane
from capture.radiance import RadianceImage

_WORST = 4.0  # standard errors beyond which a patch is not believed against the others
_PAPER_VARIES = 0.01  # relative: how far paper and patch may differ from view to view at the least
_EQUAL = 0.004  # relative scatter up to which lamps may be taken as equal
_NO_PATCH = "the set has no white patch"


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
    stray = stray_light(settled, sight, light)
    readings = []
    for patch in photoset.white_patches:
        one = read_patch(image, settled.camera, sight.pose, light, patch, stray)
        if one.value is not None:
            factor = np.pi / np.broadcast_to(np.asarray(patch.reflectance, float), one.value.shape)
            one = Strength(one.value * factor, one.error * factor, one.pull)
        readings.append(one)
    good = [r for r in readings if r.value is not None]
    patch = _mean(good) if good else (readings[0] if readings else no_strength(_NO_PATCH))
    if sight.reading is None:
        return Reading(patch, no_strength("no paper is seen"), no_strength("no print is seen"))
    return Reading(
        patch, read_paper(sight.reading, light, stray), read_paper(sight.reading, light, stray, white=False)
    )


def stray_light(settled: Settled, sight: Sight, light: Light) -> Stray | None:
    """The light beside the direct one that shading found in this view."""
    if settled.scene is None or sight.shading is None or light.kind != "point" or sight.reading is None:
        return None
    points = sight.reading.samples.points
    toward, falloff = light.toward(points)
    even = float(np.median(np.clip(toward[:, 2], 0, None) * falloff))
    return Stray(settled.scene, np.clip(sight.shading[4:7], 0.0, None), even)


def _mean(readings: list[Strength]) -> Strength:
    weight = np.array([r.error**-2.0 for r in readings])
    total = weight.sum(0)
    value = sum(w * r.value for w, r in zip(weight, readings, strict=True)) / total
    pull = np.mean([r.pull for r in readings], axis=0)
    return Strength(value, np.sqrt(1 / total), pull)


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
    _disbelieve(readings, lights, notes)
    middle = _middle(photoset)
    ratio = _paper_to_patch(readings)
    tied: dict[str, Tied] = {}
    for name, reading in readings.items():
        options = []
        if reading.patch.value is not None:
            options.append(
                (reading.patch.value, _whole_error(reading.patch, lights[name], middle), "white patch")
            )
        if reading.paper.value is not None and (ratio is not None or not photoset.white_patches):
            factor, doubt = ratio if ratio is not None else (np.pi, 0.0)
            error = np.hypot(
                _whole_error(reading.paper, lights[name], middle) * factor, doubt * reading.paper.value
            )
            options.append((reading.paper.value * factor, error, "board"))
        if options:
            tied[name] = _combine(options)
    absolute = any(r.patch.value is not None for r in readings.values())
    if not tied or (not absolute and _explicit(given)):
        equal = {n: Tied(v.copy(), np.zeros_like(v), "intensity") for n, v in given.items()}
        return equal, "relative"
    _note_scale(readings, tied, ratio, notes)
    _fill(readings, tied, given, notes)
    return _equal_lamps(tied, lights, notes), "absolute" if absolute else "relative"


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
    here = np.zeros(3)
    if light.kind == "point":
        offset = light.place - middle
        here = -2 * offset / (offset @ offset)
    pull = here - strength.pull
    geometry = float(np.sqrt(max(pull @ light.covariance @ pull, 0.0))) if light.kind == "point" else 0.0
    return np.hypot(strength.error, geometry * strength.value)


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


def _disbelieve(readings: dict[str, Reading], lights: dict[str, Light], notes: Notes) -> None:
    """Leave out patches that contradict the paper as the others see it."""
    both = {n: r for n, r in readings.items() if r.patch.value is not None and r.paper.value is not None}
    if len(both) < 4:
        return
    log = {n: np.log(r.patch.value / r.paper.value).mean() for n, r in both.items()}
    middle = float(np.median(list(log.values())))
    spread = max(1.4826 * float(np.median(np.abs(np.array(list(log.values())) - middle))), _PAPER_VARIES)
    for name, value in log.items():
        if abs(value - middle) > _WORST * spread:
            off = 100 * np.expm1(value - middle)
            problem = f"the patch is {off:+.0f} % off what the paper says: not believed"
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
    spread = np.maximum(1.4826 * np.median(np.abs(factors - middle), axis=0), 0.02 * middle)
    for name in missing:
        reading = readings[name]
        notes.warnings.append(
            f"{name}: {reading.patch.problem}; {reading.paper.problem}: its lamp is taken as the others"
        )
        tied[name] = Tied(middle * given[name], spread * given[name], "intensity")


def _equal_lamps(tied: dict[str, Tied], lights: dict[str, Light], notes: Notes) -> dict[str, Tied]:
    """If all lamps agree as far as they are measured they are one lamp: the mean is better than each."""
    values = np.array([t.value for t in tied.values()])
    errors = np.array([t.error for t in tied.values()])
    if len(values) < 5:
        return tied
    middle = np.median(values, axis=0)
    scatter = float((1.4826 * np.median(np.abs(values / middle - 1), axis=0)).max())
    expected = float(np.median(errors / values))
    notes.residuals["lamp_strength_scatter"] = scatter
    if scatter > max(1.2 * expected, _EQUAL) or scatter > 0.02:
        return tied
    notes.residuals["lamps_taken_as_equal"] = True
    error = np.maximum(1.2533 * scatter * middle / np.sqrt(len(values)), 0.002 * middle)
    return {n: Tied(middle.copy(), error, t.source) for n, t in tied.items()}


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
    if ratio is not None:
        notes.residuals["paper_reflectance"] = (np.pi / ratio[0]).tolist()
        notes.residuals["paper_reflectance_error"] = (np.pi / ratio[0] ** 2 * ratio[1]).tolist()
