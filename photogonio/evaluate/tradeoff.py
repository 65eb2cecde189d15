"""Error against time over the knobs that trade them, on one scene; where the knee is, and what ``auto`` takes."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter

from photogonio.calib.setup import Setup
from photogonio.capture.errors import InputError
from photogonio.evaluate.bench import Bench, direct_table, open_bench
from photogonio.evaluate.scenes import Score, spread_over_processes
from photogonio.reconstruct.table.facet_table import FacetTable


@dataclass(frozen=True, slots=True)
class Settings:
    """What each knob is turned to, beside what auto takes."""

    levels: tuple[int, ...] = (1, 2, 3, 4, 5)
    orders: tuple[int, ...] = (0, 2, 4, 6, 8)
    strides: tuple[int, ...] = (8, 4, 2, 1)  # every how manieth pixel in x and in y
    samples: tuple[int, ...] = (2000, 8000, 20000)  # single pixels, not binned


FULL = Settings()
FEW = Settings(levels=(1, 2, 3), orders=(0, 4), strides=(4, 1), samples=(1000,))
_LEAST_GAIN = 0.05  # a knee must lie this far below the chord, in the unit square of the logarithms


@dataclass(frozen=True, slots=True)
class Point:
    """One setting of one knob."""

    knob: str
    setting: str
    seconds: float  # of processor time, other programs do not count; reduce and fit, without reading
    error: float  # relative L2 below 70 degrees, worst channel
    auto: bool = False  # what auto takes
    knee: bool = False


@dataclass(frozen=True, slots=True)
class Run:
    """What is reduced and fitted for a point."""

    level: int
    stride: int = 1
    order: int | None = None  # None: as auto takes it
    samples: int | None = None  # so many single pixels instead of the table


Setting = tuple[str, str, bool, Run]  # knob, what it is turned to, whether auto takes that, what is run


def settings_of(level: int, turn: Settings) -> list[Setting]:
    """Every knob turned alone, all else automatic; ``level`` is what auto takes for the facets."""
    auto = Run(level)
    return [
        *(("facet level", str(k), k == level, Run(k)) for k in turn.levels),
        *(("order", str(n), False, Run(level, order=n)) for n in turn.orders),
        ("order", "auto", True, auto),
        *(("pixels", f"1/{k * k}", k == 1, Run(coarser(level, k), stride=k)) for k in turn.strides),
        ("table or samples", f"table {level}", True, auto),
        *(("table or samples", f"{n} samples", False, Run(level, samples=n)) for n in turn.samples),
    ]


def coarser(level: int, stride: int) -> int:
    """The level whose cells hold as many pixels when only every ``stride``-th in x and y is used."""
    return max(1, level - round(math.log2(stride)))


def tradeoffs(folder: Path, score: Score, turn: Settings, workers: int) -> list[Point]:
    """Error and time of every setting of every knob on the scene of ``score``; knees marked.

    What several knobs share (all automatic) is run once. A setting that leaves nothing to fit is passed over.
    """
    settings = settings_of(score.result.table.level, turn)
    runs = list(dict.fromkeys(run for *_, run in settings))
    shares = [runs[k::workers] for k in range(min(workers, len(runs)))]
    jobs = [(folder, score.result.measured, score.result.table, share) for share in shares]
    found: dict[Run, tuple[float, float]] = {}
    for share, timed in zip(shares, spread_over_processes(_timed, jobs, workers), strict=True):
        found |= dict(zip(share, timed, strict=True))
    points = [Point(knob, name, *found[run], auto) for knob, name, auto, run in settings]
    return mark_knees([point for point in points if np.isfinite(point.error)])


def _timed(job: tuple[Path, Setup, FacetTable, list[Run]]) -> list[tuple[float, float]]:
    """Processor seconds and error (NaN if refused) of each run."""
    folder, setup, table, runs = job
    bench = open_bench(folder, setup, table)
    error_of(bench, Run(1))  # unmeasured: compilation and caches are not the knobs' doing
    timed = []
    for run in runs:
        start = time.process_time()
        try:
            error = error_of(bench, run)
        except InputError:
            error = math.nan
        timed.append((time.process_time() - start, error))
    return timed


def error_of(bench: Bench, run: Run) -> float:
    """Relative L2 below 70 degrees, worst channel, of what the run fits."""
    table = direct_table(bench, run.samples) if run.samples else bench.table(run.level, run.stride)
    return bench.error(table, run.order)


def mark_knees(points: Sequence[Point]) -> list[Point]:
    """In each knob's points, the one that lies farthest below the chord of its lower-left front, if any does.

    The front of points that no other beats in both time and error; logarithms of both, scaled to the unit square
    (Satopaa, Albrecht, Irwin & Raghavan 2011).
    """
    knees = set()
    for knob in dict.fromkeys(point.knob for point in points):
        front = _front([point for point in points if point.knob == knob])
        best = _knee(front)
        if best is not None:
            knees.add(id(best))
    return [replace(point, knee=id(point) in knees) for point in points]


def _front(points: Iterable[Point]) -> list[Point]:
    front: list[Point] = []
    for point in sorted(points, key=lambda p: (p.seconds, p.error)):
        if not front or point.error < front[-1].error:
            front.append(point)
    return front


def _knee(front: Sequence[Point]) -> Point | None:
    if len(front) == 0:
        return None
    if len(front) < 3:  # no chord to lie below: the better bargain
        return min(front, key=lambda p: p.seconds * p.error)
    x = np.log([point.seconds for point in front])
    y = np.log([point.error for point in front])
    x, y = (x - x[0]) / (x[-1] - x[0]), (y - y[-1]) / (y[0] - y[-1])
    below = 1.0 - x - y
    k = int(np.argmax(below))
    return front[k] if below[k] > _LEAST_GAIN else front[-1]


def tradeoff_figure(points: Sequence[Point], title: str) -> Figure:
    """Error against time, a panel a knob; knee and auto marked."""
    knobs = list(dict.fromkeys(point.knob for point in points))
    figure = Figure(figsize=(3.3 * len(knobs), 3.5), layout="constrained")
    figure.suptitle(title, fontsize=11)
    for ax, knob in zip(np.atleast_1d(figure.subplots(1, len(knobs), sharey=True)), knobs, strict=True):
        mine = [point for point in points if point.knob == knob]
        ax.set(xscale="log", yscale="log", xlabel="processor seconds, reduce and fit")
        ax.set_title(knob, fontsize=10)
        for axis in (ax.xaxis, ax.yaxis):  # plain numbers, also over less than a decade
            axis.set_major_formatter(LogFormatter())
            axis.set_minor_formatter(LogFormatter(minor_thresholds=(2.0, 0.5)))
        ax.plot([p.seconds for p in mine], [100 * p.error for p in mine], "o", color="#3d4f66", markersize=5)
        for point in mine:
            ax.annotate(
                point.setting,
                (point.seconds, 100 * point.error),
                fontsize=7,
                xytext=(4, 4),
                textcoords="offset points",
            )
            if point.knee:
                ax.plot(point.seconds, 100 * point.error, "o", mfc="none", mec="#c8372d", ms=12, label="knee")
            if point.auto:
                ax.plot(point.seconds, 100 * point.error, "s", mfc="none", mec="#2f8f46", ms=9, label="auto")
        ax.margins(0.3)
        ax.grid(which="both", alpha=0.25)
        ax.legend(fontsize=8)
    figure.axes[0].set_ylabel("error below 70 degrees, %")
    return figure


def tradeoff_lines(points: Sequence[Point]) -> list[str]:
    """What each knob's knee is, and what auto takes and costs."""
    lines = []
    for knob in dict.fromkeys(point.knob for point in points):
        mine = [point for point in points if point.knob == knob]
        said = [
            f"{name} {point.setting} ({100 * point.error:.2f} %, {point.seconds:.2f} s)"
            for name, chosen in (("knee", [p for p in mine if p.knee]), ("auto", [p for p in mine if p.auto]))
            for point in chosen
        ]
        lines.append(f"{knob}: {'; '.join(said)}")
    return lines
