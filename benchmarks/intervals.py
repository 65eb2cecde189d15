"""Do the 95 % intervals of f hold the truth 95 times in a hundred, where the photos looked?

Facet tables of random surfaces under random plans, without pictures, each fitted with everything automatic; at
directions near data, below 70 degrees, it is counted how often the stated interval holds the true f::

    python -m benchmarks.intervals [--sets 200] [--workers 2] [--quick]

A set's directions share their errors, so that a set counts once: the figure is the mean over the sets.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from photogonio.reconstruct.brdf.brdf import Brdf, load_brdf
from photogonio.reconstruct.fit import fit_table
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.uncertainty.validity import seen_at
from photogonio.synthetic.brdf.library import angle_grid, make_brdf, on_grid
from photogonio.synthetic.brdf.reflectance import Reflectance
from tests.drawn.tables import Plan, simulate

LIMIT = np.radians(70.0)
WIDE = 1.959964  # standard errors on either side
KINDS = (
    "lambert",
    "oren-nayar",
    "minnaert",
    "plastic",
    "ggx-conductor",
    "torrance-sparrow",
    "retro-reflector",
)


@dataclass(frozen=True, slots=True)
class Score:
    """How one set's intervals did."""

    kind: str
    held: float  # share of the directions near data whose interval holds the truth
    from_file: float  # the same of intervals computed from the coefficient file alone
    error: float  # relative error near data, mean of the channels
    stated: float  # the same as the standard errors have it


def drawn(seed: int) -> tuple[str, Reflectance, Plan]:
    """A surface and how it is photographed."""
    rng = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    colour = tuple(rng.uniform(0.1, 0.8, 3))
    parameters: dict[str, object] = {
        "lambert": {"albedo": colour},
        "oren-nayar": {"albedo": colour, "sigma": rng.uniform(0.2, 0.8)},
        "minnaert": {"albedo": colour, "k": rng.uniform(0.6, 1.4)},
        "plastic": {"albedo": colour, "roughness": rng.uniform(0.12, 0.5), "ior": rng.uniform(1.35, 1.7)},
        "ggx-conductor": {"f0": colour, "roughness": rng.uniform(0.15, 0.5)},
        "torrance-sparrow": {"albedo": colour, "width": rng.uniform(0.15, 0.4)},
        "retro-reflector": {"albedo": tuple(0.5 * a for a in colour), "retro": rng.uniform(0.05, 0.4)},
    }[kind]
    plan = Plan(
        shape=("ball", "plane")[int(rng.integers(2))],
        views=int(rng.integers(12, 25)),
        pixels=4000,
        level=3,
        camera=("fixed", "moving")[int(rng.integers(2))],
        lamp_elevation=(float(rng.uniform(12, 30)), 80.0),
        electrons=float(rng.uniform(3e3, 3e4)),
        view_error=float(rng.uniform(0.001, 0.008)),
        spoiled=float(rng.uniform(0.0, 0.002)),  # most spots are found in the photos
    )
    return kind, make_brdf(kind, parameters), plan


def score(seed: int) -> Score:
    """Simulate, fit and judge one set."""
    kind, truth, plan = drawn(seed)
    fit = fit_table(simulate(truth, plan, seed=seed))
    angles = angle_grid()
    angles = angles[(angles[:, :2] < LIMIT).all(1)]
    grid = Cells.of_angles(*angles.T)
    seen = seen_at(fit.cells, grid)
    grid, true = grid.take(seen), on_grid(truth, angles[seen])
    found = fit.brdf.evaluate(grid.theta_i, 0.0, grid.theta_r, grid.dphi)
    error = fit.standard_error(grid)
    weight = (np.sin(2 * grid.theta_i) * np.sin(2 * grid.theta_r))[:, None]
    size = np.sum(weight * true**2)
    return Score(
        kind,
        float(np.mean(np.abs(found - true) <= fit.uncertainty.half_width(error))),
        float(np.mean(np.abs(found - true) <= WIDE * of_file(fit.brdf, grid))),
        float(np.sqrt(np.sum(weight * (found - true) ** 2) / size)),
        float(np.sqrt(np.sum(weight * error**2) / size)),
    )


def of_file(brdf: Brdf, grid: Cells) -> np.ndarray:
    """Standard errors (n, c) of f of what is read again from the file."""
    with tempfile.TemporaryDirectory() as folder:
        brdf.save(Path(folder) / "coefficients.json")
        return load_brdf(Path(folder) / "coefficients.json").standard_error(
            grid.theta_i, 0.0, grid.theta_r, grid.dphi
        )


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--quick", action="store_true", help="two sets only")
    asked = parser.parse_args(arguments)
    seeds = range(2 if asked.quick else asked.sets)
    if asked.workers > 1:
        with get_context("spawn").Pool(asked.workers) as pool:
            scores = list(pool.map(score, seeds))
    else:
        scores = [score(seed) for seed in seeds]
    print("surface           sets   held  from the file  median error  median stated")
    for kind in (*KINDS, "all"):
        some = [one for one in scores if kind in (one.kind, "all")]
        if some:
            held, filed, error, stated = np.array([[s.held, s.from_file, s.error, s.stated] for s in some]).T
            print(
                f"{kind:16s}  {len(some):4d} {100 * held.mean():6.1f} %  {100 * filed.mean():11.1f} %"
                f"  {100 * np.median(error):8.2f} %  {100 * np.median(stated):10.2f} %"
            )


if __name__ == "__main__":
    main()
