"""Results of finished photos, kept between runs under a hash of everything that they depend on."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np

from photogonio.capture.errors import InputError
from photogonio.reconstruct.table.facet_table import FacetTable
from photogonio.reconstruct.table.table_file import load_table, save_table

VARIABLE = "PHOTOGONIO_CACHE"  # environment: another folder; empty: keep nothing
MOST_BYTES = 2 << 30
SUFFIX = ".npz"


class Store:
    """A folder of facet tables and small files by key. Any number of runs may share it; a damaged entry counts as
    absent."""

    def __init__(self, folder: Path):
        self.folder = folder

    def get(self, key: str) -> FacetTable | None:
        path = self._path(key)
        try:
            table = load_table(path)
            os.utime(path)  # last used, for prune
        except (InputError, OSError):
            return None
        return table

    def put(self, key: str, table: FacetTable) -> bool:
        """Keep a table; False if the disk is full or cannot be written, which must not end a run."""
        path = self._path(key)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            save_table(table, path, compress=False)  # a tenth of the time
        except OSError:
            return False
        return True

    def get_array(self, key: str) -> np.ndarray | None:
        """Inverse of :meth:`put_array`; None if there is none."""
        try:
            return np.load(self._path(key, ".npy"), allow_pickle=False)
        except (OSError, ValueError, EOFError):
            return None

    def put_array(self, key: str, array: np.ndarray) -> bool:
        """Keep a small array; False if it cannot be."""
        return self.put_bytes(key, ".npy", lambda path: np.save(path, array))

    def put_bytes(self, key: str, suffix: str, write: Callable[[Path], object]) -> bool:
        """Keep a file that ``write`` makes at the path it is given; False if it cannot be."""
        path = self._path(key, suffix)
        part = path.with_name(f"{path.stem}.{os.getpid()}-{threading.get_ident()}.part{suffix}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write(part)
            os.replace(part, path)
        except OSError:
            return False
        return True

    def file(self, key: str, suffix: str) -> Path:
        """Where :meth:`put_bytes` keeps it."""
        return self._path(key, suffix)

    def prune(self, most_bytes: int = MOST_BYTES) -> None:
        """Drop what was not used for longest until the rest fits in ``most_bytes``."""
        try:
            found = [(path.stat(), path) for path in self.folder.glob("*/*") if path.is_file()]
            total = sum(stat.st_size for stat, _ in found)
            for stat, path in sorted(found, key=lambda entry: entry[0].st_mtime):
                if total <= most_bytes:
                    break
                path.unlink(missing_ok=True)
                total -= stat.st_size
        except OSError:
            return

    def _path(self, key: str, suffix: str = SUFFIX) -> Path:
        return self.folder / key[:2] / (key + suffix)


def default_store() -> Store | None:
    """The user's cache folder, or that of the environment's PHOTOGONIO_CACHE; None if that is set empty."""
    if VARIABLE in os.environ:
        named = os.environ[VARIABLE]
        return Store(Path(named)) if named else None
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local"
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Store(Path(base) / "photogonio" / "views")
