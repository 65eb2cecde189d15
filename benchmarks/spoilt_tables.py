"""Tables that are spoilt in many ways, given to ``fit`` as they stand: none may end in a wrong albedo in silence.

Surfaces, angles, noise and what spoils them are drawn from a seed. Each table is read and fitted as the command line
does, and its albedo held against the clean table's: *right* within 2 % of it, *refused* (exit status 2), *distrusted*
(exit status 3), *warned* (further off, with a warning of just that kind), *untold* (further off, and nothing in the
table can tell: a factor that leaves albedos below 1, a constant added to all; that both are taken on trust is said of
every table), *silent* (further off, and called a success). Clean tables count as false alarms where they are distrusted
or lose a row::

    python -m benchmarks.spoilt_tables [--tables 40] [--seed 0] [--ways NAME ...] [--measured FILE ...] [--quick]

``--measured`` are tables of measurements to be spoilt beside the drawn ones, with this project's own headers.
"""

from __future__ import annotations

import argparse
import tempfile
import warnings
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.spoiling import CHANNELS, WAYS, Rows, spoilt, written
from photogonio.capture.errors import InputError
from photogonio.options import Options
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.synthetic.brdf.library import make_brdf
from photogonio.system.progress import Reporter
from photogonio.tabulated import fit

ALIKE = 0.02  # of the clean table's albedo
OUTCOMES = ("right", "refused", "distrusted", "warned", "untold", "silent")
UNTOLD = ("dark-added", "reflectance-factor")  # ways that leave a table as another surface would have it
Draw = Callable[[np.random.Generator], dict[str, object]]


def _albedo(rng: np.random.Generator) -> float:
    return float(rng.uniform(0.04, 0.9))


def _rough(rng: np.random.Generator) -> float:
    return float(rng.uniform(0.2, 0.6))


MATERIALS: dict[str, tuple[str, Draw]] = {
    "lambert": ("lambert", lambda rng: {"albedo": _albedo(rng)}),
    "oren-nayar": ("oren-nayar", lambda rng: {"albedo": _albedo(rng), "sigma": float(rng.uniform(0.2, 0.7))}),
    "minnaert": ("minnaert", lambda rng: {"albedo": _albedo(rng), "k": float(rng.uniform(0.6, 1.2))}),
    "satin": ("satin-paint", lambda rng: {"albedo": _albedo(rng), "roughness": _rough(rng)}),
    "plastic": ("plastic", lambda rng: {"albedo": _albedo(rng), "roughness": _rough(rng)}),
    "coat": ("glossy-paint", lambda rng: {"albedo": _albedo(rng), "mirror": 0.03, "roughness": 0.25}),
    "schlick": ("plastic-schlick", lambda rng: {"albedo": _albedo(rng), "roughness": _rough(rng)}),
    "phong": ("phong", lambda rng: {"albedo": _albedo(rng), "power": float(rng.uniform(5, 40))}),
    "blinn-phong": ("blinn-phong", lambda rng: {"albedo": _albedo(rng), "power": float(rng.uniform(10, 60))}),
    "torrance": ("torrance-sparrow", lambda rng: {"albedo": _albedo(rng), "width": _rough(rng)}),
    "metal": ("ggx-conductor", lambda rng: {"f0": _albedo(rng), "roughness": _rough(rng)}),
    "brushed": ("brushed-metal", lambda rng: {"roughness_x": 0.25, "roughness_y": 0.5}),
    "retro": ("retro-reflector", lambda rng: {"albedo": _albedo(rng), "power": float(rng.uniform(10, 40))}),
}


def places(rng: np.random.Generator) -> tuple[str, np.ndarray]:
    """Incident, exit and relative azimuth angles (n, 3), degrees, as goniometers take them."""
    kind = str(rng.choice(["grid", "fine", "scattered", "half", "planes"]))
    if kind == "scattered":
        count = int(rng.integers(250, 600))
        polar = np.degrees(np.arccos(rng.uniform(np.cos(np.radians(80)), 1.0, (count, 2))))
        return kind, np.column_stack([polar, rng.uniform(0.0, 360.0, count)])
    steps = {"grid": (15, 10, 30, 360), "fine": (15, 5, 45, 360), "half": (20, 10, 30, 181)}.get(kind)
    azimuth = (
        np.array([0, 90, 180, 270]) if steps is None else np.arange(0, steps[3], steps[2])
    )  # planes: in it, and square to it
    first, second = (10, 5) if steps is None else steps[:2]
    axes = np.meshgrid(np.arange(0, 76, first), np.arange(0, 81, second), azimuth, indexing="ij")
    at = np.column_stack([axis.ravel() for axis in axes]).astype(float)
    return kind, at[(at[:, 1] > 0) | (at[:, 2] == 0)]  # at the normal all azimuths are one


