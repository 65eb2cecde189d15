"""Results of finished photos, kept between runs under a hash of everything that they depend on.

What is kept ends with a hash of itself and of its name, so that a damaged entry is known for one: it is thrown away,
told, and made anew.
"""

from __future__ import annotations

import hashlib
import io
import math
import os
import re
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from photogonio.cache.running import used_since
from photogonio.capture.errors import InputError
from photogonio.capture.files.arrays import array_of
from photogonio.system.outputs import part_name

if TYPE_CHECKING:  # tables bring compiled code, for which the first line of a check is not to wait
    from photogonio.reconstruct.table.facet_table import FacetTable

VARIABLE = "PHOTOGONIO_CACHE"  # environment: another folder; empty: keep nothing
SIZE_VARIABLE = "PHOTOGONIO_CACHE_SIZE"  # environment: how much is kept, such as 500MB or 20GB
MOST_BYTES = 2 << 30  # that are kept, unless it says otherwise
LARGEST = 2 << 30  # bytes of one entry; what is larger is none of ours
UNITS = {"": 1, "K": 10**3, "M": 10**6, "G": 10**9, "T": 10**12}
SUFFIX = ".table"
SEAL = 32  # bytes
SHARE = 0.05  # of what is kept that may be put in before old entries are looked for
PIECE = 1 << 20  # that are hashed at a time


class Store:
    """A folder of facet tables and small files by key. Any number of runs, threads and hosts may share it; nothing
    that is wrong with it ends a run."""

    def __init__(self, folder: Path, most_bytes: int = MOST_BYTES):
        self.folder, self.most_bytes = folder, most_bytes
        self.damaged: list[str] = []  # names of entries that were found so, and thrown away
        self._held = 0.0  # bytes that there were when all were looked at last
        self._since = math.inf  # bytes put in since; not looked at yet

    def get(self, key: str) -> FacetTable | None:
        from photogonio.reconstruct.table.table_file import unpacked_table

        content = self.read(key, SUFFIX)
        try:
            return None if content is None else unpacked_table(content, key)
        except InputError:
            self.discard(key, SUFFIX)
            return None

    def put(self, key: str, table: FacetTable) -> bool:
        """Keep a table; False if the disk is full or cannot be written."""
        from photogonio.reconstruct.table.table_file import packed_table

        return self.put_pieces(key, SUFFIX, packed_table(table))

    def get_array(self, key: str) -> np.ndarray | None:
        """Inverse of :meth:`put_array`; None if there is none."""
        content = self.read(key, ".npy")
        try:
            return None if content is None else array_of(content)
        except ValueError:
            self.discard(key, ".npy")
            return None

    def put_array(self, key: str, array: np.ndarray) -> bool:
        """Keep a small array; False if it cannot be."""
        packed = io.BytesIO()
        np.save(packed, array, allow_pickle=False)
        return self.put_pieces(key, ".npy", [packed.getvalue()])

    def put_bytes(self, key: str, suffix: str, write: Callable[[Path], object]) -> bool:
        """Keep a file that ``write`` makes at the path it is given; False if it cannot be."""

        def fill(part: Path, name: str) -> int:
            write(part)
            with part.open("r+b") as file:
                file.write(_seal(name, iter(lambda: file.read(PIECE), b"")))
                return file.tell()

        return self._put(key, suffix, fill)

    def put_pieces(self, key: str, suffix: str, pieces: Sequence[bytes]) -> bool:
        """Keep a file of these bytes, which are at hand; False if it cannot be."""
        return self._put(
            key, suffix, lambda part, name: part.write_bytes(b"".join([*pieces, _seal(name, pieces)]))
        )

    def _put(self, key: str, suffix: str, fill: Callable[[Path, str], int]) -> bool:
        """Keep the sealed file that ``fill`` makes at a path, for a name; it gives the size."""
        path = self._path(key, suffix)
        part = path.with_name(part_name(path.name))
        try:
            self._make_room(path)
            self._since += fill(part, path.name)
            os.replace(part, path)
        except OSError:
            return False
        finally:
            _remove(part)
        return True

    def read(self, key: str, suffix: str) -> bytes | None:
        """What was kept; None if there is none, or none that is whole."""
        path = self._path(key, suffix)
        try:
            if not path.is_file():
                if path.is_dir():
                    self.discard(key, suffix)
                return None
            whole = path.stat().st_size <= LARGEST
            content = path.read_bytes() if whole else b""
            os.utime(path)  # last used, for prune
        except OSError:
            return None
        body = content[:-SEAL]
        if len(content) < SEAL or content[-SEAL:] != _seal(path.name, [body]):
            self.discard(key, suffix)
            return None
        return body

    def discard(self, key: str, suffix: str) -> None:
        """Throw away an entry that is damaged, and remember that it was."""
        path = self._path(key, suffix)
        self.damaged.append(path.name)
        _remove(path)

    def prune(self, most_bytes: int | None = None) -> None:
        """Drop what was not used for longest until the rest fits in ``most_bytes`` (default: the store's), but for what
        live jobs used (:mod:`.running`).

        All entries are looked at only after a share of what there may be was put in: for n sets in one process that is
        work ~ n, not n^2, at the price of that share too much.
        """
        if most_bytes is None and self._since < SHARE * max(self.most_bytes, self._held):
            return
        most_bytes = self.most_bytes if most_bytes is None else most_bytes
        found = list(self._entries())
        total = sum(size for _, size, _ in found)
        self._held, self._since = float(total), 0.0
        if total <= most_bytes:
            return
        spared = used_since(self.folder)
        for used, size, path in sorted(found):
            if total <= most_bytes or used >= spared:
                break
            _remove(Path(path))
            total -= size

    def _entries(self) -> Iterator[tuple[float, int, str]]:
        """When each was used last, its bytes, its path."""
        for folder in self.folder.glob("??/"):
            try:
                with os.scandir(folder) as inside:
                    entries = list(inside)
            except OSError:
                continue
            for entry in entries:
                try:
                    stat = entry.stat(follow_symlinks=False)
                except OSError:  # another run was quicker
                    continue
                yield stat.st_mtime, stat.st_size, entry.path

    def _make_room(self, path: Path) -> None:
        """The folder for an entry, and no folder in its own place."""
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path, ignore_errors=True)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except FileExistsError:  # a file is in the folder's place
            if path.parent.parent != self.folder:
                raise
            path.parent.unlink(missing_ok=True)
            path.parent.mkdir(parents=True, exist_ok=True)

    def _path(self, key: str, suffix: str) -> Path:
        return self.folder / key[:2] / (key + suffix)


