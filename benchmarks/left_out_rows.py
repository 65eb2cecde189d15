"""How well a fit predicts measured rows that it has not seen, against a smoother that knows no model at all.

Of a table of measurements, such as the one of sintered PTFE (Germer, Applied Optics 2017), a random third is left
out, the rest fitted with everything automatic; printed is the relative rms of the rows used, of those left out, and
their ratio, for several seeds::

    python -m benchmarks.left_out_rows PTFE.data.csv [--wavelengths 0.532 ...] [--orders 8 12] [--smoother] [--quick]

``--orders`` asks for these as well; their left-out rows stand over those of the automatic fit. ``--smoother`` adds a
Gaussian process over what isotropy and reciprocity leave of the directions (Rasmussen & Williams 2006, Matern 5/2),
its lengths and noise of greatest evidence: what it cannot predict either, the rows do not tell of one another.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from photogonio.reconstruct.fit import FitOptions, fit_table
from photogonio.reconstruct.goniometer.read import read_samples
from photogonio.reconstruct.modes.angles import half_difference, unit_vectors
from photogonio.reconstruct.table.cells import Cells, cells_of
from photogonio.reconstruct.table.facet_table import FacetTable
from photogonio.reconstruct.table.goniometer_csv import samples_table

COLUMNS = {"theta_i": "thetai", "phi_i": "phi", "theta_r": "thetar", "phi_r": "phir", "value": "f_r11"}
WAVELENGTHS = ("0.351", "0.532", "0.633", "1.064")
START = np.log([1.8, 3.0, 3.0, 3.0, 6.0, 2.5, 0.01])  # five lengths, spread and noise of the logarithm
BOUNDS = [(np.log(0.02), np.log(50.0))] * 5 + [(-5.0, 3.0), (np.log(1e-3), np.log(0.1))]
EVERY = 2  # of the rows, for the evidence: it costs their number cubed


@dataclass(frozen=True, slots=True)
class Split:
    """Rows used and rows left out of one table."""

    used: FacetTable
    left: FacetTable


def split_of(table: FacetTable, seed: int) -> Split:
    """A random third left out."""
    shuffled = np.random.default_rng(seed).permutation(len(table))
    out, used = (np.sort(part) for part in np.split(shuffled, [len(table) // 3]))
    return Split(table.take(used), table.take(out))


def rms(predicted: np.ndarray, cells: Cells) -> float:
    """Relative to the measured values."""
    return float(np.sqrt(np.mean((predicted / cells.value - 1.0) ** 2)))


def fitted_rms(split: Split, order: int | None = None) -> tuple[float, float]:
    """Of the rows used and of those left out, by a fit of the former."""
    brdf = fit_table(split.used, FitOptions(order=order)).brdf
    both = (cells_of(part) for part in (split.used, split.left))
    return tuple(rms(brdf.evaluate(c.theta_i, c.phi_i, c.theta_r, c.phi_r), c) for c in both)


def invariants(cells: Cells) -> np.ndarray:
    """What isotropy and reciprocity leave of pairs of directions, (n, 5): the same for reciprocal and mirror twins."""
    i, r = cells.theta_i / (np.pi / 2), cells.theta_r / (np.pi / 2)
    half, apart, _ = half_difference(
        unit_vectors(cells.theta_i, 0.0), unit_vectors(cells.theta_r, cells.dphi)
    )
    return np.column_stack(
        [i * r * np.cos(cells.dphi), i + r, (i - r) ** 2, np.cos(half), apart / (np.pi / 2)]
    )


def covariance(one: np.ndarray, other: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """Matern 5/2 of distances in the logarithmic lengths ``parameters[:5]``, of spread ``parameters[5]``; (n, m)."""
    lengths = np.exp(parameters[:5])
    apart = ((one / lengths)[:, None] - (other / lengths)[None]) ** 2
    scaled = np.sqrt(5.0 * apart.sum(-1) + 1e-12)
    return np.exp(2 * parameters[5]) * (1.0 + scaled + scaled**2 / 3.0) * np.exp(-scaled)


def lost_evidence(parameters: np.ndarray, where: np.ndarray, value: np.ndarray) -> float:
    """Minus the logarithm of the evidence of ``value`` (n,) at ``where`` (n, 5), but for a constant."""
    noisy = covariance(where, where, parameters) + np.exp(2 * parameters[6]) * np.eye(len(value))
    factor = cho_factor(noisy, lower=True)
    return float(0.5 * value @ cho_solve(factor, value) + np.log(np.diag(factor[0])).sum())


def smoothed_rms(split: Split) -> tuple[float, float]:
    """As :func:`fitted_rms` by the Gaussian process, on the logarithm of the first channel's values."""
    used, left = (cells_of(part) for part in (split.used, split.left))
    where, logs = invariants(used), np.log(used.value[:, 0])
    middle = logs.mean()
    thin = (where[::EVERY], logs[::EVERY] - middle)
    best = minimize(lost_evidence, START, thin, "L-BFGS-B", bounds=BOUNDS, options={"maxiter": 20}).x
    noisy = covariance(where, where, best) + np.exp(2 * best[6]) * np.eye(len(logs))
    weights = cho_solve(cho_factor(noisy, lower=True), logs - middle)
    both = (np.exp(covariance(invariants(c), where, best) @ weights + middle)[:, None] for c in (used, left))
    return tuple(rms(found, c) for found, c in zip(both, (used, left), strict=True))


def main(argv: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description="measured rows left out, predicted")
    parser.add_argument("file")
    parser.add_argument("--wavelengths", nargs="+", default=WAVELENGTHS, help="as the column lambda has them")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--orders", type=int, nargs="*", default=())
    parser.add_argument("--smoother", action="store_true")
    parser.add_argument("--quick", action="store_true", help="one wavelength, one seed")
    args = parser.parse_args(argv)
    wavelengths, seeds = (args.wavelengths[:1], 1) if args.quick else (args.wavelengths, args.seeds)
    for wavelength in wavelengths:
        rows = read_samples(Path(args.file), columns=COLUMNS, where=[("lambda", wavelength)])
        table = samples_table(rows)
        for seed in range(seeds):
            split = split_of(table, seed)
            used, left = fitted_rms(split)
            line = f"{wavelength} seed {seed}: used {used:.4f}, left out {left:.4f}, ratio {left / used:.3f}"
            for order in args.orders:
                line += f"; order {order} over auto {fitted_rms(split, order)[1] / left:.3f}"
            if args.smoother:
                used, left = smoothed_rms(split)
                line += f"; smoother {used:.4f}, {left:.4f}, {left / used:.3f}"
            print(line, flush=True)


if __name__ == "__main__":
    main()
