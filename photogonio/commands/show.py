"""``photogonio show``."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from photogonio.capture.errors import InputError
from photogonio.compare.reflectances import find_brdf
from photogonio.face.files import load
from photogonio.face.known import KnownBrdf
from photogonio.face.measured import MeasuredBrdf
from photogonio.reconstruct.brdf.words import described
from photogonio.report.html import picture_bytes
from photogonio.report.plots import draws_figure
from photogonio.report.trust import told_distrust
from photogonio.system.drawing import own_style
from photogonio.system.outputs import staged_file
from photogonio.system.progress import Reporter
from photogonio.system.provenance import Provenance, canonical_command, hash_inputs

MOST_DRAWS = 100
_ANGLES = np.radians([0.0, 30.0, 60.0])


def draws_of(brdf: MeasuredBrdf | KnownBrdf, count: int, path: Path) -> Figure:
    """Balls of BRDFs drawn from the errors. Raises InputError where there are too many, or the file ``path`` says no
    errors."""
    if count > MOST_DRAWS:
        raise InputError(f"--draws {count}", f"expected at most {MOST_DRAWS}")
    try:
        drawn = brdf.sample(count, seed=0)
    except InputError as error:
        raise InputError(path, error.what) from error
    title = f"{brdf.name}: {count} draws of its numbers within their stated errors"
    return draws_figure(drawn, title)


@own_style()
def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    out, path = Path(args.out), find_brdf(Path(args.coefficients), everywhere=True)
    kind = out.suffix.removeprefix(".").lower()
    if kind not in ("png", "svg"):
        raise InputError(args.out, "expected a name that ends in .png or .svg")
    brdf = load(path)
    if isinstance(brdf, MeasuredBrdf):
        for line in told_distrust(brdf, path.name):
            reporter.warn(line)
    options = {"draws": args.draws}
    source = Provenance(canonical_command("show", path.name, options), hash_inputs(path))
    figure = brdf.plot() if args.draws is None else draws_of(brdf, args.draws, path)
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
