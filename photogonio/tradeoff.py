"""Error against time over the knobs that trade them, on one scene; where the knee is, and what ``auto`` takes."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from calib.setup import Setup, ViewSetup
from capture.errors import InputError
from capture.manifest import load_photoset
from capture.prepare import prepare
from capture.radiance import RadianceImage
from photogonio.evaluate import INNER, Score, against
from photogonio.pipeline import view_errors
from photogonio.reflectances import Known, load_known
from photogonio.surroundings import stray_light
from photogonio.truth import TRUTH
from reconstruct.directions import USED, ReduceOptions, pairs_at, region_of, region_pixels, scene_of
from reconstruct.fit import FitOptions, fit_table
from reconstruct.lens import lens_of
from reconstruct.measured import UNBINNED
from reconstruct.reduce import reduce_view, samples_of, unit_weight
from reconstruct.stray import StrayLight
from reconstruct.table import FacetTable, add_tables


@dataclass(frozen=True, slots=True)
class Settings:
    """What each knob is turned to, beside what auto takes."""

    levels: tuple[int, ...] = (1, 2, 3, 4, 5)
    orders: tuple[int, ...] = (0, 2, 4, 6, 8)
    strides: tuple[int, ...] = (8, 4, 2, 1)  # every how manieth pixel in x and in y
    samples: tuple[int, ...] = (2000, 8000, 20000)  # single pixels, not binned


FULL = Settings()
FEW = Settings(levels=(1, 2, 3), orders=(0, 4), strides=(4, 1), samples=(2000,))
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
class Bench:
    """A scene with its photos read, so that settings can be tried at the cost of reducing and fitting alone."""

    setup: Setup
    images: tuple[tuple[ViewSetup, RadianceImage], ...]
    around: ReduceOptions
    stray: StrayLight | None
    truth: Known

    def table(self, level: int, stride: int = 1) -> FacetTable:
        """The facet table of every ``stride``-th pixel in x and in y."""
        return add_tables(
            [
                reduce_view(self.setup, v, thinned(image, stride), level, self.around)
                for v, image in self.images
            ]
        )

    def error(self, table: FacetTable, **asked: int | None) -> float:
        """Relative L2 below 70 degrees of the fit."""
        options = FitOptions(absolute=self.setup.scale == "absolute", **asked)
        fit = fit_table(table, options, view_errors=view_errors(self.setup, table), stray=self.stray)
        return float(against(fit.brdf, self.truth, INNER).measures["relative_l2"].max())


def open_bench(folder: Path, score: Score) -> Bench:
    """Read the photos that the score's run used."""
    photoset = load_photoset(folder)
    reader, setup = prepare(photoset), score.result.setup
    views = {view.name: view for view in photoset.views("sample")}
    around = ReduceOptions(
        isotropic=True, mirror_balls=photoset.mirror_balls, white_patches=photoset.white_patches
    )
    images = tuple((view, reader.read(views[view.name])) for view in setup.views)
    stray = stray_light(reader, setup, score.result.table)
    return Bench(setup, images, around, stray, load_known(folder / TRUTH))


def thinned(image: RadianceImage, stride: int) -> RadianceImage:
    """Only every ``stride``-th pixel is valid."""
    keep = np.zeros_like(image.valid)
    keep[::stride, ::stride] = True
    return replace(image, valid=image.valid & keep)


def tradeoffs(
    bench: Bench, level: int, tell: Callable[[int, int], None], turn: Settings = FULL
) -> list[Point]:
    """Every knob turned alone, all else automatic; knees marked.

    ``level`` is what auto takes for the facets. A setting that leaves nothing to fit is passed over.
    """
    table = bench.table(level)
    settings: list[tuple[str, str, bool, Callable[[], float]]] = [
        *(("facet level", str(k), k == level, lambda k=k: bench.error(bench.table(k))) for k in turn.levels),
        *(("order", str(n), False, lambda n=n: bench.error(table, order=n)) for n in turn.orders),
        ("order", "auto", True, lambda: bench.error(table)),
        *(
            (
                "pixels",
                f"1/{k * k}",
                k == 1,
                lambda k=k: bench.error(bench.table(coarser(level, k), stride=k)),
            )
            for k in turn.strides
        ),
        ("table or samples", f"table {level}", True, lambda: bench.error(bench.table(level))),
        *(
            ("table or samples", f"{n} samples", False, lambda n=n: bench.error(direct_table(bench, n)))
            for n in turn.samples
        ),
    ]
    bench.error(table)  # once unmeasured: compilation and caches are not the knobs' doing
    points = []
    for done, (knob, setting, auto, run) in enumerate(settings, 1):
        start = time.process_time()
        try:
            error = run()
        except InputError:
            error = float("nan")
        points.append(Point(knob, setting, time.process_time() - start, error, auto))
        tell(done, len(settings))
    return mark_knees([point for point in points if np.isfinite(point.error)])


def coarser(level: int, stride: int) -> int:
    """The level whose cells hold as many pixels when only every ``stride``-th in x and y is used."""
    return max(1, level - round(math.log2(stride)))


def direct_table(bench: Bench, count: int) -> FacetTable:
    """About ``count`` single pixels of all views as a table of samples, none binned; evenly spaced, no chance."""
    parts = [_samples(bench, view, image) for view, image in bench.images]
    total = sum(len(part["weight"]) for part in parts)
    step = max(1, total // count)
    thin = [{name: values[::step] for name, values in part.items()} for part in parts]
    group = np.repeat(np.arange(len(thin), dtype=np.int32), [len(part["weight"]) for part in thin])
    joined = {name: np.concatenate([part[name] for part in thin]) for name in thin[0]}
    rows = np.arange(len(group), dtype=np.int32)
    return FacetTable(
        level=UNBINNED,
        channels=bench.setup.channels,
        groups=tuple(view.name for view, _ in bench.images),
        isotropic=True,
        group=group,
        facet_i=rows,
        facet_r=rows.copy(),
        count=np.ones(len(rows)),
        **joined,
    )


def _samples(bench: Bench, view: ViewSetup, image: RadianceImage) -> dict[str, np.ndarray]:
    """One view's pixels as the sums of a table."""
    scene, region = scene_of(bench.setup, view, bench.around), region_of(bench.setup, view.pose)
    x0, y0, x1, y1 = region
    cut = replace(
        image,
        value=image.value[y0:y1, x0:x1],
        variance=image.variance[y0:y1, x0:x1],
        valid=image.valid[y0:y1, x0:x1],
        saturated=image.saturated[y0:y1, x0:x1],
    )
    pairs = pairs_at(scene, bench.setup.camera, region_pixels(region))
    omega = unit_weight(scene, lens_of(bench.setup.camera), region, image)
    samples = samples_of(scene, pairs, cut, omega=omega)
    kept = samples.reason == USED
    weight = samples.omega[kept]
    value, variance = samples.value[kept], samples.variance[kept]
    w = weight[:, None]
    return {
        "weight": weight,
        "value": w * value,
        "value2": w * value**2,
        "variance": w**2 * variance,
        "incident": w * pairs.incident[kept],
        "exit": w * pairs.exit[kept],
        "place": w * pairs.point[kept],
    }


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
        ax.margins(0.2)
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
