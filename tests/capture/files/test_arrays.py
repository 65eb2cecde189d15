"""Arrays out of files: those that were written, or one line; nothing is unpacked that a header only claims."""

from __future__ import annotations

import io

import numpy as np
import pytest

from photogonio.capture.errors import InputError
from photogonio.capture.files import arrays

RNG = np.random.default_rng(0)
HELD = {
    "empty": np.zeros((0, 3)),
    "scalar": np.array(2.5),
    "codes": RNG.integers(0, 65536, (3, 4)).astype(np.uint16),
    "columns": np.asfortranarray(RNG.normal(size=(4, 3))),
    "swapped": np.arange(5).astype(">i4"),
    "half": RNG.normal(size=6).astype(np.float16),
    "names": np.array(["R", "Grün"]),
    "flags": np.array([True, False]),
}


def packed(**held: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.savez_compressed(file, **held)
    return file.getvalue()


def same(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> bool:
    return one.keys() == other.keys() and all(np.array_equal(one[k], other[k]) for k in one)


def test_what_was_written_comes_back(tmp_path):
    (tmp_path / "a.npz").write_bytes(packed(**HELD))
    found = arrays.read_arrays(tmp_path / "a.npz", "a table")
    assert same(found, HELD)
    for name, array in found.items():
        assert array.dtype == HELD[name].dtype.newbyteorder("=") and array.shape == HELD[name].shape
        assert array.flags.c_contiguous and array.flags.writeable


def test_a_single_array_comes_back_and_nothing_else_is_one():
    file = io.BytesIO()
    np.save(file, HELD["codes"])
    assert np.array_equal(arrays.array_of(file.getvalue()), HELD["codes"])
    for content in (b"", file.getvalue()[:-1], file.getvalue() + b"\0", b"\x93NUMPY\x01\x00"):
        with pytest.raises(ValueError, match="no array"):
            arrays.array_of(content)


def test_objects_are_never_unpickled():
    file = io.BytesIO()
    np.save(file, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(ValueError, match="no array"):
        arrays.array_of(file.getvalue())


def test_a_flipped_byte_is_told_or_does_no_harm(tmp_path):
    """Of headers and content alike, which have checksums; a shorter directory is one of fewer arrays."""
    held = {name: HELD[name] for name in ("codes", "columns")}
    whole = packed(**held)
    told = 0
    for k in range(0, len(whole), 3):
        damaged = io.BytesIO(whole[:k] + bytes([whole[k] ^ 0x55]) + whole[k + 1 :])
        try:
            found = arrays.arrays_in(damaged, len(whole), "a.npz", "a table")
        except InputError as error:
            told += 1
            assert str(error).startswith("a.npz: ") and "\n" not in str(error)
        else:
            assert all(np.array_equal(array, held[name]) for name, array in found.items())
    assert told > len(whole) / 3 / 2
    for length in range(0, len(whole), 5):
        with pytest.raises(InputError, match=r"a\.npz: cannot be read as a table"):
            arrays.arrays_in(io.BytesIO(whole[:length]), length, "a.npz", "a table")


@pytest.mark.parametrize("spare", [0, -1])
def test_more_than_such_a_file_holds_is_not_unpacked(monkeypatch, spare):
    """To the byte: what all entries together say that they unpack to."""
    whole, entry = packed(a=np.zeros(2000)), 128 + 8 * 2000  # a header of 128 bytes
    monkeypatch.setattr(arrays, "UNPACKED", entry + spare)
    monkeypatch.setattr(arrays, "PACKED", 1)
    if spare < 0:
        with pytest.raises(InputError, match=r"a\.npz: would unpack to .* GB, which a table does not"):
            arrays.arrays_in(io.BytesIO(whole), len(whole), "a.npz", "a table")
    else:
        assert arrays.arrays_in(io.BytesIO(whole), len(whole), "a.npz", "a table")["a"].shape == (2000,)


def test_what_is_not_there_is_named(tmp_path):
    for path, said in ((tmp_path / "no.npz", "no such file"), (tmp_path, "is no file")):
        with pytest.raises(InputError, match=said):
            arrays.read_arrays(path, "a table")
