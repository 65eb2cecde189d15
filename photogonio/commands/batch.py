"""``photogonio batch``."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from photogonio.batch.ledger import (
    DISTRUSTED,
    DONE,
    FAILED,
    LEDGER,
    SetEntry,
    check_ledger,
    read_ledger,
    rewrite,
)
from photogonio.batch.passes import LearnedRigs, Pass, carried_out, job_of, keys_of, learn
from photogonio.batch.sets import SetPlace, check_apart, find_sets
from photogonio.batch.summary import page_text, table_text
from photogonio.batch.work import Job, is_there, processed, shared
from photogonio.cache.running import job_in
from photogonio.cache.store import default_folder
from photogonio.capture.errors import InputError
from photogonio.commands.asked import options_of
from photogonio.options import Options
from photogonio.run.cluster import cluster_of
from photogonio.system.outputs import check_place, remove_leftovers, staged_file
from photogonio.system.progress import Reporter

TABLE, PAGE = "summary.csv", "summary.html"
FILES = (LEDGER, TABLE, PAGE)
OF_POOL = ("rigs.jsonl", "pool.json")


def run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    with job_in(default_folder()):
        return _run(args, reporter)


def _run(args: argparse.Namespace, reporter: Reporter) -> dict[str, object]:
    out, options = Path(args.out), options_of(args)
    files, unread = FILES + (OF_POOL if args.pool else ()), list[str]()
    _check_out(out, files)
    places = find_sets(args.sets, unread.append)
    check_apart(places, out, files)
    for line in unread:
        reporter.warn(line)
    with cluster_of(options.executor):  # is refused before any set is begun
        Path(os.path.realpath(out)).mkdir(
            parents=True, exist_ok=True
        )  # a link's own place may not be there yet
    at_once, each = shared(options.threads(), len(places))
    options = replace(options, workers=each)
    rigs = learn(places, options, out, at_once, reporter) if args.pool else LearnedRigs()
    found, jobs = _sorted_out(places, options, out, rigs, reporter)
    refused = [entry for entry in found.values() if not entry.finished]
    before = f"{len(found) - len(refused)} of them done before; {at_once} at once"
    reporter.say(f"{len(places)} sets, {before}")
    carried_out(jobs, found, Pass(processed, LEDGER, _told), out, at_once, reporter)
    remove_leftovers(out)
    entries = [found[place.name] for place in places]
    rewrite(out / LEDGER, entries)
    for name, text in ((TABLE, table_text(entries)), (PAGE, page_text(entries, out, rigs.words))):
        with staged_file(out / name) as stage:
            stage.write_text(text, encoding="utf-8", errors="backslashreplace")
    count = {
        status: sum(entry.status == status for entry in entries) for status in (DONE, DISTRUSTED, FAILED)
    }
    reporter.failed = count[FAILED] > 0 or bool(unread)
    reporter.distrusted = count[DISTRUSTED] > 0
    told = [f"{number} {status}" for status, number in count.items()]
    told += [f"{len(unread)} folders could not be read"] if unread else []
    reporter.say(", ".join(told) + f"; see {out / PAGE}")
    return {"sets": len(entries), "out": str(out), **count, "entries": [entry.set for entry in entries]}


def _check_out(out: Path, files: Sequence[str]) -> None:
    """Whether all that the end will bring can be written, before the work is done.

    Raises:
        InputError: it cannot.
    """
    if out.exists() and not out.is_dir():
        raise InputError(out, "is a file; expected a folder to write to")
    for name in files:
        check_place(out / name, folder=False)
    check_ledger(out / LEDGER)


def _sorted_out(
    places: Sequence[SetPlace], options: Options, out: Path, rigs: LearnedRigs, reporter: Reporter
) -> tuple[dict[str, SetEntry], list[Job]]:
    """What is known of sets by a ledger that is there, or since they cannot be read; and what is to be done."""
    known, found, jobs, changed = read_ledger(out / LEDGER), dict[str, SetEntry](), list[Job](), 0
    for place, key in zip(places, keys_of(places, options, reporter), strict=True):
        entry = known.get(place.name)
        there = entry is not None and is_there(entry, out / place.name)
        if isinstance(key, InputError):
            found[place.name] = SetEntry(place.name, "", FAILED, str(key))
            continue
        job = job_of(place, key, out, options, rigs)
        if entry is not None and entry.finished and entry.key == job.key and there:
            found[place.name] = entry
        else:
            jobs.append(job)
            pool = None if entry is None else entry.numbers.get("pool")
            changed += isinstance(pool, dict) and pool.get("alone") == key and there
    if changed:
        reporter.say(f"other sets say more of the rig, or less, than before: {changed} sets are done again")
    return found, jobs


def _told(entry: SetEntry) -> str:
    return " ".join(f"{entry.set}: {entry.status}: {entry.said or entry.numbers['model']}".split())
