"""``photogonio batch``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path

from photogonio.batch.ledger import DISTRUSTED, DONE, FAILED, LEDGER, SetEntry, append, read_ledger, rewrite
from photogonio.batch.sets import SetPlace, check_apart, find_sets
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
from photogonio.system.stops import stop_heard

TABLE, PAGE = "summary.csv", "summary.html"
FILES = (LEDGER, TABLE, PAGE)


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    with job_in(default_folder()):
        return _run(args, reporter)


def _run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    out, options = Path(args.out), options_of(args)
    check_place(out, folder=True)
    places = find_sets(args.sets, reporter.warn)
    check_apart(places, out, FILES)
    with cluster_of(options.executor):  # is refused before any set is begun
        out.mkdir(parents=True, exist_ok=True)
    at_once, each = shared(options.threads(), len(places))
    found, jobs = _sorted_out(places, replace(options, workers=each), out, reporter)
    refused = [entry for entry in found.values() if not entry.finished]
    before = f"{len(found) - len(refused)} of them done before; {at_once} at once"
    reporter.say(f"{len(places)} sets, {before}")
    for entry in refused:
        reporter.say(_told(entry))
        append(out / LEDGER, entry)
    try:
        with closing(in_processes(jobs, at_once)) as entries_done:
            for entry in entries_done:
                append(out / LEDGER, entry)
                found[entry.set] = entry
                reporter.say(_told(entry))
                reporter.progress("sets", len(found), len(places))
    except KeyboardInterrupt:
        stop_heard()
        remove_leftovers(out)
        done = sum(entry.finished for entry in found.values())
        raise KeyboardInterrupt(f"{done} of {len(places)} sets are done; run it again to go on") from None
    remove_leftovers(out)
    entries = [found[place.name] for place in places]
    rewrite(out / LEDGER, entries)
    for name, text in ((TABLE, table_text(entries)), (PAGE, page_text(entries, out))):
        with staged_file(out / name) as stage:
            stage.write_text(text, encoding="utf-8", errors="backslashreplace")
    count = {
        status: sum(entry.status == status for entry in entries) for status in (DONE, DISTRUSTED, FAILED)
    }
    reporter.failed = count[FAILED] > 0
    reporter.distrusted = count[DISTRUSTED] > 0
    reporter.say(", ".join(f"{number} {status}" for status, number in count.items()) + f"; see {out / PAGE}")
    return {"sets": len(entries), "out": str(out), **count, "entries": [entry.set for entry in entries]}


def _sorted_out(
    places: Sequence[SetPlace], options: Options, out: Path, reporter: Reporter
) -> tuple[dict[str, SetEntry], list[Job]]:
    """What is known of sets by a ledger that is there, or since they cannot be read; and what is to be done."""
    known, found, jobs = read_ledger(out / LEDGER), dict[str, SetEntry](), list[Job]()
    with ThreadPoolExecutor(options.threads()) as pool:
        keys = pool.map(partial(_key_or_fault, options=options), places)
        for place, key in zip(places, keys, strict=True):
            entry = known.get(place.name)
            there = (out / place.name / "coefficients.json").is_file()
            if isinstance(key, InputError):
                found[place.name] = SetEntry(place.name, "", FAILED, str(key))
            elif entry is not None and entry.finished and entry.key == key and there:
                found[place.name] = entry
            else:
                jobs.append(Job(place, key, out / place.name, options))
            reporter.progress("looking at sets", len(found) + len(jobs), len(places))
    return found, jobs


def _key_or_fault(place: SetPlace, options: Options) -> str | InputError:
    try:
        return result_key(place, options)
    except InputError as error:
        return error


def _told(entry: SetEntry) -> str:
    return " ".join(f"{entry.set}: {entry.status}: {entry.said or entry.numbers['model']}".split())
