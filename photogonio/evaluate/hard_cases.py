"""The hard-case battery: what must happen to each set, and what did."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from photogonio.capture.diagnosis import Diagnosis
from photogonio.capture.errors import InputError
from photogonio.capture.manifest.schema import did_you_mean
from photogonio.compare.known import Known
from photogonio.compare.metrics import Directions
from photogonio.compare.reflectances import load_known
from photogonio.evaluate.hard_tables import TABLE_CASES
from photogonio.evaluate.scenes import INNER, against, rendered, spread_over_processes
from photogonio.evaluate.truth import TRUTH
from photogonio.options import Options
from photogonio.pipeline import process
from photogonio.reconstruct.fit import FitResult
from photogonio.reconstruct.modes.angles import spherical_angles
from photogonio.reconstruct.table.cells import Cells
from photogonio.result import Result
from photogonio.synthetic.scene.hard_cases import (
    ACCURATE,
    NAMED,
    PLAIN,
    TOLD,
    HardCase,
    hard_case,
    hard_names,
)
from photogonio.synthetic.scene.parts import FaultScene
from photogonio.system.progress import Reporter

_PAIRS = 20_000  # at a time
_SLACK = 1.25  # of the plain set's error, for a case that must not harm


@dataclass(frozen=True, slots=True)
class HardResult:
    """What processing one hard set gave, as plain values that can pass between processes."""

    refused: str = ""  # the line it was refused with
    error: float = math.nan  # relative L2 within the valid angles, of the channel worst against its interval
    stated: float = math.nan  # half the width of the stated 95 % interval, taken over the same pairs alike
    error_70: float = math.nan  # relative L2 below 70 degrees, worst channel
    valid: float = math.nan  # degrees
    left_out: tuple[str, ...] = ()  # photos
    told: tuple[Diagnosis, ...] = ()  # faults found, photos left out and rescaled among them

    @property
    def within(self) -> bool:
        """Whether the error lies within the stated interval."""
        return self.error <= self.stated


@dataclass(frozen=True, slots=True)
class Outcome:
    """What happened to one case."""

    name: str
    must: str
    passed: bool
    said: str  # what happened, in words
    error: float = math.nan  # as in HardResult
    stated: float = math.nan
    error_70: float = math.nan

    def to_dict(self) -> dict[str, object]:
        return {name: getattr(self, name) for name in self.__slots__}


def run_battery(names: Sequence[str], sets: Path, *, workers: int, reporter: Reporter) -> list[Outcome]:
    """The cases named, or all: every hard scene (``workers`` at a time), then the cases that are tables.

    Raises:
        InputError: no such case.
    """
    scenes, tables = _chosen(names)
    outcomes = []
    plain = math.nan
    # the plain set first, for others are held against it
    jobs = [(name, sets) for name in dict.fromkeys((PLAIN, *scenes))] if scenes else []
    for (name, _), found in zip(jobs, spread_over_processes(_measured, jobs, workers), strict=True):
        if name == PLAIN:
            plain = found.error_70
        if name in scenes:
            outcomes.append(judged(hard_case(name), found, plain))
            reporter.say(outcome_line(outcomes[-1]))
    for name in tables:
        must, run = TABLE_CASES[name]
        passed, said = run()
        outcomes.append(Outcome(name, must, passed, said))
        reporter.say(outcome_line(outcomes[-1]))
    return outcomes


def _chosen(names: Sequence[str]) -> tuple[list[str], list[str]]:
    known = [*hard_names(), *TABLE_CASES]
    for name in names:
        if name not in known:
            raise InputError(name, f"no such hard case{did_you_mean(name, known)}")
    wanted = names or known
    return [name for name in hard_names() if name in wanted], [name for name in TABLE_CASES if name in wanted]


def outcome_line(outcome: Outcome) -> str:
    return f"{'pass' if outcome.passed else 'FAIL'}  {outcome.name:22} {outcome.said}"


def _measured(job: tuple[str, Path]) -> HardResult:
    name, sets = job
    return measure(hard_case(name), sets)


def measure(case: HardCase, sets: Path) -> HardResult:
    """Render one hard set (or take it from ``sets``) and process it with everything automatic."""
    folder = rendered(case.scene, sets, workers=1, reporter=Reporter(quiet=True))
    try:
        result = process(folder, None, Options(workers=1))
    except InputError as refusal:
        return HardResult(refused=str(refusal))
    truth = load_known(folder / TRUTH)
    error, stated = error_and_interval(result, truth)
    return HardResult(
        error=error,
        stated=stated,
        error_70=float(against(result.brdf, truth, INNER).measures["relative_l2"].max()),
        valid=result.brdf.valid.get("theta_r_max", 90.0),
        left_out=tuple(photo.name for photo in result.left_out),
        told=result.diagnoses,
    )


def judged(case: HardCase, found: HardResult, plain: float) -> Outcome:
    """What was measured, held against what must happen. ``plain``: the plain set's error below 70 degrees."""
    if found.refused:
        return Outcome(case.name, case.must, case.must != ACCURATE, f"refused: {found.refused}")
    said = f"error {100 * found.error:.2f} %, stated up to {100 * found.stated:.2f} %"
    said += f", valid to {found.valid:.0f} degrees"
    passed = found.within
    if case.must == NAMED:
        named = names_faulty(found.told, case.scene.fault)
        passed = passed and named
        said += ", the bad photo named" if named else ", the bad photo NOT named"
    elif case.must == TOLD:
        telling = next((one for one in found.told if one.code in case.telling), None)
        passed = passed or telling is not None
        said += f", told: {telling.message}" if telling is not None else ", not told"
    elif case.must == ACCURATE:
        passed = passed and found.error_70 <= _SLACK * plain
        said += f", {100 * found.error_70:.2f} % below 70 degrees, the plain set {100 * plain:.2f} %"
    if found.left_out:
        said += f", left out {', '.join(found.left_out[:4])}"
    return Outcome(case.name, case.must, bool(passed), said, found.error, found.stated, found.error_70)


