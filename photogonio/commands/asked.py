"""Options that several commands share, as the library takes them."""

from __future__ import annotations

import argparse

from photogonio.options import Options
from photogonio.reconstruct.goniometer.told import Told


def options_of(args: argparse.Namespace) -> Options:
    order, level, lobes = (
        None if value == "auto" else value for value in (args.order, args.level, args.lobes)
    )
    return Options(
        order=order,
        level=level,
        symmetry=args.symmetry,
        lobes=lobes,
        physics=args.physics,
        prior=args.prior,
        robust=args.robust == "on",
        channels=args.channels,
        workers=args.workers,
    )


def told_of(args: argparse.Namespace) -> Told:
    """What ``fit`` and ``compare`` are told of tables."""
    return Told(
        columns=args.columns,
        where=tuple(pair for group in args.where for pair in group.items()),
        quantity=args.quantity,
        angles=args.angles,
        azimuth=args.azimuth,
        channel_by=args.channel_by,
    )
