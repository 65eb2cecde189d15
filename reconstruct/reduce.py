"""One view's photo, reduced to its facet-pair table."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calib.setup import Setup, ViewSetup
from capture.radiance import RadianceImage
from reconstruct.directions import (
    USED,
    Pairs,
    ReduceOptions,
    Scene,
    pairs_at,
    region_of,
    region_pixels,
    scene_of,
)
from reconstruct.facets import facet_index
from reconstruct.outliers import isolated
from reconstruct.table import LEFT_OUT, FacetTable, accumulate

SAMPLED = 4096  # pixels, about, that a view's typical variance is taken from


def reduce_view(
    setup: Setup, view: ViewSetup, radiance: RadianceImage, level: int, options: ReduceOptions
) -> FacetTable:
    """The facet-pair table of one view, of one group that bears the view's name.

    ``table.left_out`` counts the pixels of the sample that were left out, by reason. The table is empty where
    no pixel can be used.
    """
    scene = scene_of(setup, view, options)
    region = region_of(setup, view.pose)
    pairs = pairs_at(scene, setup.camera, region_pixels(region))
    samples = samples_of(scene, pairs, _cut(radiance, region), options.outliers)
    kept = samples.reason == USED
    incident, exit_ = pairs.incident[kept], pairs.exit[kept]
    return accumulate(
        level=level,
        channels=setup.channels,
        name=view.name,
        isotropic=scene.isotropic,
        facet_i=facet_index(incident, level),
        facet_r=facet_index(exit_, level),
        incident=incident,
        exit=exit_,
        place=pairs.point[kept],
        omega=samples.omega[kept],
        value=samples.value[kept],
        variance=samples.variance[kept],
        left_out=np.bincount(samples.reason[samples.reason >= 0], minlength=len(LEFT_OUT)),
    )


@dataclass(frozen=True, slots=True)
class Samples:
    """BRDF values of the pixels of a region."""

    reason: np.ndarray  # (n,) int8: USED, OUTSIDE, or an index in LEFT_OUT
    value: np.ndarray  # (n, c) f, 1/sr
    variance: np.ndarray  # (n, c) of f
    omega: np.ndarray  # (n,) weight, see reconstruct.table


def samples_of(scene: Scene, pairs: Pairs, radiance: RadianceImage, outliers: bool) -> Samples:
    """BRDF, variance and weight of each pixel of a region, ``radiance`` being cut to the same region."""
    c = len(scene.strength)
    value = radiance.value.reshape(-1, c).astype(float)
    variance = radiance.variance.reshape(-1, c).astype(float)
    reason = pairs.reason.copy()
    tests = [("saturated", radiance.saturated.ravel()), ("invalid", ~radiance.valid.ravel())]
    for name, out in tests:
        reason[(reason == USED) & out] = LEFT_OUT.index(name)
    if outliers:
        usable = (reason == USED).reshape(radiance.valid.shape)
        odd = isolated(radiance.value, radiance.variance, usable).ravel()
        reason[(reason == USED) & odd] = LEFT_OUT.index("outlier")
    with np.errstate(divide="ignore", invalid="ignore"):
        irradiance = pairs.irradiance[:, None] * scene.strength
        f, var_f = value / irradiance, variance / irradiance**2
    mean = pairs.irradiance * scene.strength.mean()
    omega = mean / typical(mean, var_f, reason == USED)
    return Samples(reason, f, var_f, omega)


def typical(irradiance: np.ndarray, variance: np.ndarray, used: np.ndarray) -> float:
    """Median of irradiance times variance of f over about SAMPLED of the used pixels, 1 if there are none."""
    kept = np.flatnonzero(used)
    kept = kept[:: max(1, len(kept) // SAMPLED)]
    if len(kept) == 0:
        return 1.0
    found = float(np.median(irradiance[kept] * variance[kept].mean(1)))
    return found if found > 0.0 else 1.0


def _cut(radiance: RadianceImage, region: tuple[int, int, int, int]) -> RadianceImage:
    x0, y0, x1, y1 = region
    part = (slice(y0, y1), slice(x0, x1))
    return RadianceImage(
        value=radiance.value[part],
        variance=radiance.variance[part],
        valid=radiance.valid[part],
        saturated=radiance.saturated[part],
    )
