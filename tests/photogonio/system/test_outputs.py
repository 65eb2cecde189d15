"""Outputs appear whole or not at all."""

import errno
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.system.outputs import (
    check_place,
    check_result_place,
    part_name,
    plain,
    remove_leftovers,
    staged_file,
    staged_folder,
    to_json,
)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_folder_appears_whole(tmp_path):
    with staged_folder(tmp_path / "out") as stage:
        (stage / "a").write_text("a")
        assert not (tmp_path / "out").exists()
    assert names(tmp_path) == ["out"]
    assert names(tmp_path / "out") == ["a"]


@pytest.mark.parametrize("error", [KeyboardInterrupt, InputError("x", "y"), RuntimeError])
def test_a_failed_folder_leaves_nothing(tmp_path, error):
    with pytest.raises(BaseException), staged_folder(tmp_path / "new/deep/out") as stage:  # noqa: B017
        (stage / "a").write_text("a")
        raise error
    assert names(tmp_path) == []


def test_a_failed_folder_keeps_the_former_result(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "a").write_text("old")
    with pytest.raises(RuntimeError), staged_folder(out) as stage:
        (stage / "a").write_text("new")
        raise RuntimeError
    assert (out / "a").read_text() == "old"
    assert names(tmp_path) == ["out"]


def test_a_folder_keeps_files_that_are_not_replaced(tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "mine").write_text("mine")
    (out / "a").write_text("old")
    with staged_folder(out) as stage:
        (stage / "a").write_text("new")
    assert names(out) == ["a", "mine"]
    assert (out / "a").read_text() == "new"


def test_a_file_appears_whole(tmp_path):
    with pytest.raises(RuntimeError), staged_file(tmp_path / "deep/a.json") as stage:
        stage.write_text("half")
        raise RuntimeError
    assert names(tmp_path) == []
    with staged_file(tmp_path / "a.json") as stage:
        assert stage.suffix == ".json"
        stage.write_text("whole")
    assert names(tmp_path) == ["a.json"]


def test_places_that_cannot_be_written_are_refused(tmp_path):
    (tmp_path / "file").write_text("")
    for target in (tmp_path / "file", tmp_path / "file/out"):
        with pytest.raises(InputError), staged_folder(target):
            pass
    with pytest.raises(InputError), staged_file(tmp_path):
        pass
    if os.geteuid() != 0:  # root may write anywhere
        (tmp_path / "shut").mkdir(mode=0o500)
        with pytest.raises(InputError), staged_file(tmp_path / "shut/a"):
            pass


def test_json_is_strict():
    value = {"a": np.float64(0.1), "b": np.array([1.0, np.nan]), 3: (np.int64(2), None, True, "é")}
    assert json.loads(to_json(value)) == {"a": 0.1, "b": [1.0, None], "3": [2, None, True, "é"]}
    assert plain(float("inf")) is None


def test_a_link_is_written_through(tmp_path):
    (tmp_path / "true").mkdir()
    for name, there in (("full", "true"), ("dangling", "to-come")):
        link = tmp_path / name
        link.symlink_to(tmp_path / there)
        with staged_folder(link) as stage:
            (stage / "a").write_text(name)
        assert link.is_symlink()
        assert (tmp_path / there / "a").read_text() == name
    (tmp_path / "link.json").symlink_to(tmp_path / "true/b.json")
    with staged_file(tmp_path / "link.json") as stage:
        stage.write_text("b")
    assert (tmp_path / "link.json").is_symlink()
    assert (tmp_path / "true/b.json").read_text() == "b"
    assert names(tmp_path) == ["dangling", "full", "link.json", "to-come", "true"]


def test_a_folder_where_a_file_must_be_is_refused_before_anything_is_replaced(tmp_path):
    out = tmp_path / "out"
    (out / "b").mkdir(parents=True)
    (out / "a").write_text("old")
    with pytest.raises(InputError, match="is a folder"), staged_folder(out) as stage:
        (stage / "a").write_text("new")
        (stage / "b").write_text("new")
    assert (out / "a").read_text() == "old"
    (out / "c").write_text("file")
    with pytest.raises(InputError, match="is a file"), staged_folder(out) as stage:
        (stage / "a").write_text("new")
        (stage / "c").mkdir()
        (stage / "c/d").write_text("new")
    assert (out / "a").read_text() == "old"
    assert names(tmp_path) == ["out"]


