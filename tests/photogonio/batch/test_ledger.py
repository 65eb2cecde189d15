"""The ledger: whatever a kill leaves of it, what was whole is found again."""

import os

import pytest

from photogonio.batch.ledger import DONE, FAILED, SetEntry, append, check_ledger, read_ledger, rewrite
from photogonio.capture.errors import InputError

ENTRIES = [SetEntry(f"set-{k}", f"key-{k}", DONE, "", {"albedo": [0.1 * k]}) for k in range(3)]


def test_what_is_written_is_read(tmp_path):
    path = tmp_path / "ledger.jsonl"
    assert read_ledger(path) == {}
    for entry in ENTRIES:
        append(path, entry)
    assert list(read_ledger(path).values()) == ENTRIES


def test_the_last_word_on_a_set_counts(tmp_path):
    path = tmp_path / "ledger.jsonl"
    append(path, SetEntry("set-0", "", FAILED, "no photos"))
    append(path, ENTRIES[0])
    assert read_ledger(path) == {"set-0": ENTRIES[0]}


@pytest.mark.parametrize("cut", range(2, 60, 7))
def test_a_line_cut_short_loses_itself_alone(tmp_path, cut):
    path = tmp_path / "ledger.jsonl"
    for entry in ENTRIES[:2]:
        append(path, entry)
    path.write_bytes(path.read_bytes()[:-cut])
    append(path, ENTRIES[2])
    assert read_ledger(path) == {"set-0": ENTRIES[0], "set-2": ENTRIES[2]}


def test_lines_that_are_none_of_ours_are_passed_over(tmp_path):
    path = tmp_path / "ledger.jsonl"
    strange = b'{}\n[1]\n"x"\n\xff\xfe\n' + b"[" * 100_000 + b"\n"
    for old, new in (
        (b'"done"', b'"Done"'),
        (b'"set-1"', b"[1]"),
        (b'"key-1"', b"null"),
        (b"{", b'{"more": 1, '),
    ):
        strange += ENTRIES[1].line().replace(old, new, 1)
    path.write_bytes(strange + ENTRIES[0].line() + b'{"set": 1}\n')
    assert read_ledger(path) == {"set-0": ENTRIES[0]}


def test_a_ledger_that_cannot_be_read_is_said(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_ledger(tmp_path)
    check_ledger(tmp_path / "none.jsonl")


def test_a_name_that_is_no_text_comes_back(tmp_path):
    entry = SetEntry(os.fsdecode(b"no-text-\xff"), "", FAILED)
    append(tmp_path / "ledger.jsonl", entry)
    assert read_ledger(tmp_path / "ledger.jsonl") == {entry.set: entry}


def test_the_whole_is_the_same_bytes_in_any_order_of_work(tmp_path):
    one, other = tmp_path / "a.jsonl", tmp_path / "b.jsonl"
    for path, order in ((one, ENTRIES), (other, ENTRIES[::-1])):
        for entry in order:
            append(path, entry)
        found = read_ledger(path)
        rewrite(path, [found[name] for name in sorted(found)])
    assert one.read_bytes() == other.read_bytes()
