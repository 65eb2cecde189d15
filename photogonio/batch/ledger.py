"""What became of each set: one line of JSON a set, written whole, so that a batch that was killed goes on from it."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path

from photogonio.capture.errors import InputError
from photogonio.system.outputs import plain, staged_file

LEDGER = "ledger.jsonl"
DONE, DISTRUSTED, FAILED = "done", "not to be trusted", "failed"


@dataclass(frozen=True, slots=True)
class SetEntry:
    """One set; nothing that differs between runs."""

    set: str
    key: str  # of everything that the result depends on
    status: str  # DONE, DISTRUSTED or FAILED
    said: str = ""  # why it failed or is not to be trusted
    numbers: Mapping[str, object] = field(default_factory=dict)  # see .work.numbers_of
    result: str = ""  # SHA-256 of the coefficient file, if there is one

    @property
    def finished(self) -> bool:
        """Whether there is a result."""
        return self.status != FAILED

    def line(self) -> bytes:
        text = json.dumps(plain(asdict(self)), ensure_ascii=False, allow_nan=False) + "\n"
        return text.encode(errors="backslashreplace")  # a name that is no text, as JSON escapes it


def read_ledger(path: Path) -> dict[str, SetEntry]:
    """The last entry of each set. A line that a kill cut short, or that is none of ours, is passed over.

    Raises:
        InputError: it is there, and cannot be read.
    """
    try:
        lines = path.read_bytes().split(b"\n")
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise InputError(path, f"cannot be read: {(error.strerror or str(error)).lower()}") from None
    found = {}
    for line in lines[:-1]:  # what follows the last line's end was cut short
        try:
            values = json.loads(line)
        except (ValueError, RecursionError):
            continue
        if _is_entry(values):
            found[values["set"]] = SetEntry(**values)
    return found


def _is_entry(values: object) -> bool:
    """Whether it is all that :class:`SetEntry` has, and of its kinds."""
    if not isinstance(values, dict) or set(values) != {f.name for f in fields(SetEntry)}:
        return False
    words = all(isinstance(values[name], str) for name in ("set", "key", "status", "said", "result"))
    return words and values["status"] in (DONE, DISTRUSTED, FAILED) and isinstance(values["numbers"], dict)


def append(path: Path, entry: SetEntry) -> None:
    """Add a line in one write, on the disk before it returns.

    Raises:
        OSError: with the file's name.
    """
    try:
        _append(path, entry)
    except OSError as error:  # a write's has none
        raise OSError(error.errno, error.strerror, str(path)) from None


def _append(path: Path, entry: SetEntry) -> None:
    handle = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
    try:
        # a line that was cut short before must not run into this one
        size = os.fstat(handle).st_size
        torn = size > 0 and not _ends_line(path)
        rest = (b"\n" if torn else b"") + entry.line()
        while rest:  # all at once, but where the disk is about to be full
            rest = rest[os.write(handle, rest) :]
        os.fsync(handle)
    finally:
        os.close(handle)


def check_ledger(path: Path) -> None:
    """Whether a ledger that is there can be gone on with.

    Raises:
        InputError: it cannot be read, or not be written.
    """
    if path.exists() and not os.access(path, os.R_OK | os.W_OK):
        raise InputError(path, "cannot be read and written: permission denied")


def rewrite(path: Path, entries: Iterable[SetEntry]) -> None:
    """The whole ledger anew, in the order given: the same bytes whatever came first."""
    with staged_file(path) as stage:
        stage.write_bytes(b"".join(entry.line() for entry in entries))


def _ends_line(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-1, os.SEEK_END)
        return file.read(1) == b"\n"
