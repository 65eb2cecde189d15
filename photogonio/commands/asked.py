"""Options that several commands share, as the library takes them."""

from __future__ import annotations

import argparse

from photogonio.capture.errors import InputError
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
        workers=_workers(args),
        executor=_there(args),
    )


def _workers(args: argparse.Namespace) -> int | None:
    """How many here. Raises InputError where --workers and --executor say different things."""
    kind, _, number = (getattr(args, "executor", None) or "").partition(":")
    if kind != "local":
        return args.workers
    if args.workers not in (None, int(number)):
        raise InputError(f"--executor local:{number}", f"contradicts --workers {args.workers}")
    return int(number)


def _there(args: argparse.Namespace) -> str | None:
    executor = getattr(args, "executor", None)
    return executor if executor and executor.startswith("dask://") else None


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