def drawn(seed: int) -> tuple[str, Rows]:
    """A clean table."""
    rng = np.random.default_rng(seed)
    name = list(MATERIALS)[seed % len(MATERIALS)]
    model, parameters = MATERIALS[name]
    kind, at = places(rng)
    theta_i, theta_r, dphi = np.radians(at.T)
    value = make_brdf(model, parameters(rng))(unit_vectors(theta_i, 0 * theta_i), unit_vectors(theta_r, dphi))
    noise, constant = rng.uniform(0.005, 0.05), rng.random() < 0.3
    size = np.median(value) if constant else value[:, :1]
    value = value[:, :1] + noise * size * rng.standard_normal((len(value), 1))
    told = f"{seed} {name} {kind}, {len(at)} rows, {noise:.1%} {'constant' if constant else 'relative'} noise"
    return told, Rows(theta_i, 0 * theta_i, theta_r, dphi, np.array([float(f"{v:.5g}") for v in value[:, 0]]))


def measured(path: Path, where: list[tuple[str, str]], columns: dict[str, str]) -> tuple[str, Rows]:
    rows = read_samples(path, columns=columns, where=where)
    return path.stem, Rows(rows.theta_i, rows.phi_i, rows.theta_r, rows.phi_r, rows.value[:, 0])


@dataclass(frozen=True, slots=True)
class Found:
    """What a table came to."""

    outcome: str  # "ok", or one of OUTCOMES
    codes: tuple[str, ...]
    albedo: np.ndarray  # (c,)


def fitted(text: str, path: Path) -> Found:
    """As the command line fits a file of this text."""
    path.write_text(text, encoding="utf-8")
    try:
        result = fit(path, None, Options(), reporter=Reporter(quiet=True))
    except InputError as refusal:
        return Found("refused", (str(refusal).split(": ", 1)[-1],), np.empty(0))
    codes = (*(one.code for one in result.faults), *(one.code for one in result.diagnoses))
    return Found("distrusted" if result.faults else "ok", codes, result.brdf.bihemispherical_albedo())


def judged(found: Found, right: np.ndarray) -> str:
    """One of OUTCOMES; ``right`` (c,) are the albedos of the table as it was."""
    if found.outcome == "refused":
        return "refused"
    if len(found.albedo) == len(right) and np.all(np.abs(found.albedo / right - 1) <= ALIKE):
        return "right"
    if found.outcome == "distrusted":
        return "distrusted"
    warns = any(code.startswith(("table-", "rows-contradicted")) for code in found.codes)
    return "warned" if warns else "silent"


def outcomes(tables: list[tuple[str, Rows]], ways: list[str], seed: int) -> Iterator[tuple[str, str, str]]:
    """(way, outcome, line of what is to be looked at or empty); the way of clean tables is ``clean``."""
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "table.csv"
        for number, (told, rows) in enumerate(tables):
            clean = fitted(written(rows), path)
            lost = [code for code in clean.codes if code in ("rows-left-out", "table-much-lost")]
            alarm = clean.outcome != "ok" or bool(lost)
            yield "clean", "false alarm" if alarm else "right", f"{told}: {clean.codes}" if alarm else ""
            if clean.outcome != "ok":
                continue
            for way in ways:
                rng = np.random.default_rng([seed, number, list(WAYS).index(way)])
                found = fitted(spoilt(way, rows, rng), path)
                outcome, line = judged(found, clean.albedo * CHANNELS.get(way, 1.0)), ""
                outcome = "untold" if outcome == "silent" and way in UNTOLD else outcome
                if outcome in ("silent", "warned"):
                    ratio = np.round(found.albedo / clean.albedo[0], 3)
                    line = f"{way:18} {outcome} {ratio} of {told}: {found.codes}"
                yield way, outcome, line


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--tables", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--ways", nargs="+", default=list(WAYS), choices=list(WAYS), metavar="NAME")
    parser.add_argument("--measured", nargs="*", default=[])
    parser.add_argument("--where", default="", help="HEADER=VALUE of the measured tables' rows")
    parser.add_argument("--columns", default="", help="as of fit, of the measured tables")
    parser.add_argument("--quick", action="store_true", help="one table, three ways")
    args = parser.parse_args(arguments)
    if args.quick:
        args.tables, args.ways = 1, ["one-zero", "radians", "sentinel"]
    warnings.simplefilter("error", RuntimeWarning)
    where = [tuple(args.where.split("=", 1))] if args.where else []
    columns = dict(pair.split("=", 1) for pair in args.columns.split(",") if pair)
    tables = [drawn(1000 * args.seed + k) for k in range(args.tables)]
    tables += [measured(Path(name), where, columns) for name in args.measured]
    counts: defaultdict[str, Counter[str]] = defaultdict(Counter)
    for way, outcome, line in outcomes(tables, args.ways, args.seed):
        counts[way][outcome] += 1
        if line:
            print(line, flush=True)
    print(f"clean tables: {dict(counts.pop('clean'))}")
    print(f"{'':18} " + "".join(f"{name:>11}" for name in OUTCOMES))
    for way, count in counts.items():
        print(f"{way:18} " + "".join(f"{count[name] or '':>11}" for name in OUTCOMES))
    total = sum(counts.values(), Counter())
    print(f"{'all':18} " + "".join(f"{total[name]:>11}" for name in OUTCOMES))


if __name__ == "__main__":
    main()
