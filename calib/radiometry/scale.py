"""How strongly each view's lamp shines: the white patch, the board's paper tied to it, lamps of known strength."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from photogonio.calib.radiometry.judge import Readings, believed, tell_unused
from photogonio.calib.radiometry.log_strengths import LogReading, Solution, solve
from photogonio.calib.radiometry.paper_kinds import KINDS
from photogonio.calib.radiometry.patch import Strength
from photogonio.calib.radiometry.readings import StrengthReadings
from photogonio.calib.remarks import Remarks
from photogonio.calib.rig.gaussian import RigExpected
from photogonio.calib.setup import Light
from photogonio.capture import robust
from photogonio.capture.photoset import PhotoSet, Plane

# relative error of lamps that are taken as equal since what should measure them cannot be read
_UNMEASURED = 0.02
_MANY = 5  # lamps that tell whether all are one
_EQUAL = 0.004  # relative scatter up to which lamps may be taken as equal,
_UNEQUAL = 0.02  # and from which they may not, however unsure they are
_SAME = 0.001  # relative: how far a lamp's strength changes from photo to photo
_COMMON = 0.002  # relative error that all lamps share at the least where they are one
_EXACT = 1e-5  # of a logarithm: an error that stands elsewhere
_PAPER, _GIVEN = " paper", " given"  # unknowns beside the views: no view has such a name


@dataclass(frozen=True, slots=True)
class Tied:
    """The strength of one view's lamp."""

    value: np.ndarray  # (c,)
    error: np.ndarray  # (c,)
    source: str


def tie(
    photoset: PhotoSet,
    readings: Mapping[str, StrengthReadings],
    lights: Mapping[str, Light],
    given: Mapping[str, np.ndarray],
    remarks: Remarks,
    paper: RigExpected | None = None,
) -> tuple[dict[str, Tied], str]:
    """Strength of every view's lamp, and whether the scale is "absolute".

    ``given`` are the manifest's relative strengths (c,) of each view's lamp; ``paper`` is the logarithm of its
    reflectance (c,) as other sets of the rig have it. Where neither these nor a patch tell it, its kind does.
    """
    left = believed(readings, remarks)
    middle = _middle(photoset)
    patches = any(isinstance(r.patch, Strength) for r in left.values())
    typical = None
    if paper is None and not patches and any(isinstance(r.paper, Strength) for r in left.values()):
        paper = typical = _by_kind(photoset, given, remarks)
    absolute = patches or (paper is not None and any(isinstance(r.paper, Strength) for r in left.values()))
    rows = _read_rows(left, lights, middle, absolute=absolute, known=paper is not None)
    if paper is not None and any(_PAPER in row.unknowns for row in rows):
        rows.append(LogReading((_PAPER,), paper.value, np.sqrt(np.diag(paper.covariance))))
    if not rows or (not absolute and _explicit(given)):
        return _as_told(photoset, left, given, remarks), "relative"
    found = solve(rows)
    tell_unused(left, remarks)
    if _PAPER in found.value and typical is None:  # else these photos tell nothing of it
        white = np.exp(found.value[_PAPER])
        remarks.residuals["paper_reflectance"] = white.tolist()
        remarks.residuals["paper_reflectance_error"] = (white * found.error[_PAPER]).tolist()
    spread, least = _spread(found, given, remarks)
    unread = [name for name in given if name not in found.value]
    for name in unread:
        problems = f"{left[name].patch.problem}; {left[name].paper.problem}"
        remarks.tell(
            "lamp-taken-as-others", f"{name}: {problems}: its lamp is taken as the others", views=(name,)
        )
    if unread or least:
        found = solve([*rows, *_same_rows(given, lights, middle, spread)])
    value = {n: np.exp(found.value[n]) for n in given}
    error = {n: np.maximum(found.error[n], least) * value[n] for n in given}
    tied = {n: Tied(value[n], error[n], "intensity" if n in unread else _source(r)) for n, r in left.items()}
    return tied, "absolute" if absolute else "relative"


def _by_kind(photoset: PhotoSet, given: Mapping[str, np.ndarray], remarks: Remarks) -> RigExpected | None:
    """The logarithm of the paper's reflectance (c,) by its kind, where the manifest says it.

    How far such papers differ is not in its covariance: all photos have it in common, and it goes to the scale.
    """
    if photoset.radiometry.paper is None:
        return None
    kind = KINDS[photoset.radiometry.paper]
    remarks.tell(
        "scale-by-kind-of-paper",
        f"no white patch tells the scale: it is that of {kind.name} paper, {kind.reflectance:.2f} +- {kind.error:.2f}, "
        f"and all of f unsure by {kind.relative:.0%}",
        amount=kind.relative,
        allowed=True,
    )
    channels = len(next(iter(given.values())))
    value = np.full(channels, np.log(kind.reflectance))
    return RigExpected("paper", value, _EXACT**2 * np.eye(channels), 0)


