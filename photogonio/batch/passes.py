"""Sets gone through: what is known of them, and what is done with the others, each told in a ledger at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from photogonio.batch.ledger import FAILED, SetEntry, append, read_ledger, rewrite
from photogonio.batch.processes import in_processes
from photogonio.batch.sets import SetPlace
from photogonio.batch.work import Job, result_key
from photogonio.cache.kept import key_of
from photogonio.calib.rig.gaussian import NOTHING, RigPrior
from photogonio.capture.errors import InputError
from photogonio.options import Options
from photogonio.system.outputs import remove_leftovers, staged_file, to_json
from photogonio.system.progress import Reporter
from photogonio.system.stops import stop_heard


@dataclass(frozen=True, slots=True)
class Pass:
    """What is done with every set, the ledger that tells of it, and what is said."""

    work: Callable[[Job], SetEntry]
    ledger: str
    told: Callable[[SetEntry], str]


@dataclass(frozen=True, slots=True)
class LearnedRigs:
    """What sets are told of their rigs."""

    priors: Mapping[str, RigPrior] = field(default_factory=dict)  # by set
    rigs: Mapping[str, str] = field(default_factory=dict)  # likewise: the rig's name
    words: tuple[str, ...] = ()


def keys_of(places: Sequence[SetPlace], options: Options, reporter: Reporter) -> list[str | InputError]:
    """The key of each set's result, or why it has none."""
    keys = list[str | InputError]()
    with ThreadPoolExecutor(options.threads()) as pool:
        for key in pool.map(partial(_key_or_fault, options=options), places):
            keys.append(key)
            reporter.progress("looking at sets", len(keys), len(places))
    return keys


def _key_or_fault(place: SetPlace, options: Options) -> str | InputError:
    try:
        return result_key(place, options)
    except InputError as error:
        return error


def carried_out(
    jobs: Sequence[Job], found: dict[str, SetEntry], one: Pass, out: Path, at_once: int, reporter: Reporter
) -> None:
    """Jobs done and added to what is ``found``; sets that were refused are told of first.

    Raises:
        KeyboardInterrupt: with how far it has come.
    """
    total = len(found) + len(jobs)
    for entry in [entry for entry in found.values() if not entry.finished]:
        reporter.say(one.told(entry))
        append(out / one.ledger, entry)
    try:
        with closing(in_processes(jobs, at_once, one.work)) as entries_done:
            for entry in entries_done:
                append(out / one.ledger, entry)
                found[entry.set] = entry
                reporter.say(one.told(entry))
                reporter.progress("sets", len(found), total)
    except KeyboardInterrupt:
        stop_heard()
        remove_leftovers(out)
        done = sum(entry.finished for entry in found.values())
        raise KeyboardInterrupt(f"{done} of {total} sets are done; run it again to go on") from None


def learn(
    places: Sequence[SetPlace], options: Options, out: Path, at_once: int, reporter: Reporter
) -> LearnedRigs:
    """Each set calibrated by itself, and what all of a rig say together; pool.json."""
    # only here: a batch without a pool need not wait for it
    from photogonio.batch.learn import LEARNED, learned
    from photogonio.batch.rigs import POOL, expectations, pool_document, rig_words, rigs_of

    known, found, jobs = read_ledger(out / LEARNED), dict[str, SetEntry](), list[Job]()
    # what is asked of the fit bears on none of it
    for place, alone in zip(places, keys_of(places, Options(workers=options.workers), reporter), strict=True):
        entry = known.get(place.name)
        key = alone if isinstance(alone, InputError) else key_of("rig", alone)
        if isinstance(key, InputError):
            found[place.name] = SetEntry(place.name, "", FAILED, str(key))
        elif entry is not None and entry.key == key and entry.finished:
            found[place.name] = entry
        else:
            jobs.append(Job(place, key, out / place.name, options))
    done = sum(entry.finished for entry in found.values())
    reporter.say(f"learning of rigs: {len(places)} sets, {done} of them done before")
    carried_out(jobs, found, Pass(learned, LEARNED, _said_of_rig), out, at_once, reporter)
    entries = [found[place.name] for place in places]
    rewrite(out / LEARNED, entries)
    rigs = rigs_of(entries)
    with staged_file(out / POOL) as stage:
        stage.write_text(to_json(pool_document(rigs, entries)), encoding="utf-8", errors="backslashreplace")
    words = [line for rig in rigs for line in rig_words(rig)]
    for line in words:
        reporter.say(line)
    priors = {name: prior for rig in rigs for name, prior in expectations(rig, entries).items()}
    return LearnedRigs(priors, {name: rig.name for rig in rigs for name in rig.sets}, tuple(words))


def _said_of_rig(entry: SetEntry) -> str:
    return " ".join(f"{entry.set}: {entry.said or 'calibrated by itself'}".split())


def job_of(place: SetPlace, alone: str, out: Path, options: Options, rigs: LearnedRigs) -> Job:
    """A set to be processed, with what is expected of its rig; ``alone`` is its key without."""
    prior = rigs.priors.get(place.name, NOTHING)
    if not (prior.expected or prior.differs):
        return Job(place, alone, out / place.name, options)
    told = {one.name: one.sets for one in prior.expected}
    pool = {"rig": rigs.rigs[place.name], "alone": alone, "sets": told, "differs": list(prior.differs)}
    return Job(place, key_of("pool", alone, prior), out / place.name, options, prior, pool)
