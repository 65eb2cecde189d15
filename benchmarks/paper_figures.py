"""The paper's figures 1 and 2, made again.

    python -m benchmarks.paper_figures [--quick] [-o FOLDER]

Figure 1: all modes up to order 4 at theta_i = 45 degrees, as functions of the exit direction. Figure 2: the ideal
glossy paint, Lambert and a 2 % mirror, at theta_i = 45 degrees, developed to orders 2, 4, 6 and 8.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from photogonio.reconstruct.modes import basis as m
from photogonio.reconstruct.modes.integrals import mirror_coefficients

FOLDER = Path(__file__).parents[1] / "docs" / "figures"
INCIDENT = np.pi / 4
MIRROR = 0.02


def save(figure: Figure, path: Path) -> None:
    """The same bytes each time."""
    FigureCanvasAgg(figure)
    figure.savefig(path, dpi=110, metadata={"Software": None})
    print(path)


def disc(count: int) -> tuple[np.ndarray, np.ndarray]:
    """theta_r and dphi on Lambert's equal-area disc, NaN off it; dphi = 0 is to the left."""
    x, y = np.meshgrid(*[np.linspace(-1, 1, count)] * 2)
    rho = np.hypot(x, y)
    theta = 2 * np.arcsin(np.where(rho <= 1, rho, np.nan) / np.sqrt(2))
    return theta, np.arctan2(y, -x)


def all_modes(size: int) -> Figure:
    """Figure 1: one disc a mode, red positive, blue negative, lines where it is zero."""
    theta, dphi = disc(size)
    modes = m.isotropic_modes(4)
    values = m.isotropic_design(4, INCIDENT, theta, dphi).T.reshape(len(modes), *theta.shape)
    figure = Figure(figsize=(11, 5.2), layout="constrained")
    top = np.nanmax(np.abs(values))
    for axes, mode, value in zip(figure.subplots(2, 7).ravel(), modes, values, strict=True):
        axes.imshow(value, extent=(-1, 1, -1, 1), origin="lower", cmap="RdBu_r", vmin=-top, vmax=top)
        if np.nanmin(value) < 0 < np.nanmax(value):
            axes.contour(value, [0.0], extent=(-1, 1, -1, 1), colors="k", linewidths=0.6)
        axes.plot([-np.sqrt(2) * np.sin(INCIDENT / 2)], [0], "k.", markersize=3)
        axes.set_title(f"$S_{{{mode[0]}{mode[1]}}}^{{{mode[2]}}}$")
        axes.set_axis_off()
    figure.suptitle(
        "All modes up to order 4 at 45° incidence (dot: the incident direction; mirror direction on the right)"
    )
    return figure


def glossy_paint(order: int, theta_r: np.ndarray, dphi: np.ndarray) -> np.ndarray:
    """f, 1/sr, of Lambert and a mirror developed to ``order`` through q = f cos_i; any shape."""
    modes = m.isotropic_modes(order)
    coefficients = mirror_coefficients(modes, MIRROR)[:, None]
    mirror = m.evaluate_isotropic(modes, coefficients, INCIDENT, theta_r, dphi) / np.cos(INCIDENT)
    return 1 / np.pi + mirror.reshape(np.broadcast_shapes(np.shape(theta_r), np.shape(dphi)))


def paint_cuts(orders: tuple[int, ...], size: int) -> Figure:
    """Figure 2: left in the plane of incidence, right around the cone of the mirror direction."""
    figure = Figure(figsize=(8, 2.3 * len(orders)), layout="constrained")
    axes = figure.subplots(len(orders), 2, subplot_kw={"projection": "polar"}, squeeze=False)
    theta = np.linspace(-np.pi / 2, np.pi / 2, size)
    turn = np.linspace(-np.pi, np.pi, size)
    for (left, right), order in zip(axes, orders, strict=True):
        left.plot(
            theta, glossy_paint(order, np.abs(theta), np.where(theta < 0, 0.0, np.pi)), "k", linewidth=1.2
        )
        left.plot(theta, np.full(size, 1 / np.pi), "0.7", linewidth=0.8)
        left.set_theta_zero_location("N")
        left.set_theta_direction(-1)
        left.set_thetalim(-np.pi / 2, np.pi / 2)
        right.plot(turn, glossy_paint(order, np.full(size, INCIDENT), turn), "k", linewidth=1.2)
        right.plot(turn, np.full(size, 1 / np.pi), "0.7", linewidth=0.8)
        right.set_theta_zero_location("W")
        for each in (left, right):
            _quiet(each)
        left.set_title(f"order {order}, plane of incidence", fontsize=9)
        right.set_title(f"order {order}, exit at 45°, azimuth (mirror direction on the right)", fontsize=9)
    return figure


def _quiet(axes: PolarAxes) -> None:
    axes.set_rticks([0.25, 0.5])
    axes.set_rmax(0.62)
    axes.tick_params(labelsize=7)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="coarse pictures")
    parser.add_argument("-o", "--output", type=Path, default=FOLDER)
    options = parser.parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    save(all_modes(41 if options.quick else 201), options.output / "modes-to-order-4.png")
    orders = (2, 8) if options.quick else (2, 4, 6, 8)
    save(paint_cuts(orders, 61 if options.quick else 721), options.output / "glossy-paint.png")


if __name__ == "__main__":
    main()
