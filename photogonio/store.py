"""Results of finished photos, kept between runs under a hash of everything that they depend on."""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np

import calib
import capture
import reconstruct
from capture.errors import InputError
from reconstruct.table import FacetTable, load_table, save_table

VARIABLE = "PHOTOGONIO_CACHE"  # environment: another folder; empty: keep nothing
MOST_BYTES = 2 << 30
SUFFIX = ".npz"


class Store:
    """A folder of facet tables by key. Any number of runs may share it; a damaged entry counts as absent."""

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

    def _path(self, key: str) -> Path:
        return self.folder / key[:2] / (key + SUFFIX)


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


def key_of(*parts: object) -> str:
    """A hash of plain values, arrays, and tuples, mappings and dataclasses of them: equal for equal contents.

    Raises ``TypeError`` for anything else, rather than to leave it out.
    """
    digest = hashlib.blake2b(digest_size=20)
    _feed(digest, parts)
    return digest.hexdigest()


def _feed(digest: hashlib.blake2b, value: object) -> None:
    if isinstance(value, np.ndarray):
        digest.update(f"array {value.dtype.str} {value.shape};".encode())
        digest.update(np.ascontiguousarray(value).data)
    elif is_dataclass(value) and not isinstance(value, type):
        digest.update(f"{type(value).__name__} ".encode())
        for f in fields(value):
            digest.update(f.name.encode() + b"=")
            _feed(digest, getattr(value, f.name))
    elif isinstance(value, Mapping):
        _feed(digest, sorted(value.items(), key=lambda item: repr(item[0])))
    elif isinstance(value, frozenset):
        _feed(digest, sorted(value))
    elif isinstance(value, (tuple, list)):
        digest.update(f"({len(value)} ".encode())
        for item in value:
            _feed(digest, item)
    elif value is None or isinstance(value, (str, bool, int, float, np.generic)):
        digest.update(f"{type(value).__name__} {value!r};".encode())
    else:
        raise TypeError(f"{type(value).__name__} has no key")


@lru_cache(maxsize=1)
def code_key() -> str:
    """A hash of the program text that photos go through, and of the libraries' versions."""
    digest = hashlib.blake2b(f"{np.__version__} {cv2.__version__} {sys.version_info[:2]}".encode())
    for package in (capture, calib, reconstruct):
        for path in sorted(Path(str(package.__file__)).parent.glob("*.py")):
            digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()
