"""``photogonio batch``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from photogonio.batch.ledger import DISTRUSTED, DONE, FAILED, LEDGER, SetEntry, append, read_ledger, rewrite
from photogonio.batch.sets import SetPlace, find_sets
from photogonio.batch.summary import page_text, table_text
from photogonio.batch.work import Job, in_processes, result_key, shared
from photogonio.cache.running import job_in
from photogonio.cache.store import default_folder
from photogonio.capture.errors import InputError
from photogonio.commands.asked import options_of
from photogonio.options import Options
from photogonio.run.cluster import cluster_of
from photogonio.system.outputs import check_place, remove_leftovers, staged_file
from photogonio.system.progress import Reporter


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    with job_in(default_folder()):
        return _run(args, reporter)


def _run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    out, options = Path(args.out), options_of(args)
    check_place(out, folder=True)
    places = find_sets(args.sets)
    with cluster_of(options.executor):  # is refused before any set is begun
        out.mkdir(parents=True, exist_ok=True)
    at_once, each = shared(options.threads(), len(places))
    found, jobs = _sorted_out(places, replace(options, workers=each), out)
    kept = len(found)
    reporter.say(f"{len(places)} sets, {kept} of them done before; {at_once} at once")
    for entry in [*_refused(found), *in_processes(jobs, at_once)]:
        if entry.set not in found:
            append(out / LEDGER, entry)
            found[entry.set] = entry
        reporter.say(_told(entry))
        reporter.progress("sets", len(found), len(places))
    remove_leftovers(out)
    entries = [found[place.name] for place in places]
    rewrite(out / LEDGER, entries)
    for name, text in (("summary.csv", table_text(entries)), ("summary.html", page_text(entries, out))):
        with staged_file(out / name) as stage:
            stage.write_text(text, encoding="utf-8")
    count = {
        status: sum(entry.status == status for entry in entries) for status in (DONE, DISTRUSTED, FAILED)
    }
    reporter.failed = count[FAILED] > 0
    reporter.distrusted = count[DISTRUSTED] > 0
    reporter.say(
        ", ".join(f"{number} {status}" for status, number in count.items()) + f"; see {out}/summary.html"
    )
    return {"sets": len(entries), "out": str(out), **count, "entries": [entry.set for entry in entries]}


def _sorted_out(
    places: Sequence[SetPlace], options: Options, out: Path
) -> tuple[dict[str, SetEntry], list[Job]]:
    """What is known of sets by a ledger that is there, or since they cannot be read; and what is to be done."""
    known, found, jobs = read_ledger(out / LEDGER), {}, []
    for place in places:
        try:
            key = result_key(place, options)
        except InputError as error:
            found[place.name] = SetEntry(place.name, "", FAILED, str(error))
            continue
        entry = known.get(place.name)
        there = (out / place.name / "coefficients.json").is_file()
        if entry is not None and entry.finished and entry.key == key and there:
            found[place.name] = entry
        else:
            jobs.append(Job(place, key, out / place.name, options))
    return found, jobs


def _refused(found: dict[str, SetEntry]) -> list[SetEntry]:
    return [entry for entry in found.values() if entry.status == FAILED]


def _told(entry: SetEntry) -> str:
    return f"{entry.set}: {entry.status}" + (
        f": {entry.said}" if entry.said else f": {entry.numbers['model']}"
    )
