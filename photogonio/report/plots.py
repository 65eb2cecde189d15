"""Pictures of tables, fits and BRDFs. Every function returns a figure or an array and touches no file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Circle
from matplotlib.ticker import FuncFormatter, MaxNLocator

from photogonio.reconstruct.modes.angles import pair_angles
from photogonio.reconstruct.table.cells import few_of
from photogonio.reconstruct.table.facet_table import FacetTable
from photogonio.report.ball import BALL_LIGHTS, shaded_sphere, to_display
from photogonio.report.misfit import correlation

Evaluate = Callable[[np.ndarray, np.ndarray], np.ndarray]  # incident, exit (n, 3) -> f (n, c)

_INK, _FAINT = "#24292f", "#c8ccd2"
_NAMED = {"R": "#c8372d", "G": "#2f8f46", "B": "#2f64b5", "r": "#c8372d", "g": "#2f8f46", "b": "#2f64b5"}
_OTHERS = ("#3d4f66", "#b3711f", "#7a4ea3", "#1f8a8c", "#9c3d5f", "#6b7a1f")
_BANDS = np.radians(np.arange(0, 91, 15))  # of the incident angle, in the coverage
_DISK = 2.2  # radii from one disk of the coverage to the next
_LOBE_ANGLES = np.radians([0.0, 30.0, 60.0])
_MOST = 6  # channels of a spectrum that are drawn: more panels and curves nobody can read
_ABOVE = 1.0  # where titles stand, said: to find it, matplotlib makes all ticks, those of hidden axes too


def channel_colour(channels: Sequence[str], k: int) -> str:
    """One colour a channel: its own for R, G and B, else from a short list."""
    return _NAMED.get(channels[k], _OTHERS[k % len(_OTHERS)])


def drawn_channels(channels: Sequence[str]) -> list[str]:
    """Those of a spectrum's channels that pictures show: evenly taken, the first and the last among them."""
    return [channels[k] for k in few_of(len(channels), _MOST)]


def coverage_figure(table: FacetTable) -> Figure:
    """Where the samples lie: the exit hemisphere (equal-area, relative to the light) by incidence."""
    theta_i, theta_r, dphi = pair_angles(table.incident, table.exit)
    figure = Figure(figsize=(9.6, 2.5))
    # all disks in one plain frame: polar ones, each with its ticks, take five times as long
    ax = figure.add_axes((0.01, 0.29, 0.98, 0.61), aspect="equal")
    ax.set_axis_off()
    ax.set(xlim=(-1.0, _DISK * (len(_BANDS) - 2) + 1.0), ylim=(-1.05, 1.05))
    fine = table.level >= 3
    radius = np.sqrt(np.linspace(0, 1, 13 if fine else 9))
    azimuth = np.linspace(-np.pi, np.pi, 49 if fine else 25)
    # bilateral symmetry: every sample stands for its mirror image too
    sums = [
        np.histogram2d(
            np.concatenate([dphi[k], -dphi[k]]),
            np.tile(np.sqrt(1 - np.cos(theta_r[k])), 2),
            bins=[azimuth, radius],
            weights=np.tile(table.count[k], 2),
        )[0]
        for k in (_in_band(theta_i, low, high) for low, high in _band_pairs())
    ]
    norm = LogNorm(1, max(10.0, max(s.max() for s in sums)))
    x, y = np.cos(azimuth) * radius[:, None], np.sin(azimuth) * radius[:, None]
    for k, (total, (low, high)) in enumerate(zip(sums, _band_pairs(), strict=True)):
        left = _DISK * k
        ax.add_patch(Circle((left, 0.0), 1.0, color="#f2f3f5", zorder=0))
        mesh = ax.pcolormesh(left + x, y, np.where(total > 0, total, np.nan).T, norm=norm, cmap="viridis")
        _dress_disk(ax, left, low, high)
    bar = figure.add_axes((0.3, 0.215, 0.4, 0.03))
    plain = FuncFormatter(lambda value, _: f"{value:,.0f}")  # powers as formulae take fonts of their own
    shown = figure.colorbar(mesh, cax=bar, orientation="horizontal", label="samples", format=plain)
    shown.minorticks_off()  # each would be a line of its own
    return figure


