"""``photogonio export``."""

from __future__ import annotations

import argparse
from pathlib import Path

from photogonio.capture.errors import InputError
from photogonio.compare.reflectances import find_brdf
from photogonio.face.files import load
from photogonio.face.known import KnownBrdf
from photogonio.reconstruct.brdf.brdf import Brdf
from photogonio.reconstruct.export.formats import find_format
from photogonio.report.trust import told_distrust
from photogonio.system.outputs import staged_file
from photogonio.system.progress import Reporter


def source_of(path: Path, name: str) -> Brdf | KnownBrdf:
    """What the file holds, if the format of that ``name`` can be written of it."""
    brdf = load(path)
    if isinstance(brdf, KnownBrdf):
        brdf.require(name)
        return brdf.filled()
    return brdf


def one_channel(brdf: Brdf | KnownBrdf, name: str) -> Brdf | KnownBrdf:
    """Only the channel of that name."""
    if isinstance(brdf, KnownBrdf):
        return brdf.only(name)
    if name not in brdf.channels:
        raise InputError(f"--channel {name}", f"expected one of {', '.join(brdf.channels)}")
    return brdf.only([brdf.channels.index(name)])


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    form = find_format(args.format, args.basis)
    path = find_brdf(Path(args.coefficients), everywhere=True)
    out = Path(args.out) if args.out else Path(path.stem + form.suffix)
    if out.exists() and out.samefile(path):
        raise InputError(out, "is the file that is exported; give another name with -o")
    brdf = source_of(path, args.format)
    if isinstance(brdf, Brdf):
        for line in told_distrust(brdf, path.name):
            reporter.warn(line)
    if args.channel is not None:
        brdf = one_channel(brdf, args.channel)
    if brdf.scale == "relative":
        reporter.warn("the BRDF's scale is relative: the exported values are f up to one factor a channel")
    asked = {} if args.order is None else {"order": args.order}
    if asked and not form.ordered:
        raise InputError(f"--order {args.order}", f"--format {args.format} holds no modes")
    with staged_file(out) as stage:
        remark, loss = form.put(brdf, stage, **asked)
    if loss is not None:
        reporter.say(f"{args.format}: {loss}")
    if remark:
        reporter.warn(remark)
    reporter.say(f"written to {out}")
    return {
        "format": args.format,
        "out": str(out),
        "channels": brdf.channels,
        "scale": brdf.scale,
        "loss": None if loss is None else loss.to_dict(),
    }