def test_what_a_dead_process_of_the_same_number_left_is_in_nobodys_way(tmp_path, monkeypatch):
    with staged_folder(tmp_path / "out") as stage:
        stage.joinpath("a").write_text("a")
        left = stage.name
    (tmp_path / left).mkdir()
    (tmp_path / left / "half").write_text("")
    with staged_folder(tmp_path / "out") as stage:
        (stage / "a").write_text("b")
    assert (tmp_path / "out/a").read_text() == "b"
    assert names(tmp_path) == sorted(["out", left])


def test_parts_are_named_by_host_process_and_chance_and_keep_the_suffix(monkeypatch):
    here = part_name("a.json")
    monkeypatch.setattr("socket.gethostname", lambda: "other/host")
    assert len({here, part_name("a.json"), part_name("a.json")}) == 3
    assert "other-host" in part_name("a.json")
    assert part_name("ä" * 300 + ".json").endswith(".json")
    assert len(part_name("ä" * 120 + ".json").encode()) < 255


def test_places_are_looked_at_before_the_work(tmp_path):
    (tmp_path / "file").write_text("")
    for target, folder in (("file", True), ("file/out", True), ("file/out/deep", False), (".", False)):
        with pytest.raises(InputError):
            check_place(tmp_path / target, folder=folder)
    check_place(tmp_path / "new/deep", folder=True)
    assert names(tmp_path) == ["file"]


def test_a_result_has_no_place_among_a_sets_photos(tmp_path):
    check_result_place(tmp_path)
    check_result_place(tmp_path / "out")
    (tmp_path / "photoset.toml").touch()
    with pytest.raises(InputError, match="is a photo set"):
        check_result_place(tmp_path)
    (tmp_path / "link").symlink_to(tmp_path)
    with pytest.raises(InputError, match="is a photo set"):
        check_result_place(tmp_path / "link")
    check_result_place(tmp_path / "out")


def test_devices_loops_and_places_that_only_pass_for_folders_are_refused_before_the_work(tmp_path):
    (tmp_path / "loop").symlink_to("loop")
    for place, folder, words in (
        (tmp_path / "loop", True, "leads to itself"),
        (tmp_path / "loop", False, "leads to itself"),
        (Path(os.devnull), False, "no ordinary file"),
        (Path("/proc/nobody-writes-here"), True, "cannot be written here"),
    ):
        if place.parent.is_dir():
            with pytest.raises(InputError, match=words):
                check_place(place, folder=folder)
    assert [path.name for path in tmp_path.iterdir()] == ["loop"]


def test_a_folder_that_is_there_to_be_read_is_refused_before_the_work(tmp_path, monkeypatch):
    """Its own place may be written, and the run would end when all is done."""
    (tmp_path / "out").mkdir()
    made = tempfile.TemporaryFile

    def denied(dir=None):
        if Path(dir) == tmp_path / "out":
            raise PermissionError(errno.EACCES, "Permission denied")
        return made(dir=dir)

    monkeypatch.setattr("photogonio.system.outputs.tempfile.TemporaryFile", denied)
    with pytest.raises(InputError, match="out: cannot be written here: permission denied"):
        check_place(tmp_path / "out", folder=True)
    check_place(tmp_path / "new", folder=True)


def test_what_dead_runs_left_is_taken_away_and_no_more(tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    mine, other = part_name("b"), part_name("c").replace(f"-{os.getpid()}-", f"-{dead.pid}-")
    elsewhere = other.replace(".part-", ".part-x")
    for name in (mine, other, elsewhere, "set"):
        (tmp_path / "a" / name / "deep").mkdir(parents=True)
    remove_leftovers(tmp_path)
    assert sorted(path.name for path in (tmp_path / "a").iterdir()) == sorted([mine, elsewhere, "set"])
