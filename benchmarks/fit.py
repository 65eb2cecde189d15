"""The fit: with automatic choice, and its core against numpy.linalg.lstsq.

    python -m benchmarks.fit [--quick] [--cells N]

"automatic" removes what views have in common, tries orders 0 to 12, every prior and number of lobes on ten folds, and
states its uncertainty. Of the core, "sums" forms the normal equations of order 8 fold by fold, once; "solves" takes
every fold and prior from them; "lstsq" is one least-squares solution of the same weighted rows, of which a choice
without sums needs one for each fold and prior. Last, the powers p of time ~ size^p, of the sums over cells and over
modes.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from unittest.mock import patch

import numpy as np

from photogonio.reconstruct import model_choice
from photogonio.reconstruct.estimate.folded_design import FoldedDesign
from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.estimate.model_selection import PRIORS, folds_of
from photogonio.reconstruct.estimate.normal_equations import Factors, solve
from photogonio.reconstruct.estimate.weights import level
from photogonio.reconstruct.fit import fit_table
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.facet_table import FacetTable, of_groups
from photogonio.synthetic.brdf.library import make_brdf
from tests.drawn.tables import Plan, simulate

ORDERS = 12  # the highest tried
SOME = 24  # views, to tell how many cells one has
PIXELS = 6000  # of the sample, in each view
CHECKED = 8  # order of the comparison with lstsq


def timed(task: Callable[[], object]) -> float:
    start = time.perf_counter()
    task()
    return time.perf_counter() - start


def made_table(cells: int) -> FacetTable:
    """About ``cells`` cells of a coated ball on facets of level 3, as many views as that takes."""
    brdf = make_brdf("satin-paint", {"albedo": (0.62, 0.42, 0.25), "roughness": 0.45})
    some = simulate(brdf, Plan(views=SOME, pixels=PIXELS))
    views = max(2, round(SOME * cells / len(some)))
    return simulate(brdf, Plan(views=views, pixels=PIXELS))


def core(cells: Cells, order: int) -> tuple[float, float, float, float]:
    """Seconds of the sums, of all solves from them, of one lstsq; and how far the solutions are apart, relative."""
    design = Basis("isotropic", order).design(cells)
    weight = 1.0 / (cells.variance + (0.005 * cells.value) ** 2)
    fold, nothing = folds_of(cells), np.empty((len(cells), 0))
    sums: list = []
    summing = timed(lambda: sums.append(FoldedDesign(design, weight, fold).statistics(cells.value, nothing)))
    rest, none = sums[0].without_each(), np.empty(0)
    degree, typical = Basis("isotropic", order).degree(), level(cells)

    def solve_all() -> None:
        for prior in PRIORS:
            solve(rest, Factors(rest.modes_gram, prior.precision(degree, typical)), none)

    whole = sums[0].total()
    ours = solve(whole, Factors(whole.modes_gram, np.zeros((len(typical), design.shape[1]))), none)[0].T
    root, theirs = np.sqrt(weight), []

    def plain() -> None:
        for c in range(weight.shape[1]):
            rows, right = design * root[:, c, None], cells.value[:, c] * root[:, c]
            theirs.append(np.linalg.lstsq(rows, right, rcond=None)[0])

    seconds = timed(plain)
    apart = np.abs(design @ (ours - np.stack(theirs, axis=1))).max() / np.abs(cells.value).max()
    return summing, timed(solve_all), seconds, float(apart)


def power(sizes: list[float], seconds: list[float]) -> float:
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def summing(cells: Cells, order: int) -> float:
    design = Basis("isotropic", order).design(cells)
    return timed(lambda: FoldedDesign(design, np.ones_like(cells.value), folds_of(cells)))


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few cells: shows that it runs, not how fast")
    parser.add_argument("--cells", type=int, default=300_000)
    options = parser.parse_args(arguments)
    highest, order = (2, 4) if options.quick else (ORDERS, CHECKED)
    table = made_table(6000 if options.quick else options.cells)
    with patch.object(model_choice, "HIGHEST_AUTO", highest):
        seconds = timed(lambda: fit_table(table))
    print(f"automatic, orders 0 to {highest}: {len(table)} cells, {len(table.groups)} views: {seconds:.2f} s")
    cells = cells_of(of_groups(table, table.groups[: max(2, len(table.groups) // 4)]))
    sums, solves, plain, apart = core(cells, order)
    count = len(PRIORS) * len(np.unique(folds_of(cells)))
    print(f"core, order {order}, {len(cells)} cells: sums {sums:.3f} s, {count} solves {solves:.3f} s")
    ratio = count * plain / (sums + solves)
    print(f"  lstsq {plain:.3f} s each, {ratio:.0f} x ours for as many; solutions within {apart:.1e}")
    parts = [cells.take(np.arange(0, len(cells), step)) for step in (8, 4, 2, 1)]
    grown = power([len(part) for part in parts], [summing(part, order) for part in parts])
    orders = (2, 4) if options.quick else (4, 8, 12, 16)
    modes = [len(Basis("isotropic", each).modes) for each in orders]
    print(f"sums: time ~ cells^{grown:.2f}, ~ modes^{power(modes, [summing(cells, o) for o in orders]):.2f}")


if __name__ == "__main__":
    main()
