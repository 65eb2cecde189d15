"""Processes that work on sets: one that dies or fails takes no other set with it."""

import errno
import os
import time
from pathlib import Path
from unittest.mock import Mock

import pytest

from photogonio.batch import work
from photogonio.batch.ledger import SetEntry
from photogonio.batch.sets import SetPlace
from photogonio.batch.work import Job, in_processes
from photogonio.options import Options


def dying(job: Job) -> SetEntry:
    """Work whose process dies on one set, every time, and on another the first time, while a third is being done."""
    slow, first = job.out.parent / "slow", not job.out.exists()
    job.out.touch()
    if job.place.name == "slow" and first:
        time.sleep(600.0)
    while job.place.name == "bad" and not slow.exists():
        time.sleep(0.01)
    if job.place.name == "worst" or (job.place.name == "bad" and first):
        os._exit(9)
    return SetEntry(job.place.name, job.key, "done")


def jobs_of(folder: Path, *names: str) -> list[Job]:
    return [Job(SetPlace(name, folder), name, folder / name, Options()) for name in names]


def test_a_process_that_dies_costs_its_set_a_try_and_no_other_its_result(tmp_path):
    jobs = jobs_of(tmp_path, "bad", "slow", "worst", "better")
    found = {entry.set: entry.status for entry in in_processes(jobs, 2, dying)}
    assert found == {"bad": "done", "slow": "done", "better": "done", "worst": "failed"}


def test_whatever_ends_a_set_is_said_in_one_line_without_chance_in_it(tmp_path, monkeypatch):
    (job,) = jobs_of(tmp_path, "a")
    full = OSError(errno.ENOSPC, "No space left on device", str(tmp_path / ".part-host-12-ab-a"))
    for error, said in (
        (full, f"{job.out}: no space left on device"),
        (ValueError("a\nb"), "ValueError: a b"),
    ):
        monkeypatch.setattr("photogonio.pipeline.process", Mock(side_effect=error))
        entry = work.processed(job)
        assert entry.status == "failed" and entry.said.endswith(said)


def test_a_group_that_may_have_less_memory_than_is_free_has_less(tmp_path, monkeypatch):
    lines = Path("/proc/self/cgroup")
    own = lines.read_text().split("0::")[-1].strip().lstrip("/") if lines.is_file() else None
    if own is None:
        pytest.skip("the system has no control groups")
    (tmp_path / own).mkdir(parents=True, exist_ok=True)
    assert work._allowed(tmp_path) == float("inf")
    (tmp_path / own / "memory.max").write_text("5000\n")
    (tmp_path / own / "memory.current").write_text("1000\n")
    assert work._allowed(tmp_path) == 4000.0
