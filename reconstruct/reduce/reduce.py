"""One view's photo, reduced to its facet-pair table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from photogonio.calib.setup import Setup, ViewSetup
from photogonio.capture.radiance import RadianceImage
from photogonio.reconstruct.reduce.directions import (
    USED,
    Pairs,
    ReduceOptions,
    ViewScene,
    pairs_along,
    pairs_at,
    region_of,
    region_pixels,
    scene_of,
)
from photogonio.reconstruct.reduce.fused import Frame, reduce_region, rig_of
from photogonio.reconstruct.reduce.ray_grid import Lens, lens_of
from photogonio.reconstruct.table.facet_table import LEFT_OUT, FacetTable, accumulate, table_of_sums
from photogonio.reconstruct.table.refinement import finer_of, refined_facets

SAMPLED = 1024  # pixels of the region, about, that a view's typical variance is taken from
Region = tuple[int, int, int, int]


def reduce_view(
    setup: Setup,
    view: ViewSetup,
    radiance: RadianceImage,
    level: int,
    options: ReduceOptions,
    *,
    threads: int = 1,
) -> FacetTable:
    """The facet-pair table of one view, of one group that bears the view's name.

    ``table.left_out`` counts the pixels of the sample that were left out, by reason. The table is empty where
    no pixel can be used. The same bytes for any number of ``threads``.
    """
    scene = scene_of(setup, view, options)
    region = region_within(setup, view, radiance)
    lens = lens_of(setup.camera)
    omega = unit_weight(scene, lens, region, radiance)
    rig = rig_of(scene, omega=omega)
    keys, sums, left_out = reduce_region(rig, lens, frame_of(radiance), region, level, threads)
    return table_of_sums(
        level=level,
        channels=setup.channels,
        groups=(view.name,),
        isotropic=scene.isotropic,
        keys=keys,
        sums=sums,
        left_out=left_out[None],
        finer=finer_of(level),
    )


def reduce_view_plainly(
    setup: Setup, view: ViewSetup, radiance: RadianceImage, level: int, options: ReduceOptions
) -> FacetTable:
    """What :func:`reduce_view` does, in vectorised numpy: the reference that the kernel is held against."""
    scene = scene_of(setup, view, options)
    region = region_within(setup, view, radiance)
    omega = unit_weight(scene, lens_of(setup.camera), region, radiance)
    pairs = pairs_at(scene, setup.camera, region_pixels(region))
    samples = samples_of(scene, pairs, _cut(radiance, region), omega=omega)
    kept = samples.reason == USED
    incident, exit_ = pairs.incident[kept], pairs.exit[kept]
    facet_i, facet_r = refined_facets(incident, exit_, level, finer_of(level))
    return accumulate(
        level=level,
        channels=setup.channels,
        name=view.name,
        isotropic=scene.isotropic,
        facet_i=facet_i,
        facet_r=facet_r,
        incident=incident,
        exit=exit_,
        place=pairs.point[kept],
        omega=samples.omega[kept],
        value=samples.value[kept],
        variance=samples.variance[kept],
        left_out=np.bincount(samples.reason[samples.reason >= 0], minlength=len(LEFT_OUT)),
        finer=finer_of(level),
    )


@dataclass(frozen=True, slots=True)
class BrdfSamples:
    """BRDF values of the pixels of a region."""

    reason: np.ndarray  # (n,) int8: USED, OUTSIDE, or an index in LEFT_OUT
    value: np.ndarray  # (n, c) f, 1/sr
    variance: np.ndarray  # (n, c) of f
    omega: np.ndarray  # (n,) weight, see photogonio.reconstruct.table.facet_table


def samples_of(scene: ViewScene, pairs: Pairs, radiance: RadianceImage, *, omega: float) -> BrdfSamples:
    """BRDF, variance and weight of each pixel of a region, ``radiance`` being cut to the same region.

    ``omega`` is the weight of a pixel of unit cos * falloff, see :func:`unit_weight`.
    """
    c = len(scene.strength)
    value = radiance.value.reshape(-1, c).astype(float)
    variance = radiance.variance.reshape(-1, c).astype(float)
    reason = pairs.reason.copy()
    tests = [("saturated", radiance.saturated.ravel()), ("invalid", ~radiance.valid.ravel())]
    for name, out in tests:
        reason[(reason == USED) & out] = LEFT_OUT.index(name)
    with np.errstate(divide="ignore", invalid="ignore"):
        irradiance = pairs.irradiance[:, None] * scene.strength
        f, var_f = value / irradiance, variance / irradiance**2
    return BrdfSamples(reason, f, var_f, omega * pairs.irradiance)


def unit_weight(scene: ViewScene, lens: Lens, region: Region, radiance: RadianceImage) -> float:
    """Weight of a pixel whose cos * falloff is 1: mean strength over the median of E var(f), see the table.

    The median is over the usable pixels of a lattice of about SAMPLED of the region; 1 stands for var if there
    are none, or none has noise.
    """
    x0, y0, x1, y1 = region
    stride = max(1, int(np.sqrt((x1 - x0) * (y1 - y0) / SAMPLED)))
    y, x = (lines.ravel() for lines in np.mgrid[y0:y1:stride, x0:x1:stride])
    pairs = pairs_along(scene, lens.rays(np.column_stack([x, y])) @ scene.rotation)
    v, u = y - radiance.origin[1], x - radiance.origin[0]
    used = (pairs.reason == USED) & radiance.valid[v, u] & ~radiance.saturated[v, u]
    if not used.any():
        return 1.0
    # E var(f) with E = g S and var(f) = var / (g s)^2, g = cos * falloff
    variance = (radiance.variance[v[used], u[used]] / scene.strength**2).mean(1)
    typical = scene.strength.mean() * float(np.median(variance / pairs.irradiance[used]))
    return float(scene.strength.mean() / typical) if typical > 0.0 else 1.0


def region_within(setup: Setup, view: ViewSetup, radiance: RadianceImage) -> Region:
    """The sample's region of the photo; ``ValueError`` if ``radiance`` was not read that far."""
    region = region_of(setup, view.pose)
    left, top = radiance.origin
    height, width = radiance.valid.shape
    x0, y0, x1, y1 = region
    if x0 < x1 and (x0 < left or y0 < top or x1 > left + width or y1 > top + height):
        raise ValueError(
            f"{view.name}: the radiance covers {width} x {height} from {left}, {top}; not {region}"
        )
    return region


def frame_of(radiance: RadianceImage) -> Frame:
    """The radiance as the kernel takes it."""
    return Frame(
        np.ascontiguousarray(radiance.value, np.float32),
        np.ascontiguousarray(radiance.variance, np.float32),
        np.ascontiguousarray(radiance.valid),
        np.ascontiguousarray(radiance.saturated),
        *radiance.origin,
    )


def _cut(radiance: RadianceImage, region: Region) -> RadianceImage:
    x0, y0, x1, y1 = region
    left, top = radiance.origin
    part = (slice(y0 - top, y1 - top), slice(x0 - left, x1 - left))
    return RadianceImage(
        value=radiance.value[part],
        variance=radiance.variance[part],
        valid=radiance.valid[part],
        saturated=radiance.saturated[part],
        origin=(x0, y0),
    )
