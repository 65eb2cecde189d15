"""``photogonio show``."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.compare.reflectances import find_brdf
from photogonio.face.files import load
from photogonio.face.measured import MeasuredBrdf
from photogonio.reconstruct.brdf.words import described
from photogonio.report.html import picture_bytes
from photogonio.report.trust import told_distrust
from photogonio.system.outputs import staged_file
from photogonio.system.progress import Reporter
from photogonio.system.provenance import Provenance, canonical_command, hash_file

_ANGLES = np.radians([0.0, 30.0, 60.0])


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    out, path = Path(args.out), find_brdf(Path(args.coefficients), everywhere=True)
    kind = out.suffix.removeprefix(".").lower()
    if kind not in ("png", "svg"):
        raise InputError(args.out, "expected a name that ends in .png or .svg")
    brdf = load(path)
    if isinstance(brdf, MeasuredBrdf):
        for line in told_distrust(brdf, path.name):
            reporter.warn(line)
    source = Provenance(canonical_command("show", path.name, {}), {path.name: hash_file(path)})
    figure = brdf.plot()
    with staged_file(out) as stage:
        stage.write_bytes(picture_bytes(figure, kind=kind, source=source.to_text()))
    reporter.say(f"written to {out}")
    numbers: dict[str, object] = {"channels": brdf.channels, "out": str(out)}
    value, error = brdf.albedo()
    numbers |= {"albedo": value, "albedo_error": error}
    if isinstance(brdf, MeasuredBrdf):
        reporter.say(described(brdf))
        numbers |= {
            "order": brdf.order,
            "model": described(brdf),
            "directional_albedo": {
                f"{np.degrees(angle):.0f}": brdf.directional_albedo(angle) for angle in _ANGLES
            },
        }
    return numbers
