"""``photogonio export``."""

from __future__ import annotations

import argparse
from pathlib import Path

from photogonio.outputs import staged_file
from photogonio.progress import Reporter
from reconstruct.brdf import load_brdf
from reconstruct.export import find_format


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    form = find_format(args.format)
    path = Path(args.coefficients)
    out = Path(args.out) if args.out else Path(path.stem + form.suffix)
    brdf = load_brdf(path)
    if brdf.scale == "relative":
        reporter.warn("the BRDF's scale is relative: the exported values are f up to one factor a channel")
    with staged_file(out) as stage:
        form.write(brdf, stage)
    reporter.say(f"written to {out}")
    return {"format": args.format, "out": str(out), "channels": brdf.channels, "scale": brdf.scale}
