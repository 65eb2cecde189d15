"""Hashes of files that the system says did not change are not made again; of all others they are."""

import hashlib
import os
import time

import pytest

from photogonio.cache import file_hashes as hashes
from photogonio.cache.file_hashes import SETTLED, remembered_hashes
from photogonio.cache.store import Store

DAY = 86_400_000_000_000  # nanoseconds


@pytest.fixture
def later(monkeypatch):
    """A clock that is a day ahead: files made just now count as long unchanged."""
    now = time.time_ns
    monkeypatch.setattr(hashes.time, "time_ns", lambda: now() + DAY)


@pytest.fixture
def read(monkeypatch):
    """The names of files that were hashed."""
    names = []
    inner = hashes.hash_files

    def counted(paths, *, workers):
        names.extend(path.name for path in paths)
        return inner(paths, workers=workers)

    monkeypatch.setattr(hashes, "hash_files", counted)
    return names


def digests(*contents):
    return [hashlib.sha256(text.encode()).hexdigest() for text in contents]


def made(folder, **contents):
    paths = [folder / name for name in contents]
    for path, text in zip(paths, contents.values(), strict=True):
        path.write_text(text)
    return paths


def found(tmp_path, paths):
    return list(remembered_hashes(Store(tmp_path / "store"), "ab12", paths, workers=2).values())


def test_what_did_not_change_is_not_read_again(tmp_path, later, read):
    paths = made(tmp_path, a="one", b="two")
    assert found(tmp_path, paths) == digests("one", "two")
    read.clear()
    assert found(tmp_path, paths) == digests("one", "two")
    assert read == []


def test_other_bytes_of_the_same_size_and_time_are_seen(tmp_path, later, read):
    paths = made(tmp_path, a="one", b="two")
    before = paths[0].stat()
    found(tmp_path, paths)
    time.sleep(0.02)  # more than a tick of the file system's clock
    paths[0].write_text("eno")
    os.utime(paths[0], ns=(before.st_atime_ns, before.st_mtime_ns))
    read.clear()
    assert found(tmp_path, paths) == digests("eno", "two")
    assert read == ["a"]


def test_files_that_were_just_written_are_read_again(tmp_path, read):
    paths = made(tmp_path, a="one")
    assert SETTLED > 0
    for _ in range(2):
        found(tmp_path, paths)
    assert read == ["a", "a"]


def test_a_new_file_is_read_alone(tmp_path, later, read):
    paths = made(tmp_path, a="one")
    found(tmp_path, paths)
    paths += made(tmp_path, b="two")
    read.clear()
    assert found(tmp_path, paths) == digests("one", "two")
    assert read == ["b"]


@pytest.mark.parametrize("damage", ["", "[1]", '{"x": 3}', '{"x": [[1], 2, 3]}'])
def test_a_damaged_memory_counts_as_none(tmp_path, later, read, damage):
    paths = made(tmp_path, a="one")
    found(tmp_path, paths)
    Store(tmp_path / "store").put_bytes("ab12", ".json", lambda path: path.write_text(damage))
    assert found(tmp_path, paths) == digests("one")
    assert read == ["a", "a"]


def test_a_missing_file_is_an_error(tmp_path):
    with pytest.raises(OSError):
        found(tmp_path, [tmp_path / "none"])
