"""What is kept is believed only while it is whole; what is not is thrown away and made anew."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from benchmarks.damaged_cache import DAMAGES, NAMES, QUICK, damage, written
from photogonio.cache.store import Store
from photogonio.pipeline import process
from photogonio.report import page
from photogonio.system.progress import Reporter
from tests.drawn.tiny_set import TinySet

KEY = "ab12"


@pytest.fixture
def store(tmp_path) -> Store:
    return Store(tmp_path / "store")


def test_arrays_and_bytes_come_back(store):
    array = np.arange(6.0).reshape(2, 3)
    assert store.put_array(KEY, array)
    np.testing.assert_array_equal(store.get_array(KEY), array)
    assert store.put_bytes(KEY, ".json", lambda path: path.write_bytes(b"{}"))
    assert store.read(KEY, ".json") == b"{}"
    assert store.damaged == []
    assert sorted(path.name for path in (store.folder / "ab").iterdir()) == ["ab12.json", "ab12.npy"]


def test_every_bit_counts(store):
    store.put_bytes(KEY, ".json", lambda path: path.write_bytes(b"kept"))
    path = store.folder / "ab/ab12.json"
    whole = path.read_bytes()
    for place in range(len(whole)):
        for bit in range(8):
            path.write_bytes(whole[:place] + bytes([whole[place] ^ 1 << bit]) + whole[place + 1 :])
            assert store.read(KEY, ".json") is None
            assert not path.exists()
    assert len(store.damaged) == 8 * len(whole)


def test_an_entry_under_another_name_is_not_taken(store):
    store.put_bytes(KEY, ".json", lambda path: path.write_bytes(b"kept"))
    os.replace(store.folder / "ab/ab12.json", store.folder / "ab/ab99.json")
    assert store.read("ab99", ".json") is None


def test_what_cannot_be_written_leaves_nothing(store):
    def fail(path):
        path.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    assert not store.put_bytes(KEY, ".json", fail)
    assert list((store.folder / "ab").iterdir()) == []


def test_a_cache_that_is_a_file_keeps_nothing(tmp_path):
    (tmp_path / "store").write_text("x")
    store = Store(tmp_path / "store")
    assert not store.put_array(KEY, np.zeros(3))
    assert store.get_array(KEY) is None
    store.prune()
    assert (tmp_path / "store").read_text() == "x"


def test_the_oldest_go_first(store):
    for k, name in enumerate(("aa", "bb", "cc")):
        store.put_bytes(name, ".json", lambda path: path.write_bytes(bytes(100)))
        os.utime(store.folder / name / f"{name}.json", (k, k))
    (store.folder / "aa/nowhere").symlink_to("gone")
    store.prune(most_bytes=300)
    assert store.read("aa", ".json") is None
    assert store.read("cc", ".json") is not None


def test_a_damaged_cache_never_ends_a_run_and_gives_the_same_bytes(
    tmp_path, tiny_set: TinySet, monkeypatch, capsys
):
    """A few of what benchmarks/damaged_cache.py does by the hundred."""
    monkeypatch.setattr(page, "draw_pictures", lambda result, *, source: ())
    plain = written(tiny_set.folder, tmp_path / "plain")
    cache = tmp_path / "cache"
    monkeypatch.setenv("PHOTOGONIO_CACHE", str(cache))
    assert written(tiny_set.folder, tmp_path / "first") == plain
    rng = np.random.default_rng(4)
    for which in range(0, len(DAMAGES), 3):
        what = damage(cache, rng, which)
        assert written(tiny_set.folder, tmp_path / "again") == plain, what
    for path in filter(Path.is_file, cache.glob("*/*")):
        path.write_bytes(path.read_bytes()[:-1])
    process(tiny_set.folder, tmp_path / "told", QUICK, Reporter())
    assert "damaged files of the cache were thrown away" in capsys.readouterr().out
    assert {name: (tmp_path / "told" / name).read_bytes() for name in NAMES} == plain
