"""What is kept is believed only while it is whole; what is not is thrown away and made anew."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from benchmarks.damaged_cache import DAMAGES, NAMES, QUICK, damage, written
from photogonio.cache import running
from photogonio.cache.running import job_in
from photogonio.cache.store import Store, default_store
from photogonio.capture.errors import InputError
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


def kept(store, *names):
    for name in names:
        assert store.put_bytes(name, ".json", lambda path: path.write_bytes(bytes(100)))


def test_nothing_of_a_live_job_is_thrown_out(store):
    kept(store, "aa", "bb")
    for name in ("aa", "bb"):
        os.utime(store.folder / name / f"{name}.json", (1, 1))
    with job_in(store.folder), job_in(store.folder):
        kept(store, "cc", "dd")
        assert store.read("aa", ".json") is not None  # old, and used by the job
        store.prune(most_bytes=0)
        assert [name for name in ("aa", "bb", "cc", "dd") if store.read(name, ".json")] == ["aa", "cc", "dd"]
    assert list((store.folder / "running").iterdir()) == []
    store.prune(most_bytes=0)
    assert store.read("cc", ".json") is None


def test_a_job_that_was_killed_keeps_nothing_for_long(store):
    place = running._entered(store.folder / "running" / "job")
    kept(store, "aa")
    store.prune(most_bytes=0)
    assert store.read("aa", ".json") is not None
    beaten = store.folder / "running" / "job.alive"
    last = beaten.stat().st_mtime - running.GONE - 1
    os.utime(beaten, (last, last))
    store.prune(most_bytes=0)
    assert store.read("aa", ".json") is None
    assert place is not None and list(place.parent.iterdir()) == []


def test_a_job_that_slept_comes_back_with_all_that_is_its_own(store):
    place = running._entered(store.folder / "running" / "job")
    beginning = store.folder / "running" / "job.began"
    began = beginning.stat().st_mtime - 5.0
    running._leave(place)  # others took it for gone
    running._revive(place, began)
    assert beginning.stat().st_mtime == pytest.approx(began, abs=1e-3)
    kept(store, "aa")
    store.prune(most_bytes=0)
    assert store.read("aa", ".json") is not None


def test_entries_are_looked_at_once_for_so_much_that_was_put_in(tmp_path, monkeypatch):
    store, looks = Store(tmp_path, most_bytes=1000), []
    entries = store._entries
    monkeypatch.setattr(store, "_entries", lambda: looks.append(1) or entries())
    for k in range(40):  # 100 bytes and a seal of 32 each: a share of 50 bytes is reached by each
        kept(store, f"{k:02}")
        store.prune()
    assert len(looks) == 40 and sum(size for _, size, _ in entries()) <= 1000
    with job_in(store.folder):  # nothing goes; the more there is, the more seldom it is looked at
        looks.clear()
        for k in range(40, 240):
            kept(store, f"{k:03}")
            store.prune()
    assert len(looks) < 100


@pytest.mark.parametrize(
    ("text", "size"),
    [("", 2 << 30), ("500MB", 500_000_000), ("1.5 g", 1_500_000_000), ("2e9", 2_000_000_000)],
)
def test_the_environment_says_how_much_is_kept(monkeypatch, tmp_path, text, size):
    monkeypatch.setenv("PHOTOGONIO_CACHE", str(tmp_path))
    monkeypatch.setenv("PHOTOGONIO_CACHE_SIZE", text)
    assert default_store().most_bytes == size


@pytest.mark.parametrize("text", ["much", "-1", "1e999", "5 PB"])
def test_sizes_that_are_none_are_refused(monkeypatch, text):
    monkeypatch.setenv("PHOTOGONIO_CACHE_SIZE", text)
    with pytest.raises(InputError, match="PHOTOGONIO_CACHE_SIZE"):
        default_store()


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
