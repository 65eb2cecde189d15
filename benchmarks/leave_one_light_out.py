"""How well a fit predicts the photo under a light that it has not seen.

The set is processed whole once: where camera, sample and lights are comes from all photos, the left-out light's own
among them. Then every light in turn is left out of the fit, and the values of the sample's pixels in its photos are
predicted: those lit, and above a tenth of the photo's maximum; where a narrow gloss is seen, as the lamp's size and the
pixel blur it. The median relative error of each light, and over all pixels, and the rms error over the rms value::

    python -m benchmarks.leave_one_light_out SET [--level L] [--quick]

``--quick`` leaves out the first two lights only.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

from photogonio.calib.setup import Setup, ViewSetup
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset
from photogonio.options import Options
from photogonio.pipeline import process
from photogonio.reconstruct.estimate.binning_error import blur
from photogonio.reconstruct.fit import FitOptions, PhotoErrors, fit_table
from photogonio.reconstruct.fit_result import FitResult
from photogonio.reconstruct.modes.angles import spherical_angles
from photogonio.reconstruct.reduce.directions import (
    USED,
    ReduceOptions,
    pairs_at,
    region_of,
    region_pixels,
    scene_of,
)
from photogonio.reconstruct.table.cells import Cells
from photogonio.reconstruct.table.facet_table import FacetTable, of_groups
from photogonio.result import Result
from photogonio.run.circumstances import footprints, lamp_variances, phase_of, view_errors

BRIGHT = 0.1  # of the photo's maximum


def predicted_and_seen(
    fit: FitResult, setup: Setup, view: ViewSetup, reader, options, table: FacetTable
) -> tuple[np.ndarray, np.ndarray]:
    """Radiance predicted and seen (n, c) at the lit, bright pixels of one view."""
    region = region_of(setup, view.pose)
    photo = next(v for v in reader.photoset.views("sample") if v.name == view.name)
    image = reader.read(photo, region)
    pairs = pairs_at(scene_of(setup, view, options), setup.camera, region_pixels(region))
    seen = image.value.reshape(-1, image.value.shape[2])
    use = (pairs.reason == USED) & image.valid.ravel()
    use &= seen.min(axis=1) > BRIGHT * seen[use].max()
    (theta_i, phi_i), (theta_r, phi_r) = (
        spherical_angles(pairs.incident[use]),
        spherical_angles(pairs.exit[use]),
    )
    f = fit.brdf.evaluate(theta_i, phi_i, theta_r, phi_r)
    if fit.cells.peaked:
        at = Cells.of_directions(theta_i, phi_i, theta_r, phi_r)
        f += blur(_as_seen(at, pairs.point[use], setup, of_groups(table, {view.name})), fit.model)
    return f * pairs.irradiance[use, None] * view.strength, seen[use]


def _as_seen(at: Cells, place: np.ndarray, setup: Setup, table: FacetTable) -> Cells:
    """Pixels (n,) of one view as cells, with what blurs a narrow peak."""
    at = replace(at, place=place, binned=True, peaked=True)
    return replace(at, turn=footprints(setup, table)(at)).under(lamp_variances(setup, table))


def errors_known(whole: Result, table: FacetTable) -> PhotoErrors:
    """Of some photos of a set, as a fit of all is told."""
    setup, beside, stray = whole.setup, whole.beside, whole.beside.known
    if stray is not None:  # by a table's groups
        kept = [whole.table.groups.index(name) for name in table.groups]
        views, surrounds = ([some[k] for k in kept] for some in (stray.views, stray.surrounds))
        stray = replace(stray, views=views, surrounds=surrounds)
    return PhotoErrors(
        view_errors=view_errors(setup, table),
        lamps=lamp_variances(setup, table),
        phase=phase_of(setup),
        stray=stray,
        doubt=beside.unknown,
        footprint=footprints(setup, table),
    )


def leave_each_out(
    folder: str, level: int, lights: int | None = None
) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Of each left-out light, relative errors of pixels (the mean of their channels) and of single channels, and the
    sums of squares of errors and of values."""
    photoset = load_photoset(folder)
    whole, reader = process(folder, options=Options(level=level)), prepare(photoset)
    setup, table = whole.setup, whole.table
    options = ReduceOptions(mirror_balls=photoset.mirror_balls, white_patches=photoset.white_patches)
    asked = FitOptions(absolute=setup.scale == "absolute")
    names = sorted({view.light.id for view in setup.views})[:lights]
    errors = {}
    for name in names:
        left = [view for view in setup.views if view.light.id == name]
        others = of_groups(table, {v.name for v in setup.views if v.light.id != name})
        fit = fit_table(others, asked, errors_known(whole, others))
        pairs = [predicted_and_seen(fit, setup, view, reader, options, table) for view in left]
        said, seen = (np.concatenate(some) for some in zip(*pairs, strict=True))
        errors[name] = (
            np.abs(said.mean(1) / seen.mean(1) - 1.0),
            np.abs(said / seen - 1.0).ravel(),
            np.array([np.mean((said - seen) ** 2), np.mean(seen**2)]) * len(seen),
        )
    return errors


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("set")
    parser.add_argument("--level", type=int, default=4)
    parser.add_argument("--quick", action="store_true")
    asked = parser.parse_args(arguments)
    errors = leave_each_out(asked.set, asked.level, 2 if asked.quick else None)
    print("light        pixels  median relative error: of the pixel, of single channels")
    for name, (pixel, channel, _) in errors.items():
        print(
            f"{name:8s}  {len(pixel):8d}  {100 * np.median(pixel):6.2f} %  {100 * np.median(channel):6.2f} %"
        )
    pixels, channels = (np.concatenate([error[k] for error in errors.values()]) for k in (0, 1))
    print(f"all       {len(pixels):8d}  {100 * np.median(pixels):6.2f} %  {100 * np.median(channels):6.2f} %")
    missed, whole = sum(error[2] for error in errors.values())
    print(f"relative rms: {100 * np.sqrt(missed / whole):.2f} %")
    worst = max(errors, key=lambda name: np.median(errors[name][0]))
    print(f"worst light: {worst}")


if __name__ == "__main__":
    main()
