"""``photogonio add``."""

from __future__ import annotations

import argparse
from pathlib import Path

from photogonio.capture.errors import InputError
from photogonio.commands.asked import options_of
from photogonio.finished import write_result
from photogonio.options import Options
from photogonio.reconstruct.table.table_file import load_with
from photogonio.refit import fit_again
from photogonio.report.budget import budget_numbers
from photogonio.report.summary import closing_lines, numbers
from photogonio.report.trust import verdict_lines
from photogonio.result import Result
from photogonio.run.circumstances import unpacked
from photogonio.run.session_scales import Session
from photogonio.run.sessions import joined
from photogonio.run.tables import take_channels
from photogonio.system.outputs import check_result_place
from photogonio.system.progress import Reporter
from photogonio.system.provenance import Provenance, canonical_command, hash_file


def add(tables: list[str], out: Path, options: Options, reporter: Reporter) -> Result:
    """One fit of several sessions of a sample.

    Raises:
        InputError: a table cannot be used, or they cannot be added. Nothing is written then.
    """
    check_result_place(out)
    sessions = sorted(map(read_session, tables), key=lambda one: one.order)
    if len(sessions) < 2:
        raise InputError(tables[0], "expected the results of two sessions or more")
    table, known = joined(sessions)
    level = options.level
    if level is not None and level != table.level:
        raise InputError(f"--level {level}", f"the tables' level is {table.level}")
    reporter.say(f"{len(sessions)} sessions, {len(table.groups)} photos: {known.name}")
    inputs = {f"{k}: {one.known.name}/table.npz": one.digest for k, one in enumerate(sessions, 1)}
    subject = " ".join(one.known.name for one in sessions)
    provenance = Provenance(canonical_command("add", subject, options.to_dict()), inputs)
    result = fit_again(known, take_channels(table, options), options, provenance, reporter)
    write_result(result, out)
    return result


def read_session(given: str) -> Session:
    """What ``process`` left in a folder, or its table.

    Raises:
        InputError: it is none, or has no photos' set-up.
    """
    path = Path(given) / "table.npz" if Path(given).is_dir() else Path(given)
    table, beside = load_with(path)
    known = unpacked(beside, table, path)
    if known is None:
        raise InputError(path, "has no set-up of photos beside its cells; expected what process leaves")
    return Session(str(path), hash_file(path), table, known)


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    out = Path(args.out)
    result = add(args.tables, out, options_of(args), reporter)
    reporter.distrust(verdict_lines(result.faults))
    reporter.say(closing_lines(result))
    reporter.say(f"written to {out}: coefficients.json, setup.json, table.npz, report.html and pictures")
    return numbers(result) | {"budget": budget_numbers(result.brdf), "out": str(out)}
