"""``photogonio export``."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from photogonio.capture.errors import InputError
from photogonio.reconstruct.brdf.brdf import Brdf, load_brdf
from photogonio.reconstruct.export import find_format
from photogonio.report.trust import told_distrust
from photogonio.system.outputs import staged_file
from photogonio.system.progress import Reporter


def one_channel(brdf: Brdf, name: str) -> Brdf:
    """Only the channel of that name."""
    if name not in brdf.channels:
        raise InputError(f"--channel {name}", f"expected one of {', '.join(brdf.channels)}")
    k = [brdf.channels.index(name)]
    lobes = tuple(replace(lobe, f0=lobe.f0[k], weight=lobe.weight[k]) for lobe in brdf.lobes)
    return replace(
        brdf,
        channels=(name,),
        coefficients=brdf.coefficients[:, k],
        standard_errors=brdf.standard_errors[:, k],
        lobes=lobes,
    )


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    form = find_format(args.format)
    path = Path(args.coefficients)
    out = Path(args.out) if args.out else Path(path.stem + form.suffix)
    brdf = load_brdf(path)
    for line in told_distrust(brdf, path.name):
        reporter.warn(line)
    if args.channel is not None:
        brdf = one_channel(brdf, args.channel)
    if brdf.scale == "relative":
        reporter.warn("the BRDF's scale is relative: the exported values are f up to one factor a channel")
    with staged_file(out) as stage:
        form.write(brdf, stage)
    reporter.say(f"written to {out}")
    return {"format": args.format, "out": str(out), "channels": brdf.channels, "scale": brdf.scale}
