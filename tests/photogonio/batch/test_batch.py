"""Many sets: a bad one stops no other, what is done is not done again, and every run ends in the same bytes."""

import csv
import os
import shutil
from pathlib import Path

import pytest

from photogonio.batch import work
from photogonio.batch.ledger import SetEntry, read_ledger
from photogonio.batch.sets import SetPlace
from photogonio.batch.work import Job, in_processes
from photogonio.cli import main
from photogonio.options import Options
from tests.drawn.tiny_set import TinySet

QUICK = ["--quiet", "--order", "0", "--lobes", "none", "--level", "2", "--executor", "local:2"]


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("archive")
    for name in ("a", "b/c", "bad"):
        made = TinySet(folder / name)
    made.replace("shape = 'sphere'", "shape = 'cube'")
    return folder


@pytest.fixture(scope="module")
def library(archive, tmp_path_factory):
    out = tmp_path_factory.mktemp("made") / "library"
    return main(["batch", str(archive), "-o", str(out), *QUICK]), out


def test_a_bad_set_is_named_and_stops_no_other(library):
    status, out = library
    assert status == 1
    entries = read_ledger(out / "ledger.jsonl")
    assert {name: entry.status for name, entry in entries.items()} == {
        "a": "done",
        "b/c": "done",
        "bad": "failed",
    }
    assert "shape" in entries["bad"].said and "photoset.toml" in entries["bad"].said
    assert (out / "b" / "c" / "report.html").is_file() and not (out / "bad").exists()


def test_the_summary_has_a_line_a_set(library):
    _, out = library
    rows = list(csv.DictReader((out / "summary.csv").read_text().splitlines()))
    assert [row["set"] for row in rows] == ["a", "b/c", "bad"]
    # the set is on a relative scale; noise of 2e-4 of full scale on pixels of a tenth of it
    assert float(rows[0]["albedo"]) > 0 and float(rows[0]["misfit"]) < 0.02 and rows[2]["albedo"] == ""
    # a hundred thousand noisy pixels tell the albedo to far better than a tenth; nothing is known to no error at all
    assert 0.0 < float(rows[0]["error"]) < 0.1 and rows[2]["error"] == ""
    page = (out / "summary.html").read_text()
    assert all(f'data-key="{key}"' in page for key in ("albedo", "roughness", "error", "count"))
    assert page.count('class="card"') == 3 and page.count("data:image/png") == 2
    assert "http://" not in page and "https://" not in page


def snapshot(out):
    return {
        path.relative_to(out): (path.read_bytes(), path.stat().st_mtime_ns)
        for path in sorted(out.rglob("*"))
        if path.is_file()
    }


def test_run_again_it_touches_no_finished_set_and_writes_the_same(archive, library, tmp_path):
    out = tmp_path / "library"
    shutil.copytree(library[1], out)
    before = snapshot(out)
    # as a kill leaves it: one set not in the ledger, and the last line cut short
    lines = (out / "ledger.jsonl").read_bytes().splitlines(keepends=True)
    (out / "ledger.jsonl").write_bytes(lines[0] + lines[1][:-9])
    (out / "summary.csv").unlink()
    assert main(["batch", str(archive), "-o", str(out), *QUICK]) == 1
    after = snapshot(out)
    assert {name: data for name, (data, _) in after.items()} == {
        name: data for name, (data, _) in before.items()
    }
    assert all(after[name][1] == before[name][1] for name in before if name.parts[0] == "a")


def test_a_changed_set_is_done_again(archive, library, tmp_path):
    copy, out = tmp_path / "archive", tmp_path / "library"
    shutil.copytree(archive, copy)
    shutil.copytree(library[1], out)
    keys = {name: entry.key for name, entry in read_ledger(out / "ledger.jsonl").items()}
    manifest = copy / "a" / "photoset.toml"
    manifest.write_text(manifest.read_text() + "\n# a remark\n")
    main(["batch", str(copy), "-o", str(out), *QUICK])
    found = read_ledger(out / "ledger.jsonl")
    assert found["a"].key != keys["a"] and found["b/c"].key == keys["b/c"]


def dying(job: Job) -> SetEntry:
    """Work whose process dies on one set, every time, and on another the first time."""
    if job.place.name == "worst" or (job.place.name == "bad" and not job.out.exists()):
        job.out.touch()
        os._exit(9)
    return SetEntry(job.place.name, job.key, "done")


def test_a_process_that_dies_costs_its_set_a_try(tmp_path):
    jobs = [
        Job(SetPlace(n, tmp_path), n, tmp_path / n, Options()) for n in ("bad", "good", "worst", "better")
    ]
    found = {entry.set: entry.status for entry in in_processes(jobs, 1, dying)}
    assert found == {"bad": "done", "good": "done", "better": "done", "worst": "failed"}


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


@pytest.mark.parametrize("word", ["dask", "dask://here", "dask://:8786", "dask://a:0", "local:0", "local:x"])
def test_executors_that_are_none_are_refused(archive, word, capsys):
    with pytest.raises(SystemExit) as raised:
        main(["batch", str(archive), "--executor", word])
    assert raised.value.code == 2 and "local:N" in capsys.readouterr().err
