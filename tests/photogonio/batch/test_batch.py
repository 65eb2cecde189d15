"""Many sets: a bad one stops no other, what is done is not done again, and every run ends in the same bytes."""

import csv
import errno
import html
import io
import os
import re
import shutil
from dataclasses import replace
from urllib.parse import unquote_to_bytes, urljoin

import pytest

from photogonio.batch import ledger, passes, summary
from photogonio.batch.ledger import SetEntry, read_ledger
from photogonio.cli import main
from photogonio.commands import batch as command
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
    assert "::" not in entries["bad"].said
    assert (out / "b" / "c" / "report.html").is_file() and not (out / "bad").exists()


def test_the_summary_has_a_line_a_set(library):
    _, out = library
    rows = list(csv.DictReader((out / "summary.csv").read_text().splitlines()))
    assert [row["set"] for row in rows] == ["a", "b/c", "bad"]
    # the set is on a relative scale; noise of 2e-4 of full scale on pixels of a tenth of it
    assert float(rows[0]["albedo"]) > 0 and float(rows[0]["misfit"]) < 0.02 and rows[2]["albedo"] == ""
    # a hundred thousand noisy pixels tell the albedo to far better than a tenth; nothing is known to no error at all
    assert 0.0 < float(rows[0]["error"]) < 0.1 and rows[2]["error"] == ""
    assert [row["scale"] for row in rows] == ["relative", "relative", ""]
    page = (out / "summary.html").read_text()
    assert page.count("up to an unknown scale") == 2
    assert all(f'data-key="{key}"' in page for key in ("albedo", "roughness", "error", "count"))
    assert page.count('class="card"') == 3 and page.count("data:image/png") == 2
    assert "http://" not in page and "https://" not in page


def test_numbers_that_are_none_are_left_out():
    """A browser sorts nothing by what is no number."""
    numbers = {"albedo": [0.5, float("nan")], "roughness": float("inf"), "relative_median": [], "error": "?"}
    row = summary.row_of(SetEntry("a", "", "done", numbers=numbers))
    assert [row[name] for name in ("albedo", "roughness", "misfit", "error")] == [""] * 4


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


def test_a_result_that_another_run_has_written_since_is_none_of_the_ledgers(archive, library, tmp_path):
    out = tmp_path / "library"
    shutil.copytree(library[1], out)
    before = snapshot(library[1])
    # what `process` with other options, or a batch at the same time, may leave
    found = out / "a" / "coefficients.json"
    found.write_bytes(found.read_bytes().replace(b'"order 0', b'"order 1'))
    main(["batch", str(archive), "-o", str(out), *QUICK])
    after = snapshot(out)
    assert {name: data for name, (data, _) in after.items()} == {n: data for n, (data, _) in before.items()}


@pytest.mark.parametrize("name", ["ledger.jsonl", "summary.csv", "summary.html"])
def test_what_cannot_be_written_at_the_end_is_said_before_the_work(archive, tmp_path, capsys, name):
    (tmp_path / name).mkdir()
    assert main(["batch", str(archive), "-o", str(tmp_path), *QUICK]) == 2
    assert "is a folder" in capsys.readouterr().err
    assert os.listdir(tmp_path) == [name]


def test_a_ledger_that_cannot_be_gone_on_with_is_named(archive, tmp_path, capsys, monkeypatch):
    (tmp_path / "ledger.jsonl").write_text("")
    real = os.access
    monkeypatch.setattr(os, "access", lambda at, mode: not str(at).endswith(".jsonl") and real(at, mode))
    assert main(["batch", str(archive), "-o", str(tmp_path), *QUICK]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "ledger.jsonl: cannot be read and written" in line


def test_a_full_disk_is_named_in_words(archive, tmp_path, capsys, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(ledger.os, "fsync", full)
    assert main(["batch", str(archive / "bad"), "-o", str(tmp_path), *QUICK]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line == f"photogonio: {tmp_path}/ledger.jsonl: no space left on device"


def test_folders_that_cannot_be_read_are_no_success(archive, library, tmp_path, monkeypatch):
    out = tmp_path / "library"
    shutil.copytree(library[1], out)
    find = command.find_sets

    def found(words, warn):
        warn("lost: passed over, permission denied")
        return [place for place in find(words, warn) if place.name != "bad"]

    monkeypatch.setattr(command, "find_sets", found)
    assert main(["batch", str(archive), "-o", str(out), *QUICK]) == 1


def test_out_may_be_a_link_to_a_folder_that_is_not_there_yet(archive, tmp_path):
    (tmp_path / "link").symlink_to("made")
    main(["batch", str(archive / "bad"), "-o", str(tmp_path / "link"), *QUICK])
    assert (tmp_path / "link").is_symlink() and (tmp_path / "made" / "summary.html").is_file()


def test_a_stop_says_what_is_done_and_the_next_run_goes_on(archive, library, tmp_path, monkeypatch, capsys):
    out = tmp_path / "library"
    shutil.copytree(library[1], out)

    def stopped(jobs, workers, work):
        yield from ()
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(passes, "in_processes", stopped)
        assert main(["batch", str(archive), "-o", str(out), *QUICK]) == 130
    assert "2 of 3 sets are done" in capsys.readouterr().err
    assert main(["batch", str(archive), "-o", str(out), *QUICK]) == 1
    assert snapshot(out).keys() == snapshot(library[1]).keys()


def test_names_are_only_names_in_table_and_page(tmp_path):
    names = ["a,b", 'q"uo"te', "new\nline", "<b>&amp;", "hash#q?x%20/c:d", os.fsdecode(b"no-text-\xff")]
    entries = [SetEntry(name, "", "failed", "<i>no</i>") for name in names]
    table = summary.table_text(entries).encode(errors="backslashreplace").decode()
    rows = list(csv.DictReader(io.StringIO(table, newline="")))
    assert [row["set"] for row in rows] == [*names[:-1], r"no-text-\udcff"]
    page = summary.page_text([replace(one, status="done") for one in entries], tmp_path)
    assert "<i>no" not in page and "<b>&amp;<" not in page
    links = [html.unescape(link) for link in re.findall('href="([^"]*)"', page)]
    # as a browser reads them, relative to the page
    found = [unquote_to_bytes(urljoin("file:///out/summary.html", link)) for link in links]
    assert found == [b"file:///out/" + os.fsencode(name) + b"/report.html" for name in names]


@pytest.mark.parametrize("word", ["dask", "dask://here", "dask://:8786", "dask://a:0", "local:0", "local:x"])
def test_executors_that_are_none_are_refused(archive, word, capsys):
    with pytest.raises(SystemExit) as raised:
        main(["batch", str(archive), "--executor", word])
    assert raised.value.code == 2 and "local:N" in capsys.readouterr().err
