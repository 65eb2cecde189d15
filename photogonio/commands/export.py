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
from photogonio.system.outputs import staged
from photogonio.system.progress import Reporter
from photogonio.system.provenance import Provenance, canonical_command, hash_inputs


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


def refuse_others(out: Path, stage: Path) -> None:
    """Raises InputError where a folder holds files that are none of those on the ``stage``, and would stand among
    them."""
    others = (
        {one.name for one in out.iterdir()} - {one.name for one in stage.iterdir()} if out.is_dir() else ()
    )
    if others:
        raise InputError(out, f"holds other files ({min(others)} ...); give a new folder with -o")


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
    options = {"format": args.format, "basis": args.basis, "channel": args.channel, "order": args.order}
    source = Provenance(canonical_command("export", path.name, options), hash_inputs(path))
    with staged(out, folder=form.folder) as stage:
        remark, loss = form.put(brdf, stage, source=source.to_text(), **asked)
        if form.folder:
            refuse_others(out, stage)
    reporter.say(f"{args.format}: {loss}")
    if remark:
        reporter.warn(remark)
    reporter.say(f"written to {out}")
    return {
        "format": args.format,
        "out": str(out),
        "channels": brdf.channels,
        "scale": brdf.scale,
        "loss": loss.to_dict(),
        "source": source.to_dict(),
    }
