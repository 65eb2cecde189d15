"""The file of a facet table: the same bytes, and refused in a line where it is wrong."""

import zipfile
from dataclasses import replace

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.reconstruct.table.facet_table import LEFT_OUT
from photogonio.reconstruct.table.table_file import (
    load_table,
    load_with,
    packed_table,
    save_table,
    unpacked_table,
)
from tests.reconstruct.table.test_facet_table import assert_equal, samples, table_of


def test_the_file_gives_the_table_back_in_the_same_bytes(tmp_path):
    table = table_of(samples(1), "foto ü.png", left_out=np.arange(len(LEFT_OUT)))
    save_table(table, tmp_path / "a.npz")
    again = load_table(tmp_path / "a.npz")
    assert_equal(again, table)
    save_table(again, tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.npz", "b.npz"]


def test_what_hardly_packs_is_kept_as_it_is(tmp_path):
    table, noise = table_of(samples(1), "a"), np.random.default_rng(2).random(20_000)
    save_table(table, tmp_path / "a.npz", beside={"noise": noise, "even": np.zeros(20_000)})
    with zipfile.ZipFile(tmp_path / "a.npz") as archive:
        packed = {one.filename: one.compress_size < one.file_size for one in archive.infolist()}
    assert packed["even.npy"] and not packed["noise.npy"]
    found = load_with(tmp_path / "a.npz")[1]
    assert (found["noise"] == noise).all() and not found["even"].any()


def test_bytes_in_memory_give_the_table_back_and_nothing_else(tmp_path):
    table = table_of(samples(1), "foto ü.png", left_out=np.arange(len(LEFT_OUT)))
    packed = b"".join(packed_table(table))
    again = unpacked_table(packed, "kept")
    assert_equal(again, table)
    assert b"".join(packed_table(again)) == packed
    again.value[:] = 0.0  # as of any table
    line = packed.index(b"\n")
    spoilt = (
        b"",
        b"{}\n",
        b"[[1]]\n",
        packed[:-1],
        packed + b"\0",
        packed[line:],
        packed.replace(b"<f8", b"<f4", 1),
    )
    for damaged in (*spoilt, packed.replace(b"<f8", b"|O8", 1), packed.replace(b"value2", b"valueX", 1)):
        with pytest.raises(InputError, match="kept"):
            unpacked_table(damaged, "kept")


def test_a_file_of_before_a_reason_was_counted_has_none_of_it(tmp_path):
    table = table_of(samples(1), left_out=np.arange(1, len(LEFT_OUT) + 1))
    save_table(replace(table, left_out=table.left_out[:, :-1]), tmp_path / "old.npz")
    np.testing.assert_array_equal(load_table(tmp_path / "old.npz").left_out[0], [*range(1, len(LEFT_OUT)), 0])


@pytest.mark.parametrize("damage", ["text", "cut", "other arrays", "absent"])
def test_a_file_that_is_no_table_is_named(tmp_path, damage):
    path = tmp_path / "t.npz"
    if damage == "text":
        path.write_text("not a table")
    elif damage == "cut":
        save_table(table_of(samples(1)), path)
        path.write_bytes(path.read_bytes()[:2000])
    elif damage == "other arrays":
        np.savez(path, a=np.zeros(3))
    with pytest.raises(InputError, match=r"t\.npz"):
        load_table(path)


@pytest.mark.parametrize("finer", [-1, 9, 99, 2**62])
def test_a_refinement_that_is_not_possible_is_named(tmp_path, finer):
    save_table(replace(table_of(samples(1)), finer=finer), tmp_path / "t.npz")
    with pytest.raises(InputError, match=rf"t\.npz: finer: {finer} levels beyond"):
        load_table(tmp_path / "t.npz")
