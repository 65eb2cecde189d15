"""Processes that work on sets: one that dies takes no other set with it, and is never waited for."""

from __future__ import annotations

import os
import signal
import time
from multiprocessing import current_process
from pathlib import Path

from photogonio.batch.ledger import SetEntry
from photogonio.batch.processes import in_processes
from photogonio.batch.sets import SetPlace
from photogonio.batch.work import Job
from photogonio.options import Options
from photogonio.system import processes


def tried(job: Job) -> bool:
    """Whether a set was begun before; notes that it is."""
    before = job.out.exists()
    job.out.touch()
    return before


def wait_for(path: Path) -> None:
    while not path.exists():
        time.sleep(0.01)


def dying(job: Job) -> SetEntry:
    """Work whose process dies on one set, every time, and on another the first time, while a third is being done."""
    first = not tried(job)
    if job.place.name == "slow" and first:
        time.sleep(600.0)
    if job.place.name == "bad":
        wait_for(job.out.parent / "slow")
    if job.place.name == "worst" or (job.place.name == "bad" and first):
        os._exit(9)
    return SetEntry(job.place.name, job.key, "done")


def second_dies(job: Job) -> SetEntry:
    """Work that ends the process that was started last, while the others are at work."""
    if not tried(job):
        for name in "ab":
            wait_for(job.out.parent / name)
        if current_process().name == (job.out.parent / "last").read_text():
            os._exit(9)
        time.sleep(600.0)
    return SetEntry(job.place.name, job.key, "done")


def neighbour_killed(job: Job) -> SetEntry:
    """Work that kills the process beside it when that has nothing to do: it holds the lock of what is to be done."""
    (job.out.parent / f"{job.place.name}.pid").write_text(str(os.getpid()))
    other = job.out.parent / "b.pid"
    if job.place.name == "a" and not tried(job):
        wait_for(other)
        while not other.read_text():
            time.sleep(0.01)
        time.sleep(0.3)  # it has given its result, and waits
        os.kill(int(other.read_text()), signal.SIGKILL)
        time.sleep(600.0)
    return SetEntry(job.place.name, job.key, "done")


def jobs_of(folder: Path, *names: str) -> list[Job]:
    return [Job(SetPlace(name, folder), name, folder / name, Options()) for name in names]


def done_of(jobs: list[Job], work) -> dict[str, str]:
    return {entry.set: entry.status for entry in in_processes(jobs, 2, work)}


def test_a_process_that_dies_costs_its_set_a_try_and_no_other_its_result(tmp_path):
    found = done_of(jobs_of(tmp_path, "bad", "slow", "worst", "better"), dying)
    assert found == {"bad": "done", "slow": "done", "better": "done", "worst": "failed"}


def test_a_process_that_dies_unseen_by_the_executor_is_seen(tmp_path, monkeypatch):
    """It takes so long to start that the executor waits for the others alone by then."""

    class Slow(processes._Started):
        def Process(self, *args, **words):
            time.sleep(0.3)
            process = super().Process(*args, **words)
            (tmp_path / "last").write_text(process.name)
            return process

    monkeypatch.setattr(processes, "_Started", Slow)
    assert done_of(jobs_of(tmp_path, "a", "b"), second_dies) == {"a": "done", "b": "done"}


def test_a_process_that_dies_while_it_waits_for_work_is_seen(tmp_path):
    assert done_of(jobs_of(tmp_path, "a", "b"), neighbour_killed) == {"a": "done", "b": "done"}