def _source(reading: StrengthReadings) -> str:
    return "white patch" if isinstance(reading.patch, Strength) else "board"


def _read_rows(
    readings: Readings, lights: Mapping[str, Light], middle: np.ndarray, *, absolute: bool, known: bool
) -> list[LogReading]:
    """What patches and paper say. The paper's reflectance is an unknown where patches tell it, and 1 where there are
    none; where no view has both and it is not ``known``, paper says nothing."""
    told = known or any(r.both is not None for r in readings.values())
    rows = []
    for name, reading in readings.items():
        if isinstance(patch := reading.patch, Strength):
            error = _whole_error(patch, lights[name], middle)
            rows.append(LogReading((name,), np.log(patch.value), error, doubted=reading.both is not None))
        if isinstance(paper := reading.paper, Strength) and (told or not absolute):
            unknowns = (name, _PAPER) if absolute else (name,)
            rows.append(
                LogReading(unknowns, np.log(np.pi * paper.value), _whole_error(paper, lights[name], middle))
            )
    return rows


def _same_rows(
    given: Mapping[str, np.ndarray],
    lights: Mapping[str, Light],
    middle: np.ndarray,
    spread: np.ndarray | float,
) -> list[LogReading]:
    """The manifest's proportions, which hold within ``spread``. A view that contradicts the others is left alone: its
    lamp shone otherwise, or stands elsewhere than is thought, of which the reading in the same photo makes up for most.
    """
    return [
        LogReading(
            (n, _GIVEN), np.log(v), np.hypot(spread, _by_place(lights[n], middle)) * np.ones(len(v)), True
        )
        for n, v in given.items()
    ]


def _spread(
    found: Solution, given: Mapping[str, np.ndarray], remarks: Remarks
) -> tuple[np.ndarray | float, float]:
    """Relative scatter of the lamps about the proportions that the manifest states, and the error that they share at
    the least; that is 0 unless all agree as far as they are measured, and are one lamp."""
    measured = [name for name in given if name in found.value]
    off = np.array([found.value[n] - np.log(given[n]) for n in measured])
    scatter = robust.scatter(off, axis=0)
    most, expected = float(scatter.max()), float(np.median([found.error[n] for n in measured]))
    if len(given) >= _MANY:
        remarks.residuals["lamp_strength_scatter"] = most
        if most <= min(max(1.2 * expected, _EQUAL), _UNEQUAL):
            remarks.residuals["lamps_taken_as_equal"] = True
            return _SAME, _COMMON
    return np.maximum(scatter, _UNMEASURED), 0.0


def _as_told(
    photoset: PhotoSet,
    readings: Readings,
    given: Mapping[str, np.ndarray],
    remarks: Remarks,
) -> dict[str, Tied]:
    """Lamps in the proportions that the manifest states, which are equal ones where it states none: more or less, if
    patches or a board's paper were there to measure them and cannot be read.

    Where paper is read they are all put on its scale, so that what shines beside them can be weighed against them.
    """
    unread = not _explicit(given) and (photoset.board is not None or bool(photoset.white_patches))
    doubt = _UNMEASURED if unread else 0.0
    tell_unused(readings, remarks)
    if unread:
        remarks.tell(
            "lamps-unmeasured",
            "neither white patch nor paper can be read in any photo: all lamps are taken as equally strong",
        )
    lit = [np.pi * r.paper.value / given[n] for n, r in readings.items() if r.paper.value is not None]
    common, source = (np.median(lit, axis=0), "board") if lit else (1.0, "intensity")
    return {n: Tied(common * v, doubt * common * v, source) for n, v in given.items()}


def _explicit(given: Mapping[str, np.ndarray]) -> bool:
    """Whether the manifest states strengths that differ."""
    return float(np.ptp(np.concatenate(list(given.values())))) > 0


def _middle(photoset: PhotoSet) -> np.ndarray:
    sample = photoset.sample
    if isinstance(sample, Plane):
        return np.append(np.asarray(sample.outline, float).mean(0), sample.height)
    return np.asarray(sample.center, float)


def _whole_error(strength: Strength, light: Light, middle: np.ndarray) -> np.ndarray:
    """The reading's relative error (c,), and what the lamp's place adds to the light at the sample."""
    return np.hypot(strength.error / strength.value, _by_place(light, middle, strength.pull))


def _by_place(light: Light, middle: np.ndarray, pull: np.ndarray | float = 0.0) -> float:
    """Relative error of the light at the sample's ``middle`` by the lamp's place; ``pull`` is what a reading of its
    strength changes with the place, relative: both mostly make up for one another."""
    if light.kind != "point":
        return 0.0
    offset = light.place - middle
    slope = -2 * offset / (offset @ offset) - pull
    return float(np.sqrt(max(slope @ light.covariance @ slope, 0.0)))