def _band_pairs() -> list[tuple[float, float]]:
    return list(pairwise(_BANDS))


def _in_band(theta: np.ndarray, low: float, high: float) -> np.ndarray:
    return np.flatnonzero((theta >= low) & (theta < high))


def _dress_disk(ax: Axes, left: float, low: float, high: float) -> None:
    """Rings at 30 and 60 degrees, spokes, the light, and which angles of incidence the disk is of."""
    for ring in np.radians([30.0, 60.0]):
        ax.add_patch(_ring(left, np.sqrt(1 - np.cos(ring)), _FAINT, 0.6))
    ax.hlines(0.0, left - 1.0, left + 1.0, color=_FAINT, linewidth=0.6)
    ax.vlines(left, -1.0, 1.0, color=_FAINT, linewidth=0.6)
    ax.add_patch(_ring(left, 1.0, "black", 0.8))
    light = left + np.sqrt(1 - np.cos(0.5 * (low + high)))
    ax.plot(light, 0.0, marker="o", color="#e8a33d", markersize=5, markeredgecolor="white", clip_on=False)
    title = f"{np.degrees(low):.0f}–{np.degrees(high):.0f}°"
    ax.text(left, 1.1, title, fontsize=10, color=_INK, ha="center", va="bottom")


def _ring(left: float, radius: float, color: str, width: float) -> Circle:
    return Circle(
        (left, 0.0), radius, fill=False, edgecolor=color, linewidth=width, zorder=1.5, clip_on=False
    )


def scatter_figure(
    observed: np.ndarray,
    fitted: np.ndarray,
    channels: Sequence[str],
    *,
    labels: tuple[str, str] = ("observed f, 1/sr", "fitted f, 1/sr"),
) -> Figure:
    """Fitted (n, c) against observed (n, c), a panel a channel, with the correlation (the seed's fig. 3); of a
    spectrum some channels (:func:`drawn_channels`)."""
    some = few_of(len(channels), _MOST)
    observed, fitted, channels = observed[:, some], fitted[:, some], drawn_channels(channels)
    width = 3.2 * max(2, len(channels))
    figure = Figure(figsize=(width, 3.4))
    margins = {"left": 0.75 / width, "right": 1.0 - 0.12 / width, "bottom": 0.15, "top": 0.9, "wspace": 0.24}
    axes = np.atleast_1d(figure.subplots(1, len(channels), gridspec_kw=margins))
    for k, ax in enumerate(axes):
        x, y = observed[:, k], fitted[:, k]
        keep = np.isfinite(x) & np.isfinite(y)
        low, high = _limits(x[keep], y[keep])
        ax.plot([low, high], [low, high], color=_INK, linewidth=0.8, zorder=3)
        colour = channel_colour(channels, k)
        ax.scatter(x[keep], y[keep], s=4, alpha=0.25, linewidths=0, color=colour, rasterized=True)
        ax.set(xlim=(low, high), ylim=(low, high), aspect="equal")
        ax.set_xlabel(labels[0], fontsize=9)
        ax.set_ylabel(labels[1] if k == 0 else "", fontsize=9)
        said = f"{channels[k]}, correlation {correlation(x, y):.4f}"
        ax.set_title(said, fontsize=9, color=_INK, pad=7, y=_ABOVE)
        _dress(ax)
    return figure


