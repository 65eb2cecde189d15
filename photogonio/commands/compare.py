"""``photogonio compare``."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from photogonio.commands.asked import told_of
from photogonio.compare.compare import Comparison, compare
from photogonio.compare.reflectances import find_brdf, load_known
from photogonio.report.html import picture_bytes
from photogonio.report.plots import scatter_figure
from photogonio.system.drawing import own_style
from photogonio.system.outputs import check_result_place, staged_folder, to_json
from photogonio.system.progress import Reporter
from photogonio.system.provenance import Provenance, canonical_command, hash_inputs

_UNITS = {
    "relative_l2": ("%", 100.0),
    "negative_fraction": ("%", 100.0),
    "reciprocity_residual": ("%", 100.0),
    "maximum": ("1/sr", 1.0),
}


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    if args.out:
        check_result_place(Path(args.out))
    paths = [find_brdf(Path(name)) for name in (args.a, args.b)]
    told = told_of(args)
    a, b = (load_known(path, told) for path in paths)
    for warning in (*a.warnings, *b.warnings):
        reporter.warn(warning)
    unscaled = [
        known
        for known in ((a, b) if not args.scale else ())
        if getattr(known.evaluate, "scale", "absolute") == "relative"
    ]
    for known in unscaled:
        reporter.warn(f"{known.name} is on a relative scale: --scale brings the first to the other's")
    found = compare(a, b, mask=np.radians(args.mask), scale=args.scale)
    options = {"mask": args.mask, "scale": args.scale or None} | told.to_dict()
    source = Provenance(
        canonical_command("compare", f"{paths[0].name} {paths[1].name}", options),
        {name: found for path in paths for name, found in hash_inputs(path).items()},
    )
    reporter.say(_table(found))
    for known in (a, b):
        if len(known.channels) == 1 < len(found.channels):
            reporter.say(
                f"{known.name} has one channel, {known.channels[0]}, which stands against each of "
                f"{', '.join(found.channels)}: the column of the one that it is of says how well they agree"
            )
    reporter.say(
        ("as they stand, with the unknown scale: " if unscaled and found.significance else "")
        + str(
            found.significance
            or "nothing says how sure the channels compared are: whether they differ cannot be told"
        )
    )
    numbers = found.to_dict() | {"source": source.to_dict()}
    if args.out:
        _write(found, numbers, Path(args.out), source)
        reporter.say(f"written to {args.out}")
    return numbers


def _table(found: Comparison) -> str:
    """The measures, a line each, one column a channel."""
    lines = [
        f"{found.names[0]} against {found.names[1]}, both angles below {np.degrees(found.mask):g} degrees"
    ]
    lines.append(f"{'':24}" + "".join(f"{name:>12}" for name in found.channels))
    for name, values in found.measures.items():
        unit, factor = _UNITS.get(name, ("", 1.0))
        label = f"{name.replace('_', ' ')} {unit}".strip()
        lines.append(f"{label:24}" + "".join(f"{factor * value:12.4g}" for value in values))
    if found.appearance:
        lines += [
            f"{name.replace('_', ' '):24}{value:12.4g}" for name, value in found.appearance.to_dict().items()
        ]
    return "\n".join(lines)


@own_style()
def _write(found: Comparison, numbers: dict[str, object], out: Path, source: Provenance) -> None:
    labels = (f"{found.names[1]}, 1/sr", f"{found.names[0]}, 1/sr")
    figures = {"scatter": scatter_figure(found.b, found.a, found.channels, labels=labels)}
    if found.appearance:
        figures["balls"] = found.appearance.figure(found.names)
    with staged_folder(out) as stage:
        (stage / "comparison.json").write_text(to_json(numbers), encoding="utf-8")
        for name, figure in figures.items():
            (stage / f"{name}.png").write_bytes(picture_bytes(figure, source=source.to_text()))
