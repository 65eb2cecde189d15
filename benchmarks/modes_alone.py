"""Modes alone (``--order N --lobes none``) on rows that determine them, beside plain least squares.

Twelve materials as tables on a grid and scattered; printed is the rms misfit of the rows over that of least squares,
for each order: a prior and robust weights may cost little of what the rows show. Where there are fewer than eight rows
a mode the rows do not determine them, and the cell is empty::

    python -m benchmarks.modes_alone [--orders 4 8 12 16] [--materials lambert ...] [--noise 0.01] [--quick]
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np

from photogonio.reconstruct.estimate.mode_set import Basis
from photogonio.reconstruct.fit import FitOptions, fit_table
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.rows.well_determined import ROWS_A_MODE
from photogonio.reconstruct.table.cells import cells_of
from photogonio.reconstruct.table.facet_table import FacetTable
from photogonio.reconstruct.table.goniometer_csv import GoniometerSamples, samples_table
from photogonio.synthetic.brdf.library import make_brdf

MATERIALS: dict[str, dict[str, object]] = {
    "lambert": {},
    "minnaert": {},
    "oepik": {},
    "oren-nayar": {},
    "retro-reflector": {},
    "phong": {"power": 20.0},
    "blinn-phong": {},
    "torrance-sparrow": {},
    "ggx-conductor": {"f0": (0.8,), "roughness": 0.3},
    "plastic": {},
    "satin-paint": {},
    "glossy-paint": {},
}
SCATTERED = 2600
MOST = 75.0  # degrees


def grid() -> tuple[np.ndarray, ...]:
    """theta_i, theta_r, dphi (n,), radians: 2592 rows."""
    polar = np.linspace(0.0, MOST, 12)
    axes = np.meshgrid(polar, polar, np.arange(0.0, 360.0, 20.0), indexing="ij")
    theta_i, theta_r, dphi = (np.radians(axis.ravel()) for axis in axes)
    return theta_i, theta_r, dphi


def scattered(seed: int = 0) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    theta_i, theta_r = np.arccos(rng.uniform(np.cos(np.radians(MOST)), 1.0, (2, SCATTERED)))
    return theta_i, theta_r, rng.uniform(0.0, 2.0 * np.pi, SCATTERED)


def table_of(name: str, where: tuple[np.ndarray, ...], noise: float) -> FacetTable:
    theta_i, theta_r, dphi = where
    value = make_brdf(name, MATERIALS[name])(
        unit_vectors(theta_i, 0.0 * theta_i), unit_vectors(theta_r, dphi)
    )
    value = value[:, :1] * (1.0 + noise * np.random.default_rng(1).standard_normal((len(value), 1)))
    return samples_table(GoniometerSamples(theta_i, 0.0 * theta_i, theta_r, dphi, value, None, ("Y",)))


def ratio(table: FacetTable, order: int) -> float:
    """Of the rms misfits; NaN where the rows do not determine the modes."""
    cells, basis = cells_of(table), Basis("isotropic", order)
    if len(cells) < ROWS_A_MODE * len(basis.modes):
        return np.nan
    design = basis.design(cells)
    least = np.linalg.norm(design @ np.linalg.lstsq(design, cells.value, rcond=None)[0] - cells.value)
    found = fit_table(table, FitOptions(order=order, lobes=0, symmetry="isotropic", physics="off"))
    missed = np.linalg.norm(found.predicted - cells.value)
    floor = 1e-6 * np.linalg.norm(cells.value)  # what least squares says without any noise
    return float((missed + floor) / (least + floor))


def lines(names: list[str], orders: list[int], noise: float) -> Iterator[str]:
    worst = 0.0
    yield "| material | places | " + " | ".join(f"order {order}" for order in orders) + " |"
    yield "|---|---|" + "---|" * len(orders)
    for name in names:
        for label, where in (("grid", grid()), ("scattered", scattered())):
            table = table_of(name, where, noise)
            found = [ratio(table, order) for order in orders]
            worst = max([worst, *(one for one in found if np.isfinite(one))])
            told = [f"{one:.3f}" if np.isfinite(one) else "" for one in found]
            yield f"| {name} | {label} | " + " | ".join(told) + " |"
    yield f"\nworst {worst:.3f}"


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--orders", type=int, nargs="+", default=[4, 8, 12, 16])
    parser.add_argument("--materials", nargs="+", default=list(MATERIALS))
    parser.add_argument("--noise", type=float, default=0.01)
    parser.add_argument("--quick", action="store_true", help="two materials, order 4")
    args = parser.parse_args(arguments)
    if args.quick:
        args.materials, args.orders = ["lambert", "ggx-conductor"], [4]
    for line in lines(args.materials, args.orders, args.noise):
        print(line, flush=True)


if __name__ == "__main__":
    main()
