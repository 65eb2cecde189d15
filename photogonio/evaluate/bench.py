"""A rendered set with its photos read, so that settings can be tried at the cost of reducing and fitting alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from photogonio.calib.setup import Setup, ViewSetup
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.radiance import RadianceImage
from photogonio.compare.known import Known
from photogonio.compare.reflectances import load_known
from photogonio.evaluate.scenes import INNER, against
from photogonio.evaluate.truth import TRUTH
from photogonio.reconstruct.fit import FitOptions, PhotoErrors, fit_table
from photogonio.reconstruct.lighting.stray_limits import without_spoilt
from photogonio.reconstruct.reduce.directions import (
    USED,
    ReduceOptions,
    pairs_at,
    region_of,
    region_pixels,
    scene_of,
)
from photogonio.reconstruct.reduce.ray_grid import lens_of
from photogonio.reconstruct.reduce.reduce import reduce_view, samples_of, unit_weight
from photogonio.reconstruct.table.facet_table import FacetTable, add_tables
from photogonio.reconstruct.table.goniometer_csv import UNBINNED
from photogonio.run.circumstances import view_errors
from photogonio.run.surroundings import LightAround, light_around


@dataclass(frozen=True, slots=True)
class Bench:
    """A set's photos, how they were calibrated, and the truth."""

    setup: Setup
    images: tuple[tuple[ViewSetup, RadianceImage], ...]
    around: ReduceOptions
    beside: LightAround
    truth: Known

    def table(self, level: int, stride: int = 1) -> FacetTable:
        """The facet table of every ``stride``-th pixel in x and in y."""
        return self.usable(
            add_tables(
                [
                    reduce_view(self.setup, v, thinned(image, stride), level, self.around)
                    for v, image in self.images
                ]
            )
        )

    def usable(self, table: FacetTable) -> FacetTable:
        """Without what stray light may spoil that is not known."""
        return table if self.beside.unknown is None else without_spoilt(table, self.beside.unknown)[0]

    def error(self, table: FacetTable, order: int | None = None) -> float:
        """Relative L2 below 70 degrees of the fit."""
        options = FitOptions(order=order, absolute=self.setup.scale == "absolute")
        fit = fit_table(
            table,
            options,
            PhotoErrors(view_errors(self.setup, table), stray=self.beside.known, doubt=self.beside.unknown),
        )
        return float(against(fit.brdf, self.truth, INNER).measures["relative_l2"].max())


def open_bench(folder: Path, setup: Setup, table: FacetTable) -> Bench:
    """Read the photos of a run that found ``setup`` and ``table``."""
    photoset = load_photoset(folder).turned_to(setup.turned)
    reader = prepare(photoset)
    views = {view.name: view for view in photoset.views("sample")}
    around = ReduceOptions(
        isotropic=True, mirror_balls=photoset.mirror_balls, white_patches=photoset.white_patches
    )
    images = tuple((view, reader.read(views[view.name])) for view in setup.views)
    beside, _ = light_around(reader, setup, table)
    return Bench(setup, images, around, beside, load_known(folder / TRUTH))


def thinned(image: RadianceImage, stride: int) -> RadianceImage:
    """Only every ``stride``-th pixel is valid."""
    keep = np.zeros_like(image.valid)
    keep[::stride, ::stride] = True
    return replace(image, valid=image.valid & keep)


def direct_table(bench: Bench, count: int) -> FacetTable:
    """About ``count`` single pixels of all views as a table of samples, none binned; evenly spaced, no chance."""
    parts = [_samples(bench, view, image) for view, image in bench.images]
    total = sum(len(part["weight"]) for part in parts)
    step = max(1, total // count)
    thin = [{name: values[::step] for name, values in part.items()} for part in parts]
    group = np.repeat(np.arange(len(thin), dtype=np.int32), [len(part["weight"]) for part in thin])
    joined = {name: np.concatenate([part[name] for part in thin]) for name in thin[0]}
    rows = np.arange(len(group), dtype=np.int32)
    table = FacetTable(
        level=UNBINNED,
        channels=bench.setup.channels,
        groups=tuple(view.name for view, _ in bench.images),
        isotropic=True,
        group=group,
        facet_i=rows,
        facet_r=rows.copy(),
        count=np.ones(len(rows)),
        finer=0,
        **joined,
    )
    return bench.usable(table)


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
