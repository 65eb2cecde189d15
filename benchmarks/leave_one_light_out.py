"""How well a fit predicts the photo under a light that it has not seen.

The set is processed whole once: where camera, sample and lights are comes from all photos, the left-out light's own
among them. Then every light in turn is left out of the fit, and the values of the sample's pixels in its photos are
predicted: those lit, and above a tenth of the photo's maximum. The median relative error of each light, and over all
pixels::

    python -m benchmarks.leave_one_light_out SET [--level L] [--quick]

``--quick`` leaves out the first two lights only.
"""

from __future__ import annotations

import argparse

import numpy as np

from photogonio.calib.setup import Setup, ViewSetup
from photogonio.capture.linear.prepare import prepare
from photogonio.capture.manifest.load import load_photoset
from photogonio.options import Options
from photogonio.pipeline import process
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.fit import FitOptions, PhotoErrors, fit_table
from photogonio.reconstruct.modes.angles import spherical_angles
from photogonio.reconstruct.reduce.directions import (
    USED,
    ReduceOptions,
    pairs_at,
    region_of,
    region_pixels,
    scene_of,
)
from photogonio.reconstruct.table.facet_table import of_groups

BRIGHT = 0.1  # of the photo's maximum


def predicted_and_seen(
    brdf: Brdf, setup: Setup, view: ViewSetup, reader, options
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
    exit_radiance = (
        brdf.evaluate(theta_i, phi_i, theta_r, phi_r) * pairs.irradiance[use, None] * view.strength
    )
    return exit_radiance, seen[use]


def leave_each_out(
    folder: str, level: int, lights: int | None = None
) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Relative errors of each left-out light: of pixels (the mean of their channels), and of single channels."""
    photoset = load_photoset(folder)
    whole, reader = process(folder, options=Options(level=level)), prepare(photoset)
    setup, table, doubt = whole.setup, whole.table, whole.beside.unknown
    options = ReduceOptions(mirror_balls=photoset.mirror_balls, white_patches=photoset.white_patches)
    asked = FitOptions(absolute=setup.scale == "absolute")
    names = sorted({view.light.id for view in setup.views})[:lights]
    errors = {}
    for name in names:
        left = [view for view in setup.views if view.light.id == name]
        others = of_groups(table, {v.name for v in setup.views if v.light.id != name})
        brdf = fit_table(others, asked, PhotoErrors(doubt=doubt)).brdf
        pairs = [predicted_and_seen(brdf, setup, view, reader, options) for view in left]
        errors[name] = (
            np.concatenate([np.abs(p.mean(1) / s.mean(1) - 1.0) for p, s in pairs]),
            np.concatenate([np.abs(p / s - 1.0).ravel() for p, s in pairs]),
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
    for name, (pixel, channel) in errors.items():
        print(
            f"{name:8s}  {len(pixel):8d}  {100 * np.median(pixel):6.2f} %  {100 * np.median(channel):6.2f} %"
        )
    pixels, channels = (np.concatenate([error[k] for error in errors.values()]) for k in (0, 1))
    print(f"all       {len(pixels):8d}  {100 * np.median(pixels):6.2f} %  {100 * np.median(channels):6.2f} %")
    worst = max(errors, key=lambda name: np.median(errors[name][0]))
    print(f"worst light: {worst}")


if __name__ == "__main__":
    main()
