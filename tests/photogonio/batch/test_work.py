"""One set of a batch: what ends it is said, and it has the memory that it may have."""

import errno
from pathlib import Path
from unittest.mock import Mock

import pytest

from photogonio.batch import work
from photogonio.batch.sets import SetPlace
from photogonio.batch.work import Job
from photogonio.options import Options


def test_whatever_ends_a_set_is_said_in_one_line_without_chance_in_it(tmp_path, monkeypatch):
    job = Job(SetPlace("a", tmp_path), "a", tmp_path / "a", Options())
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
