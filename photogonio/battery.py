"""The hard-case battery: what must happen to each set, and what did."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from capture.errors import InputError
from photogonio.evaluate import INNER, against, rendered
from photogonio.options import Options
from photogonio.pipeline import Result, process
from photogonio.progress import Reporter
from photogonio.reflectances import Known, load_known
from photogonio.truth import TRUTH
from reconstruct.angles import spherical_angles, unit_vectors
from reconstruct.cells import Cells
from reconstruct.facets import facet_index
from reconstruct.fit import FitOptions, fit_table
from reconstruct.measured import Samples, samples_table
from reconstruct.table import FacetTable, accumulate, add_tables
from synthetic.hard import ACCURATE, NAMED, WARNED, HardCase, hard_case, hard_names
from synthetic.scene import FaultScene, load_scene

INTERVAL = 2.0  # standard errors: about 95 %
LEAST = 0.02  # relative: an error below it is no wrong answer, whatever the interval
PLAIN = "example"  # the set that every case is a change of
_SLACK = 1.25  # of the plain set's error, for a case that must not harm


@dataclass(frozen=True, slots=True)
class Outcome:
    """What happened to one case."""

    name: str
    must: str
    passed: bool
    said: str  # what happened, in words
    error: float = math.nan  # relative L2 within the valid angles, worst channel
    stated: float = math.nan  # the same of the stated standard errors

    def to_dict(self) -> dict[str, object]:
        return {name: getattr(self, name) for name in self.__slots__}


def run_battery(sets: Path, *, workers: int, reporter: Reporter) -> list[Outcome]:
    """Every hard scene, and the cases that are tables."""
    plain = _plain_error(sets, workers=workers, reporter=reporter)
    outcomes = []
    for name in hard_names():
        case = hard_case(name)
        folder = rendered(case.scene, sets, workers=workers, reporter=reporter)
        outcomes.append(judge(case, folder, plain, workers=workers))
        reporter.say(outcome_line(outcomes[-1]))
    for name, (must, run) in TABLE_CASES.items():
        passed, said = run()
        outcomes.append(Outcome(name, must, passed, said))
        reporter.say(outcome_line(outcomes[-1]))
    return outcomes


def outcome_line(outcome: Outcome) -> str:
    return f"{'pass' if outcome.passed else 'FAIL'}  {outcome.name:22} {outcome.said}"


def _plain_error(sets: Path, *, workers: int, reporter: Reporter) -> float:
    folder = rendered(load_scene(PLAIN), sets, workers=workers, reporter=reporter)
    result = process(folder, None, Options(workers=workers))
    return float(against(result.brdf, load_known(folder / TRUTH), INNER).measures["relative_l2"].max())


def judge(case: HardCase, folder: Path, plain: float, *, workers: int) -> Outcome:
    """Process one hard set and hold what happens against what must."""
    try:
        result = process(folder, None, Options(workers=workers))
    except InputError as error:
        return Outcome(case.name, case.must, case.must != ACCURATE, f"refused: {error}")
    error, stated = error_and_interval(result, load_known(folder / TRUTH))
    named = named_photos(result, case.scene.fault)
    within = error <= max(INTERVAL * stated, LEAST)
    passed = {
        ACCURATE: error <= max(_SLACK * plain, LEAST),
        NAMED: named,
        WARNED: within or bool(result.warnings),
    }.get(case.must, within)
    said = f"error {100 * error:.1f} %, stated {100 * stated:.1f} %"
    said += f", valid to {result.brdf.valid.get('theta_r_max', 90.0):.0f} degrees"
    if result.left_out:
        said += f", left out {', '.join(photo.name for photo in result.left_out[:4])}"
    if case.must in (NAMED, WARNED):
        said += f", {len(result.warnings)} warnings" + (", the bad photo named" if named else "")
    return Outcome(case.name, case.must, bool(passed), said, error, stated)


def named_photos(result: Result, fault: FaultScene) -> bool:
    """Whether every photo with a fault, or one of each swapped pair, is named as left out or rescaled or warned of."""
    told = " ".join([photo.name for photo in result.left_out] + list(result.warnings))
    told += " " + " ".join(result.fit.diagnostics.get("views rescaled", ()))
    groups = [(k,) for k in fault.two_lamps] + list(fault.swapped)
    return bool(groups) and all(any(f"s{k:03d}" in told for k in group) for group in groups)


def error_and_interval(result: Result, truth: Known) -> tuple[float, float]:
    """Relative L2 of the error, and of the stated standard errors, within the valid angles; the worst channel's."""
    valid = np.radians(min(result.brdf.valid.get("theta_r_max", 80.0), 80.0))
    found = against(result.brdf, truth, max(valid, np.radians(20.0)))
    cells = cells_at(found.at.incident, found.at.exit)
    sigma = result.fit.uncertainty.standard_error(result.fit.model, cells) * found.scale
    weight = (found.at.weight * found.at.cos_i * found.at.cos_r)[:, None]
    stated = np.sqrt((weight * sigma**2).sum(0) / (weight * found.b**2).sum(0))
    error = found.measures["relative_l2"]
    worst = int(np.argmax(error / np.maximum(INTERVAL * stated, LEAST)))
    return float(error[worst]), float(stated[worst])