def names_faulty(told: Iterable[Diagnosis], fault: FaultScene) -> bool:
    """Whether every photo with a fault of its own is among those that what is told concerns."""
    faulty = [*fault.two_lamps, *(view for view, _ in fault.mislabelled)]
    named = {Path(name).stem for one in told for name in one.views}
    return bool(faulty) and all(f"s{k:03d}" in named for k in faulty)


def error_and_interval(result: Result, truth: Known) -> tuple[float, float]:
    """Relative L2 of the error, and of half the stated 95 % interval, within the valid angles.

    Of the channel whose error is the most of its interval.
    """
    valid = np.radians(min(result.brdf.valid.get("theta_r_max", 80.0), 80.0))
    found = against(result.brdf, truth, max(valid, np.radians(20.0)))
    weight = (found.at.weight * found.at.cos_i * found.at.cos_r)[:, None]
    width = half_widths(result.fit, found.at) * found.scale
    stated = np.sqrt((weight * width**2).sum(0) / (weight * found.b**2).sum(0))
    error = found.measures["relative_l2"]
    worst = int(np.argmax(error / np.maximum(stated, 1e-12)))
    return float(error[worst]), float(stated[worst])


def half_widths(fit: FitResult, at: Directions) -> np.ndarray:
    """Half the stated 95 % interval of f (n, c), 1/sr, with what the model misses alike in all photos and what the file
    cannot say, as the map of what is determined has it; some pairs at a time, for their modes take memory."""
    parts = []
    for first in range(0, len(at.incident), _PAIRS):
        cells = cells_at(at.incident[first : first + _PAIRS], at.exit[first : first + _PAIRS])
        parts.append(fit.uncertainty.half_width(fit.standard_error(cells)))
    return np.concatenate(parts)


def cells_at(incident: np.ndarray, exit: np.ndarray) -> Cells:
    """Cells that are only directions."""
    (theta_i, phi_i), (theta_r, phi_r) = spherical_angles(incident), spherical_angles(exit)
    folded = np.abs(np.mod(phi_r - phi_i + np.pi, 2 * np.pi) - np.pi)
    return replace(Cells.of_angles(theta_i, theta_r, folded), phi_i=phi_i, phi_r=phi_r)