def _limits(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Common limits that hold what was fitted, and all but some outliers of what was observed."""
    if len(x) == 0:
        return 0.0, 1.0
    low, high = min(np.quantile(x, 0.002), y.min()), max(np.quantile(x, 0.99), np.quantile(y, 0.999))
    margin = 0.06 * (high - low) or 0.1 * abs(high) or 1.0
    return min(low - margin, 0.0 if 0 <= low < 0.3 * high else low - margin), high + margin


def _dress(ax: Axes) -> None:
    ax.grid(color=_FAINT, linewidth=0.5, alpha=0.6)
    ax.tick_params(labelsize=8, colors=_INK)
    for side in ax.spines.values():
        side.set_color(_FAINT)


def lobes_figure(
    evaluate: Evaluate,
    channels: Sequence[str],
    *,
    valid: float = np.pi / 2,
) -> Figure:
    """f in the plane of incidence as polar curves on one radial scale, light from the left at 0, 30 and 60 degrees.

    Beyond ``valid`` (radians, of the exit angle) the curves are dashed: not seen, or hardly. Of a spectrum some
    channels are drawn (:func:`drawn_channels`).
    """
    figure = Figure(figsize=(9.6, 2.7))
    figure.subplots_adjust(left=0.05, right=0.99, bottom=0.02, top=0.9, wspace=0.04)
    _draw_lobes(figure, evaluate, channels, valid)
    return figure


def _draw_lobes(
    figure: Figure | SubFigure, evaluate: Evaluate, channels: Sequence[str], valid: float
) -> None:
    axes = figure.subplots(1, len(_LOBE_ANGLES))
    theta = np.radians(np.linspace(-89.5, 89.5, 359))
    seen = np.abs(theta) <= valid
    some, channels = few_of(len(channels), _MOST), drawn_channels(channels)
    lobes = [np.maximum(evaluate(*plane_of_incidence(angle, theta))[:, some], 0.0) for angle in _LOBE_ANGLES]
    # one radius for all; a glossy rise at unseen grazing angles would flatten the rest
    top = max(1e-9, *(float(np.max(f[seen])) for f in lobes))
    for ax, angle, f in zip(axes, _LOBE_ANGLES, lobes, strict=True):
        _dress_half(ax, top, angle)
        x, y = f * np.sin(theta)[:, None] / top, f * np.cos(theta)[:, None] / top
        for k in range(f.shape[1]):
            colour = channel_colour(channels, k)
            ax.plot(x[:, k], y[:, k], color=colour, linewidth=1.0, linestyle=(0, (2, 2)))
            ax.plot(np.where(seen, x[:, k], np.nan), y[:, k], color=colour, linewidth=1.8, label=channels[k])
    axes[0].legend(loc="upper left", fontsize=8, frameon=False, bbox_to_anchor=(-0.12, 1.12))


def _dress_half(ax: Axes, top: float, angle: float) -> None:
    """A half disk of radius 1.1 with rings at round values of f, and the light's arrow."""
    arc = np.radians(np.linspace(-90, 90, 181))
    rings = [
        value for value in MaxNLocator(3, steps=[1, 2, 2.5, 5, 10]).tick_values(0, top) if value <= 1.1 * top
    ]
    for value in rings[1:]:
        ax.plot(value / top * np.sin(arc), value / top * np.cos(arc), color=_FAINT, linewidth=0.6, zorder=0)
        ax.text(-value / top, -0.04, f"{value:g}", fontsize=7, color=_INK, ha="center", va="top")
    for spoke in np.radians(np.arange(-90, 91, 30)):
        ax.plot([0, 1.1 * np.sin(spoke)], [0, 1.1 * np.cos(spoke)], color=_FAINT, linewidth=0.6, zorder=0)
        if abs(spoke) < 1.5:
            label = f"{abs(np.degrees(spoke)):.0f}°"
            ax.text(1.18 * np.sin(spoke), 1.18 * np.cos(spoke), label, fontsize=7, color=_INK, ha="center")
    start = (-1.1 * np.sin(angle), 1.1 * np.cos(angle))
    ax.annotate("", xy=(0, 0), xytext=start, arrowprops={"arrowstyle": "-|>", "color": "#e8a33d", "lw": 1.6})
    ax.set(xlim=(-1.25, 1.25), ylim=(-0.14, 1.32), aspect="equal")
    ax.set_axis_off()
    ax.set_title(f"light at {np.degrees(angle):.0f}°, f in 1/sr", fontsize=10, color=_INK, y=_ABOVE)


def plane_of_incidence(theta_i: float, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Incident and exit unit vectors (n, 3): light on the left (-x), exit angle ``theta`` to the right."""
    incident = np.tile([-np.sin(theta_i), 0.0, np.cos(theta_i)], (len(theta), 1))
    return incident, np.column_stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)])


def _draw_cuts(figure: Figure | SubFigure, evaluate: Evaluate, channels: Sequence[str], valid: float) -> None:
    axes = figure.subplots(1, 2)
    some, channels = few_of(len(channels), _MOST), drawn_channels(channels)
    theta = np.radians(np.linspace(-89.5, 89.5, 359))
    for ax, azimuth, title in zip(
        axes, (0.0, np.pi / 2), ("in the plane of incidence", "across it"), strict=True
    ):
        top = 0.0
        for angle, style in zip(_LOBE_ANGLES, ("-", "--", ":"), strict=True):
            incident, _ = plane_of_incidence(angle, theta)
            exit = np.column_stack(
                [np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)]
            )
            f = evaluate(incident, exit)[:, some]
            top = max(top, f[np.abs(theta) <= valid].max())
            for k in range(f.shape[1]):
                label = f"{np.degrees(angle):.0f}°" if k == 0 else None
                ax.plot(
                    np.degrees(theta), f[:, k], style, color=channel_colour(channels, k), lw=1.3, label=label
                )
        ax.set(xlim=(-90, 90), ylim=(0, 1.25 * top), xlabel="exit angle, degrees", ylabel="f, 1/sr")
        ax.set_title(title, fontsize=10, color=_INK)
        ax.legend(title="light at", fontsize=8, title_fontsize=8, frameon=False, loc="upper left", ncols=3)
        _dress(ax)


def overview_figure(
    evaluate: Evaluate, channels: Sequence[str], title: str, *, valid: float = np.pi / 2
) -> Figure:
    """Everything at a glance: lobes, cuts, and a shaded ball under three lights."""
    figure = Figure(figsize=(10.2, 9.6), layout="constrained")
    figure.suptitle(title, fontsize=13, color=_INK)
    parts = figure.subfigures(3, 1, height_ratios=[2.8, 3.4, 3.2])
    top, middle, bottom = np.asarray(parts)
    _draw_lobes(top, evaluate, channels, valid)
    _draw_cuts(middle, evaluate, channels, valid)
    balls = [shaded_sphere(evaluate, light, size=320) for light in BALL_LIGHTS.values()]
    white = max(float(np.nanquantile(ball, 0.98)) for ball in balls)
    for ax, ball, name in zip(bottom.subplots(1, len(balls)), balls, BALL_LIGHTS, strict=True):
        ax.imshow(to_display(ball, white=white, background=1.0), interpolation="antialiased")
        ax.set_axis_off()
        ax.set_title(f"light {name}", fontsize=10, color=_INK)
    return figure


def draws_figure(drawn: Sequence[Evaluate], title: str) -> Figure:
    """A ball of each under the same light and exposure: how much they differ is how unsure the picture is."""
    columns = int(np.ceil(np.sqrt(len(drawn))))
    rows = -(-len(drawn) // columns)
    figure = Figure(figsize=(1.9 * columns + 0.4, 1.9 * rows + 0.7), layout="constrained")
    figure.suptitle(title, fontsize=10, color=_INK)
    axes = np.atleast_1d(figure.subplots(rows, columns, squeeze=False)).ravel()
    balls = [shaded_sphere(one, BALL_LIGHTS["over the shoulder"], size=160) for one in drawn]
    white = max(float(np.nanquantile(ball, 0.99)) for ball in balls)
    for ax in axes:
        ax.set_axis_off()
    for ax, ball in zip(axes, balls, strict=False):
        ax.imshow(to_display(ball, white=white, background=1.0), interpolation="antialiased")
    return figure