def _seal(name: str, pieces: Iterable[bytes]) -> bytes:
    digest = hashlib.blake2b(name.encode(), digest_size=SEAL)
    for piece in pieces:
        digest.update(piece)
    return digest.digest()


def _remove(path: Path) -> None:
    try:
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)
    except OSError:
        return


def default_store() -> Store | None:
    """The user's cache folder, or that of the environment's PHOTOGONIO_CACHE; None if that is set empty.

    Raises:
        InputError: PHOTOGONIO_CACHE_SIZE is no size.
    """
    most = size_of(os.environ.get(SIZE_VARIABLE, ""))
    if VARIABLE in os.environ:
        named = os.environ[VARIABLE]
        return _store_in(Path(named), most) if named else None
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local"
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return _store_in(Path(base) / "photogonio" / "views", most)


@lru_cache(maxsize=8)
def _store_in(folder: Path, most_bytes: int) -> Store:
    """One for all sets of a process, so that it knows what was put in."""
    return Store(folder, most_bytes)


def size_of(text: str) -> int:
    """Bytes of a size such as "500MB", "20 GB" or "2e9"; the default's if there is none.

    Raises:
        InputError: it is no size.
    """
    if not text.strip():
        return MOST_BYTES
    found = re.fullmatch(r"([0-9.]+(?:e[0-9]+)?)\s*([KMGT]?)B?", text.strip().upper().replace("E", "e"))
    try:
        return int(float(found[1]) * UNITS[found[2]]) if found else int("none")
    except (ValueError, OverflowError):
        raise InputError(
            SIZE_VARIABLE, f"expected a size such as 500MB or 20GB, found {text!r:.40}"
        ) from None


def default_folder() -> Path | None:
    """That of :func:`default_store`."""
    store = default_store()
    return None if store is None else store.folder
