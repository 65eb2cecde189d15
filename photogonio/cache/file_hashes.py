"""Hashes of a set's files, remembered between runs by what the system says of each file, as git's index does.

A file whose size, times, number and device are what they were has the bytes that it had: the time of its last change
(ctime) is the system's own and cannot be set back. Files changed so shortly before they were hashed that the clock
may not tell a second change apart are hashed again. Where the system keeps no such time, all are.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from photogonio.system.provenance import hash_files

if TYPE_CHECKING:
    from photogonio.cache.store import Store

SETTLED = 2_000_000_000  # nanoseconds since a file's last change: the coarsest clock of a file system ticks so often
Seen = tuple[int, int, int, int, int]  # size, mtime and ctime in nanoseconds, number, device


def remembered_hashes(store: Store, key: str, paths: Sequence[Path], *, workers: int) -> dict[Path, str]:
    """SHA-256 of files; those that ``store`` remembers under ``key`` and that did not change are not read.

    Raises OSError if a file cannot be read.
    """
    known = _load(store.read(key, ".json"))
    now, seen = time.time_ns(), {path: _seen(path) for path in paths}
    found = {path: known[str(path)][1] for path in paths if known.get(str(path), (None,))[0] == seen[path]}
    made = hash_files([path for path in paths if path not in found], workers=workers)
    found |= made
    kept = {
        str(path): (seen[path], found[path])
        for path in paths
        if path not in made or (now - seen[path][2] > SETTLED and _seen(path) == seen[path])
    }
    if made and os.name == "posix":  # elsewhere ctime is that of a file's making
        store.put_bytes(key, ".json", lambda part: part.write_text(json.dumps(kept), encoding="utf-8"))
    return {path: found[path] for path in paths}


def _seen(path: Path) -> Seen:
    stat = path.stat()
    return stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns, stat.st_ino, stat.st_dev


def _load(content: bytes | None) -> dict[str, tuple[Seen, str]]:
    """What was remembered; nothing if it cannot be read."""
    try:
        entries = json.loads(content or b"{}")
        return {path: (tuple(seen), str(digest)) for path, (seen, digest) in entries.items()}
    except (ValueError, TypeError, AttributeError):
        return {}
