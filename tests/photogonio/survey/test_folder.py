"""Photos of a folder that is watched come once, whole, and with the roles of their names."""

import os
import time

import pytest

from photogonio.capture.errors import InputError
from photogonio.survey.folder import SETTLED, SetFolder


def old(path, seconds=60.0):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b"x" * 9)
    os.utime(path, (time.time() - seconds,) * 2)


def test_photos_without_a_manifest_have_the_roles_of_their_names(tmp_path):
    old(tmp_path / "calibration" / "a.jpg")
    old(tmp_path / "b.png")
    old(tmp_path / "notes.txt")
    found = [(p.file, p.role) for p in SetFolder.of(tmp_path).photos()]
    assert found == [("b.png", "sample"), ("calibration/a.jpg", "calibration")]


def test_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(InputError, match="no photo"):
        SetFolder.of(tmp_path).photos()
    with pytest.raises(InputError, match="no such folder"):
        SetFolder.of(tmp_path / "none")


def test_files_come_once_they_have_settled(tmp_path):
    old(tmp_path / "there.jpg")
    now = [0.0]
    rounds = iter([False, False, False, True])
    (tmp_path / "coming.jpg").write_bytes(b"x")

    def stop():
        now[0] += 0.6 * SETTLED
        return next(rounds)

    found = [p.file for p in SetFolder.of(tmp_path).arriving(stop, lambda: now[0])]
    assert found == ["there.jpg", "coming.jpg"]


def test_a_file_that_grows_is_waited_for(tmp_path):
    now, rounds, path = [0.0], iter(range(6)), tmp_path / "coming.jpg"
    path.write_bytes(b"x")

    def stop():
        now[0] += 0.6 * SETTLED
        path.write_bytes(b"x" * (2 + next(rounds)))
        return path.stat().st_size > 5

    assert list(SetFolder.of(tmp_path).arriving(stop, lambda: now[0])) == []


def test_a_file_that_could_not_be_read_comes_again_when_it_has_grown(tmp_path):
    """As of a copy that pauses; one that could be read does not."""
    now, rounds = [0.0], iter(range(12))
    for name in ("read.jpg", "cut.jpg"):
        old(tmp_path / name)

    def stop():
        now[0] += 0.6 * SETTLED
        k = next(rounds)
        if k == 2:
            for name in ("read.jpg", "cut.jpg"):
                (tmp_path / name).write_bytes(b"x" * 99)
        return k > 8

    found = SetFolder.of(tmp_path).arriving(stop, lambda: now[0], {"cut.jpg"}.__contains__)
    assert [p.file for p in found] == ["cut.jpg", "read.jpg", "cut.jpg"]
