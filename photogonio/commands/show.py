"""``photogonio show``."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import load_brdf
from photogonio.reconstruct.brdf.words import described
from photogonio.report.html import picture_bytes
from photogonio.report.plots import overview_figure
from photogonio.report.trust import told_distrust
from photogonio.system.outputs import staged_file
from photogonio.system.progress import Reporter
from photogonio.system.provenance import Provenance, canonical_command, hash_file

_ANGLES = np.radians([0.0, 30.0, 60.0])


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    out, path = Path(args.out), Path(args.coefficients)
    kind = out.suffix.removeprefix(".").lower()
    if kind not in ("png", "svg"):
        raise InputError(args.out, "expected a name that ends in .png or .svg")
    brdf = load_brdf(path)
    for line in told_distrust(brdf, path.name):
        reporter.warn(line)
    source = Provenance(canonical_command("show", path.name, {}), {path.name: hash_file(path)})
    title = f"{brdf.source.get('name', path.name)}: {brdf.symmetry}, {described(brdf)}"
    valid = np.radians(brdf.valid.get("theta_r_max", 90.0))
    figure = overview_figure(brdf, brdf.channels, title, valid=valid)
    with staged_file(out) as stage:
        stage.write_bytes(picture_bytes(figure, kind=kind, source=source.to_text()))
    reporter.say(f"written to {out}")
    return {
        "channels": brdf.channels,
        "order": brdf.order,
        "model": described(brdf),
        "albedo": brdf.bihemispherical_albedo(),
        "directional_albedo": {
            f"{np.degrees(angle):.0f}": brdf.directional_albedo(angle) for angle in _ANGLES
        },
        "out": str(out),
    }
