"""Classical models as expansions: the error of stopping at each order, and whether the series ends.

    python -m benchmarks.truncation [--quick] [-o FOLDER] [--coefficients FOLDER]

Each model is projected by quadrature to order 16, as f and as f cos_i cos_r. The error at order N is that of f, with
the weights of docs/conventions.md, over pairs with both angles below 80 degrees: root of sum W (f - f_N)^2 over sum
W f^2, W = sin cos of both angles. Leaves truncation.csv and truncation.png, and where asked
a coefficient file for each model and quantity. The ideal mirror has no f; its spectrum is
flat, so it never ends: see benchmarks.paper_figures.
"""

from __future__ import annotations

import argparse
import csv
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from benchmarks.paper_figures import FOLDER, save
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.modes import basis as m
from photogonio.reconstruct.modes.angles import unit_vectors
from photogonio.reconstruct.modes.projection import Projection, project
from photogonio.reconstruct.modes.quadrature import azimuth_rule, elevation_rule
from photogonio.synthetic.brdf.library import MODELS

GREY = (0.5,)
LARGEST = np.radians(80)
ENDED = 1e-6  # of the norm: what is left of a series that has ended is rounding
CLASSICAL: dict[str, tuple[str, dict[str, Any]]] = {
    "Lambert": ("lambert", {"albedo": GREY}),
    "Minnaert, k = 2": ("minnaert", {"albedo": GREY, "k": 2.0}),
    "Minnaert, k = 0.7": ("minnaert", {"albedo": GREY, "k": 0.7}),
    "Oepik, k = 2": ("oepik", {"albedo": GREY, "k": 2.0}),
    "Oren-Nayar, sigma 0.5": ("oren-nayar", {"albedo": GREY, "sigma": 0.5}),
    "Oren-Nayar, qualitative": ("oren-nayar-qualitative", {"albedo": GREY, "sigma": 0.5}),
    "retro-reflector, power 40": ("retro-reflector", {"albedo": GREY}),
    "Phong, power 2": ("phong", {"albedo": GREY, "power": 2.0}),
    "Phong, power 20": ("phong", {"albedo": GREY, "power": 20.0}),
    "Blinn-Phong, power 40": ("blinn-phong", {"albedo": GREY}),
    "Blinn, c3 0.3": ("blinn", {"albedo": GREY}),
    "Torrance-Sparrow, 0.25": ("torrance-sparrow", {"albedo": GREY}),
    "GGX metal, alpha 0.3": ("ggx-conductor", {"f0": (0.9,)}),
    "GGX metal, alpha 0.6": ("ggx-conductor", {"f0": (0.9,), "roughness": 0.6}),
    "plastic, alpha 0.2": ("plastic", {"albedo": GREY}),
    "satin paint, alpha 0.4": ("satin-paint", {"albedo": GREY}),
    "glossy paint, alpha 0.03": ("glossy-paint", {"albedo": GREY}),
}


@dataclass(frozen=True, slots=True)
class Curve:
    """Truncation of one model in one quantity."""

    name: str
    quantity: str
    orders: np.ndarray  # (n,)
    error: np.ndarray  # (n,) of f, as conventions.md weighs it
    coefficient_error: float  # relative, as the projection states it
    ends: int | None  # order of the last mode, if the series ends


def judging_pairs(points: int, level: int) -> tuple[np.ndarray, np.ndarray]:
    """theta_i, theta_r, dphi (3, k) and weights W of an integral over pairs below LARGEST, fine near the mirror."""
    theta_i, outer = elevation_rule(points, level=1)
    dphi, around = azimuth_rule(points, level=level)
    columns = []
    for theta, weight in zip(theta_i, outer, strict=True):
        theta_r, inner = elevation_rule(points, level=level, peak=theta)
        grid = np.meshgrid(theta_r, dphi, indexing="ij")
        share = weight * np.cos(theta) * np.outer(inner * np.cos(theta_r), around)
        columns.append(np.stack([np.full(share.size, theta), *[g.ravel() for g in grid], share.ravel()]))
    pairs = np.concatenate(columns, axis=1)
    pairs = pairs[:, (pairs[0] < LARGEST) & (pairs[1] < LARGEST)]
    return pairs[:3], pairs[3]