def cells_at(incident: np.ndarray, exit: np.ndarray) -> Cells:
    """Cells that are only directions."""
    (theta_i, phi_i), (theta_r, phi_r) = spherical_angles(incident), spherical_angles(exit)
    folded = np.abs(np.mod(phi_r - phi_i + np.pi, 2 * np.pi) - np.pi)
    return replace(Cells.of_angles(theta_i, theta_r, folded), phi_i=phi_i, phi_r=phi_r)


def spread_of_weights() -> tuple[bool, str]:
    """A Lambertian table whose standard errors spread a millionfold: the fit must stay within its errors."""
    rng = np.random.default_rng(7)
    theta, phi = np.arccos(rng.uniform(0.2, 1.0, (2, 3000))), rng.uniform(0.0, 2 * np.pi, (2, 3000))
    sigma = 10.0 ** rng.uniform(-8.0, -2.0, (3000, 1))
    value = 0.5 / np.pi + sigma * rng.standard_normal((3000, 1))
    table = samples_table(Samples(theta[0], phi[0], theta[1], phi[1], value, sigma, ("Y",)))
    fit = fit_table(table, FitOptions(order=4, lobes=0))
    off = np.abs(fit.brdf(unit_vectors(theta[0], phi[0]), unit_vectors(theta[1], phi[1])) * np.pi / 0.5 - 1)
    return bool(off.max() < 1e-4), f"largest error {off.max():.1e} of f, standard errors 1e-8 to 1e-2"


def a_billion_samples() -> tuple[bool, str]:
    """10^9 samples of one cell, in a thousand tables of a million each: the sums must not lose small parts."""
    direction = np.array([[0.3, 0.1, math.sqrt(0.9)]])
    values = 0.1 + 1e-3 * np.sin(np.arange(1000.0))
    total = add_tables([_heavy(direction, value) for value in values])
    exact = math.fsum(1e6 * value for value in values)
    off = abs(total.value[0, 0] / exact - 1.0)
    passed = len(total) == 1 and total.count[0] == 1e9 and off < 1e-13
    return passed, f"{total.count[0]:.0e} samples in one cell, sum off by {off:.1e}"


def _heavy(direction: np.ndarray, value: float) -> FacetTable:
    table = accumulate(
        level=3,
        channels=("Y",),
        name="one",
        isotropic=False,
        facet_i=facet_index(direction, 3),
        facet_r=facet_index(direction, 3),
        incident=direction,
        exit=direction,
        place=np.zeros((1, 3)),
        omega=np.full(1, 1e6),
        value=np.full((1, 1), value),
        variance=np.full((1, 1), 1e-6),
    )
    return replace(table, count=np.full(1, 1e6))


TABLE_CASES: dict[str, tuple[str, Callable[[], tuple[bool, str]]]] = {
    "weights-spread-1e6": ("the fit stays within its errors", spread_of_weights),
    "1e9-samples-in-a-cell": ("no loss in the sums", a_billion_samples),
}
