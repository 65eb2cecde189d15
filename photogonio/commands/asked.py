"""The options that ``process`` and ``fit`` share, as the library takes them."""

from __future__ import annotations

import argparse

from photogonio.options import Options


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
        channels=args.channels,
        workers=args.workers,
    )