def truncation(name: str, model, found: Projection, pairs, weights) -> Curve:
    """Judge every order of one projection."""
    quantity = found.quantity
    theta_i, theta_r, dphi = pairs
    exact = model(unit_vectors(theta_i, 0.0), unit_vectors(theta_r, dphi))[:, 0]
    cosines = m.cosines(quantity, theta_i, theta_r)
    orders, errors = np.arange(0, found.order + 1), []
    summed = np.zeros(len(exact))
    for last in orders:
        new = found.modes[:, 0] == last
        summed += m.evaluate_isotropic(found.modes[new], found.coefficients[new], theta_i, theta_r, dphi)[
            :, 0
        ]
        errors.append(np.sqrt(weights @ (summed / cosines - exact) ** 2 / (weights @ exact**2)))
    return Curve(name, quantity, orders, np.array(errors), float(found.error[0]), last_mode(found))


def last_mode(found: Projection) -> int | None:
    """Order of the last mode of a series that ends, None of one that goes on or exceeds the basis."""
    if not found.lost[0] < ENDED:
        return None
    held = np.abs(found.coefficients[:, 0]) > ENDED * found.norm[0]
    last = int(found.modes[held, 0].max())
    return last if last < found.order else None


def file_of(name: str, found: Projection) -> Brdf:
    """The expansion with what it stands for; the projection's stated error is in ``fit``."""
    return Brdf(
        order=found.order,
        channels=("Y",),
        modes=found.modes,
        coefficients=found.coefficients,
        standard_errors=np.zeros_like(found.coefficients),
        quantity=found.quantity,
        fit={"relative_error_of_coefficients": float(found.error[0])},
        source={"model": name, "parameters": CLASSICAL[name][1]},
    )


def slug(name: str) -> str:
    return "-".join(re.findall(r"[a-z0-9.]+", name.lower()))


def draw(curves: list[Curve], quantities: tuple[str, ...]) -> Figure:
    """One panel a quantity; what ends drops out of sight at its last order."""
    figure = Figure(figsize=(12, 5.5), layout="constrained")
    titles = {
        "brdf": "f developed",
        "brdf_cos": "f cos_i developed",
        "brdf_cos_cos": "f cos_i cos_r developed",
    }
    for axes, quantity in zip(
        np.atleast_1d(figure.subplots(1, len(quantities), sharey=True)), quantities, strict=True
    ):
        for k, curve in enumerate(c for c in curves if c.quantity == quantity):
            style = ("-", "--", ":")[k // 10 % 3]
            axes.semilogy(curve.orders, np.maximum(curve.error, 1e-9), style, label=curve.name, linewidth=1.3)
        axes.set(title=titles[quantity], xlabel="order", ylim=(1e-5, 3))
        axes.grid(alpha=0.3)
    figure.axes[0].set_ylabel("relative error of f below 80°")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside right center", fontsize=8)
    return figure


def write(curves: list[Curve], path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(
            ["model", "quantity", "ends_at", "coefficient_error", *[f"order_{n}" for n in curves[0].orders]]
        )
        for c in curves:
            ends = "" if c.ends is None else c.ends
            errors = [f"{e:.3g}" for e in np.where(c.error < 1e-9, 0.0, c.error)]
            rows.writerow([c.name, c.quantity, ends, f"{c.coefficient_error:.1e}", *errors])
    print(path)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few models, low order, coarse rules")
    parser.add_argument("-o", "--output", type=Path, default=FOLDER)
    parser.add_argument("--coefficients", type=Path, help="folder for the expansions themselves")
    options = parser.parse_args(arguments)
    for folder in filter(None, (options.output, options.coefficients)):
        folder.mkdir(parents=True, exist_ok=True)
    order, evaluations, judged = (4, 5_000, (4, 2)) if options.quick else (16, 10_000_000, (6, 6))
    names = list(CLASSICAL)[:3] if options.quick else list(CLASSICAL)
    quantities = ("brdf", "brdf_cos_cos")
    pairs, weights = judging_pairs(*judged)
    curves = []
    for name in names:
        model = MODELS[CLASSICAL[name][0]](**CLASSICAL[name][1])
        for quantity in quantities:
            found = project(model, order, quantity=quantity, tolerance=1e-7, evaluations=evaluations)
            if options.coefficients:
                file_of(name, found).save(options.coefficients / f"{slug(name)}.{quantity}.json")
            curve = truncation(name, model, found, pairs, weights)
            ends = "goes on" if curve.ends is None else f"ends at {curve.ends}"
            shown = "  ".join(f"{e:8.2g}" for e in curve.error[:: 4 if order > 4 else 2])
            print(f"{name:26s} {quantity:13s} {ends:11s} {shown}", flush=True)
            curves.append(curve)
    write(curves, options.output / "truncation.csv")
    save(draw(curves, quantities), options.output / "truncation.png")


if __name__ == "__main__":
    main()
