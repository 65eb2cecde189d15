"""Sets processed several at a time, in processes that stay: one start-up for many sets."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from photogonio.batch.ledger import DISTRUSTED, DONE, FAILED, SetEntry
from photogonio.batch.sets import SetPlace
from photogonio.cache.file_hashes import remembered_hashes
from photogonio.cache.kept import code_key, key_of
from photogonio.cache.store import default_store
from photogonio.capture.errors import InputError
from photogonio.capture.manifest.load import load_photoset
from photogonio.capture.photoset import MANIFEST
from photogonio.options import Options
from photogonio.pipeline import process
from photogonio.report.budget import budget_numbers
from photogonio.report.summary import numbers
from photogonio.report.trust import verdict_lines
from photogonio.result import Result
from photogonio.system.progress import Reporter
from photogonio.system.provenance import hash_file, hash_files

EACH = 1.2e9  # bytes that a set may need
TRIES = 2  # of a set whose process died


@dataclass(frozen=True, slots=True)
class Job:
    """One set to be processed."""

    place: SetPlace
    key: str
    out: Path
    options: Options


def result_key(place: SetPlace, options: Options) -> str:
    """A hash of the program, of what was asked, and of the set's files.

    Raises:
        InputError: the manifest cannot be used, or a photo cannot be read.
    """
    photoset = load_photoset(place.folder)
    files = [place.folder / name for name in sorted({photo.file for photo in photoset.photos})]
    store = default_store()
    try:
        manifest = hash_file(place.folder / MANIFEST)
        if store is None:
            hashes = hash_files(files, workers=1)
        else:
            hashes = remembered_hashes(store, key_of("hashes", str(place.folder)), files, workers=1)
    except OSError as error:
        raise InputError(error.filename or place.folder, error.strerror or "cannot be read") from None
    named = {path.relative_to(place.folder).as_posix(): digest for path, digest in hashes.items()}
    return key_of("batch", code_key(), options.to_dict(), manifest, named)


def processed(job: Job) -> SetEntry:
    """Process one set; a set that cannot be used is an entry too."""
    try:
        result = process(job.place.folder, job.out, job.options, Reporter(quiet=True))
    except InputError as error:
        return SetEntry(job.place.name, job.key, FAILED, str(error))
    said = " · ".join(verdict_lines(result.faults))
    status = DISTRUSTED if result.faults else DONE
    return SetEntry(job.place.name, job.key, status, said, numbers_of(result))


def numbers_of(result: Result) -> dict[str, object]:
    """What the summary says of a result."""
    found = numbers(result)
    kept = ("model", "scale", "channels", "albedo", "relative_median", "valid", "photos_used")
    roughness = [lobe.mean_roughness for lobe in result.brdf.lobes]
    return {
        **{name: found[name] for name in kept},
        "error": _albedo_error(result),
        "roughness": min(roughness) if roughness else None,
        "warnings": sorted({one.code for one in result.diagnoses}),
        "left_out": len(result.left_out),
    }


def _albedo_error(result: Result) -> list[float] | None:
    """Standard error of the albedo, relative, a channel; None where it is not known."""
    for one in budget_numbers(result.brdf):
        if one["of"] == "albedo":
            value, error = (np.asarray(one[name], float) for name in ("value", "standard_error"))
            return [float(e / v) for e, v in zip(error, value, strict=True)] if (value > 0.0).all() else None
    return None


def in_processes(
    jobs: Sequence[Job], workers: int, work: Callable[[Job], SetEntry] = processed
) -> Iterator[SetEntry]:
    """The entries of jobs as they are done, ``workers`` at a time. A set whose process dies is tried once more."""
    left, tries = {job.place.name: job for job in jobs}, dict.fromkeys((job.place.name for job in jobs), 0)
    while left:
        under_way: set[str] = set()
        for entry in _until_broken(list(left.values()), workers, work, under_way):
            del left[entry.set]
            yield entry
        for name in sorted(under_way & set(left)):  # their process died, or one beside it
            tries[name] += 1
            if tries[name] >= TRIES:
                job = left.pop(name)
                yield SetEntry(name, job.key, FAILED, "its process died, twice: is there memory enough?")


def _until_broken(
    jobs: Sequence[Job], workers: int, work: Callable[[Job], SetEntry], under_way: set[str]
) -> Iterator[SetEntry]:
    """Entries until all jobs are done or a process dies; ``under_way`` then names what was being done."""
    queue, waiting = list(jobs), dict[Future[SetEntry], str]()
    pool = ProcessPoolExecutor(min(workers, len(jobs)), get_context("spawn"), _on_its_own)
    try:
        while queue or waiting:
            while queue and len(waiting) < workers:
                job = queue.pop(0)
                waiting[pool.submit(work, job)] = job.place.name
                under_way.add(job.place.name)
            done, _ = wait(waiting, return_when=FIRST_COMPLETED)
            for future in done:
                entry = future.result()
                under_way.discard(waiting.pop(future))
                yield entry
        pool.shutdown()  # else what it holds of the system is told to have leaked
    except BrokenProcessPool:
        return
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def shared(workers: int, sets: int) -> tuple[int, int]:
    """How many sets at once, and with how many workers each."""
    at_once = max(1, min(workers, sets, int(_available() / EACH)))
    return at_once, max(1, workers // at_once)


def _available() -> float:
    """Bytes of memory that are free, where the system tells, or a scheduler such as SLURM allows; else as much as
    anybody wants."""
    return min(_free(), _allowed(Path("/sys/fs/cgroup")))


def _free() -> float:
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return 1024.0 * float(line.split()[1])
    except OSError:
        pass
    return float("inf")


def _allowed(root: Path) -> float:
    """What the process's own control group, and those above it, leave (version 2)."""
    left = float("inf")
    try:
        lines = Path("/proc/self/cgroup").read_text().splitlines()
        own = next((line[3:].lstrip("/") for line in lines if line.startswith("0::")), "")
    except OSError:
        return left
    for folder in (root / own, *(root / own).parents):
        try:
            most = (folder / "memory.max").read_text().strip()
            if most != "max":
                left = min(left, float(most) - float((folder / "memory.current").read_text()))
        except (OSError, ValueError):
            continue
        if folder == root:
            break
    return left


def _on_its_own() -> None:
    """Stops are the parent's business, which ends its workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ.setdefault("MPLBACKEND", "agg")
